"""The ESP32-C6's interrupt controller, which labwired 0.25.0 has not: PLIC_MX at 0x2000_1000.

esp-hal and ESP-IDF enable lines, give them priorities and mask them there (ESP32-C6 technical reference manual, chapter on the
high-performance CPU, section "Interrupt Controller"); labwired routes sources to lines by other registers, INTPRI at 0x600C_5000,
which have no threshold that this firmware writes. And the state of the sources, INTMTX_CORE0_INT_STATUS, is never anything but
zero there, so that a handler finds nothing to handle.

So every few cycles, and at every instruction while a software interrupt asks, this looks at the sources, writes their state where
the firmware reads it, and lets the line that PLIC_MX would take interrupt the core: by a software interrupt that the firmware does
not use, and by labwired's own route, for as long as one instruction takes. A core whose interrupts are off is not interrupted by
that.
"""

import struct

MATRIX = 0x6001_0000
STATUS = MATRIX + 0x134
INTPRI = 0x600C_5000
FROM_CPU = INTPRI + 0x90
PLIC = 0x2000_1000
# Where each source that is used shows whether it asks, by its number in the matrix.
SOURCES = {
    22: (FROM_CPU, 1),
    23: (FROM_CPU + 4, 1),
    48: (0x6000_F00C, 0xFFFF),  # USB serial
    49: (0x6000_603C, 0xFFFF),  # the lights' pulses, `lights.py`
    50: (0x6000_402C, 0x3_FFFF),  # I2C
    51: (0x6000_8078, 1),  # timer group 0: the executor's alarms
    54: (0x6000_9078, 1),  # timer group 1: the cut-off
    57: (0x6000_A070, 1),  # system timer
    72: (0x6008_1040, 0x1F_FFFF),  # SPI
}
QUICK = (22, 23)
SLOW = tuple(number for number in SOURCES if number not in QUICK)
# The firmware uses software interrupts 0 and 1; this one is number 3.
SPARE, SPARE_REGISTER = 25, FROM_CPU + 12
CHUNK = 64
# Instructions within which a software interrupt has to be taken: more than the longest handler has.
SOON = 100_000
# Sources other than the software interrupts are looked at every so many chunks.
PATIENCE = 16


class Interrupts:
    """The controller, and units that it moves on before it looks at them."""

    def __init__(self, sim, *units):
        self.sim = sim
        self.units = units
        self.slow = self.shown = self.chunks = 0
        self.offered: dict[int, int] = {}

    def run(self, cycles: int):
        """Runs so many cycles."""
        for _ in range(cycles // CHUNK):
            self.sim.run_for(f"{CHUNK * 6250 // 1000}ns")
            self.chunks += 1
            # What asked a moment ago may have been answered since: a handler that is called for nothing clears what comes next.
            if self.slow or self.chunks % PATIENCE == 0:
                self.slow = self._units()
            if self._look():
                self._exchange()
            elif self.slow:
                self._step(self.slow)

    def _exchange(self):
        """Runs until no software interrupt asks: a thread that has asked to be exchanged counts on not running on.

        So every single instruction may be interrupted, the last one of another handler too. A thread that ran one instruction on
        might find nothing to do, and would say so when it is continued, whatever has come meanwhile.
        """
        for _ in range(SOON):
            self.slow = self._units()
            quick = self._look()
            if not quick:
                return
            self._step(self.slow | quick)
        raise RuntimeError("a software interrupt is not taken")

    def _look(self) -> int:
        """Shows the state of the sources, and returns which software interrupts ask.

        A state that lags behind would tell the next one that asks that it has been heard.
        """
        quick = self._asking(QUICK)
        if self.slow | quick != self.shown:
            self.shown = self.slow | quick
            for word in range(3):
                self.sim.write_u32(STATUS + 4 * word, self.shown >> 32 * word & 0xFFFF_FFFF)
        return quick

    def _units(self) -> int:
        """Which sources other than the software interrupts ask."""
        for unit in self.units:
            unit.poll()
        return self._asking(SLOW)

    def _asking(self, numbers: tuple[int, ...]) -> int:
        asking = 0
        for number in numbers:
            address, mask = SOURCES[number]
            if self.sim.read_u32(address) & mask:
                asking |= 1 << number
        return asking

    def _step(self, asking: int):
        """Runs one instruction, in whose place the core may be interrupted."""
        plic = struct.unpack("<38I", self.sim.read_memory(PLIC, 152))
        enabled, priorities, threshold = plic[0], plic[4:36], plic[36]
        lines = []
        for number in SOURCES:
            if asking >> number & 1:
                line = self.sim.read_u32(MATRIX + 4 * number) & 31
                if line and enabled >> line & 1 and priorities[line] >= max(threshold, 1):
                    lines.append((priorities[line], -line, number))
        if not lines:
            self.sim.run_for("6ns")
            return
        _, line, number = max(lines)
        self.offered[number] = self.offered.get(number, 0) + 1
        self._offer(-line)

    def _offer(self, line: int):
        write = self.sim.write_u32
        write(MATRIX + 4 * SPARE, line)
        write(INTPRI + 0x0C + 4 * line, 15)
        write(INTPRI + 0x8C, 0)
        write(SPARE_REGISTER, 1)
        write(INTPRI, 1 << line)
        self.sim.run_for("6ns")
        write(INTPRI, 0)
        write(SPARE_REGISTER, 0)
