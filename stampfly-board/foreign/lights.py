"""The ESP32-C6's unit that makes the lights' pulses, which labwired 0.25.0 has not: RMT at 0x6000_6000.

Registers as in the ESP32-C6's technical reference manual, chapter "Remote Control Peripheral", as far as a transmission needs them.
Until it `works`, no pulse ever ends, as in a chip with a fault; then all of them end as soon as they begin, with an interrupt.
"""

RMT = 0x6000_6000
CONF0, RAW, STATE, ENABLED, CLEAR, MEMORY = RMT + 0x10, RMT + 0x38, RMT + 0x3C, RMT + 0x40, RMT + 0x44, RMT + 0x400
START = 1
# Words of memory of a channel.
BLOCK = 48
# Lights at each channel: status, body.
LIGHTS = (1, 2)
# How long a zero and a one are high and low, in 12.5 ns, each within 150 ns (WS2812B, data sheet, "Data transfer time").
SHAPES = {0: (32, 68), 1: (64, 36)}
TOLERANCE = 12


class Pulses:
    def __init__(self, sim):
        self.sim = sim
        self.works = False
        # Red, green and blue of each light, of all that was written: status, body.
        self.written: tuple[list, ...] = ([], [])

    def poll(self):
        read, write = self.sim.read_u32, self.sim.write_u32
        raw = read(RAW) & ~read(CLEAR)
        write(CLEAR, 0)
        for channel, lights in enumerate(LIGHTS):
            conf = read(CONF0 + 4 * channel)
            if conf & START and self.works:
                write(CONF0 + 4 * channel, conf & ~START)
                self.written[channel].append([self._colour(channel, light) for light in range(lights)])
                raw |= 1 << channel
        write(RAW, raw)
        write(STATE, raw & read(ENABLED))

    def _colour(self, channel: int, light: int) -> tuple[int, int, int]:
        """What a light makes of its pulses."""
        colour = 0
        for pulse in range(24 * light, 24 * light + 24):
            word = self.sim.read_u32(MEMORY + 4 * (BLOCK * channel + pulse))
            # Its level in the highest bit of each half: first high, then low.
            high, low = word & 0xFFFF, word >> 16
            lengths = (high ^ 0x8000, low)
            bits = [bit for bit, shape in SHAPES.items() if all(abs(a - b) <= TOLERANCE for a, b in zip(lengths, shape))]
            if len(bits) != 1:
                raise RuntimeError(f"a light does not understand a pulse of {high:#x} and {low:#x}")
            colour = colour << 1 | bits[0]
        # The light's order is green, red, blue.
        return colour >> 8 & 0xFF, colour >> 16, colour & 0xFF
