"""Boots the linked firmware, from reset on: python boot.py ELF. Needs unicorn. Each stage that is not reached fails, and so does a control without a fault.

What it shows: that this very program, byte for byte, comes up, asks the chip for what it needs, samples at 4 kHz and answers. What it does not: pins, voltages, cycles, and
whatever of the chip is not in `chip.py`.
"""

import struct
import sys
import zlib

from chip import FLASH_REGISTERS, IRQ_SPI3, MICROSECOND, RCC, TIM4, Chip
from machine import FLASH, HZ

# A transmitter that the vehicle is bound to: where it is kept, address and channels.
KEPT = FLASH + 252 * 1024
ADDRESS = bytes([0x12, 0x34, 0x56, 0x78, 0x58])
HOPS = bytes([49, 7, 24, 15, 3, 51, 44, 2, 68, 23, 10, 73, 30, 19, 72, 47, 33, 58, 32, 50])


def segments(path):
    """Where the program's parts are in flash."""
    with open(path, "rb") as file:
        elf = file.read()
    assert elf[:4] == b"\x7fELF" and elf[4] == 1, "no ELF of 32 bits"
    table, count = struct.unpack_from("<I", elf, 28)[0], struct.unpack_from("<H", elf, 44)[0]
    parts = []
    for number in range(count):
        kind, begin, _, place, size, *_ = struct.unpack_from("<8I", elf, table + 32 * number)
        if kind == 1 and size:
            parts.append((place, elf[begin : begin + size]))
    return parts


def stage(what, holds, seen=""):
    print(f"    {what}{f': {seen}' if seen else ''}")
    assert holds, f"not reached: {what}"


def frame(number):
    return b"$M<" + bytes([0, number, number])


def answers(said):
    """Number and payload of every frame in what was said."""
    found = []
    while (at := said.find(b"$M>")) >= 0 and len(said) > at + 5 and len(said) >= at + 6 + said[at + 3]:
        size = said[at + 3]
        body, check = said[at + 3 : at + 5 + size], said[at + 5 + size]
        total = 0
        for byte in body:
            total ^= byte
        assert total == check, "a wrong checksum"
        found.append((body[1], bytes(body[2:])))
        said = said[at + 6 + size :]
    return found


def bound():
    """The stored image of a vehicle that knows a transmitter, and has the parameters of a new one: what is no number is left as it is."""
    record = struct.pack("<I", 1) + (ADDRESS + HOPS).ljust(160, b"\xff")
    return KEPT, record + struct.pack("<I", zlib.crc32(record))


def sticks(yaw, throttle):
    """A packet, sticks from 0 to 1: ANGLE, roll and pitch in the middle."""
    channels = [500, 500, 1000 - round(1000 * throttle), round(1000 * yaw), 0, 0, 0, 0]
    high = sum((channel >> 8) << 2 * place for place, channel in enumerate(channels))
    return bytes(channel & 0xFF for channel in channels) + struct.pack("<H", high)


def pulses(chip):
    """The four speed controllers', us."""
    prescaler = chip.register(TIM4 + 0x28) + 1
    return [chip.register(TIM4 + 0x34 + 4 * channel) * prescaler / MICROSECOND for channel in range(4)]


def looked_at(chip, until):
    """Runs on. Returns samples, and instructions of the flight task's interrupt by sample, the short ones that it was interrupted by included."""
    spent = [0]

    def note(number, cycles):
        if number == IRQ_SPI3:
            spent[0] += cycles

    chip.machine.on_exit, before = note, chip.inertial.samples
    chip.machine.run(until)
    chip.machine.on_exit = lambda number, cycles: None
    samples = chip.inertial.samples - before
    return samples, spent[0] // max(1, samples)


def boots(parts):
    chip = Chip([*parts, bound()])
    machine = chip.machine
    chip.reset()
    hand = [0.5, 0.0]
    chip.transmit(ADDRESS, HOPS, lambda: sticks(*hand))
    machine.run(0.02)
    multiplier, source = chip.register(RCC + 4) >> 18 & 0xF, chip.register(RCC + 4) & 3
    is_halved = chip.register(RCC + 4) >> 8 & 7 == 4
    waits = chip.register(FLASH_REGISTERS) & 7
    stage("64 MHz from the PLL, the first bus halved, two wait states", (source, multiplier, is_halved, waits) == (2, 14, True, 2))
    least = pulses(chip)
    runs = chip.register(TIM4) & 1 and chip.register(TIM4 + 0x20) & 0x1111 == 0x1111
    stage("four pulses of the least length, before anything waits", runs and all(120 < pulse <= 126 for pulse in least), f"{least[0]:.1f} us")

    machine.run(0.2)
    stage("the look at the serial line's pin is over, and the watchdog runs", chip.guarded and 0.1 <= chip.fed[0] < 0.11, f"{chip.fed[0] * 1e3:.1f} ms")
    stage("the radio listens", chip.radio.registers[0] & 3 == 3)
    machine.run(0.5)
    settings = bytes(chip.inertial.registers[0x19:0x1D])
    stage("the inertial sensor is awake, with its ranges", settings == b"\x00\x00\x18\x18" and chip.inertial.registers[0x6B] == 3, settings.hex(" "))

    fed, taken = len(chip.fed), chip.radio.taken
    samples, each = looked_at(chip, 0.7)
    stage("4000 samples in a second", abs(samples - 800) <= 2, f"{samples} in 0.2 s")
    gap = max(after - before for before, after in zip(chip.fed[fed:], chip.fed[fed + 1 :]))
    stage("each pass feeds the watchdog, which has not bitten", gap < 0.001 and chip.bitten is None, f"{gap * 1e6:.0f} us at most in between")
    stage("the receiver is in step with its transmitter", chip.radio.taken - taken >= 20, f"{chip.radio.taken - taken} packets in 0.2 s")
    stage("the flight task leaves half of the processor", each < HZ // 4000 // 2, f"{each} instructions in a period of {HZ // 4000} cycles")
    stage("the converter and the lights go on", chip.conversions >= 5 and min(chip.lights) > 0, f"{chip.conversions} conversions")

    for number in (100, 108):
        chip.heard += frame(number)
        machine.run(machine.seconds() + 0.05, lambda number=number: any(answer[0] == number for answer in answers(chip.said)))
    said = dict(answers(chip.said))
    stage("MSP is answered", 100 in said and 108 in said, f"version {said.get(100, b'?')[0]}, attitude {struct.unpack('<3h', said[108][:6]) if 108 in said else None}")
    assert said[100][:2] == b"\xf0\x03", "not what it is"

    hand[:] = [1.0, 0.0]
    machine.run(machine.seconds() + 0.1)
    stage("armed, and the motors stand", pulses(chip) == least)
    hand[:] = [0.5, 0.5]
    machine.run(machine.seconds() + 0.1)
    samples, each = looked_at(chip, machine.seconds() + 0.1)
    turning = pulses(chip)
    stage("half throttle turns them, and it is in time", all(180 < pulse < 195 for pulse in turning) and abs(samples - 400) <= 2, f"{', '.join(f'{pulse:.1f}' for pulse in turning)} us")
    stage("flying, too, the task leaves half of the processor", each < HZ // 4000 // 2, f"{each} instructions")


def refuses(parts):
    """Each with a fault that has to be seen."""
    chip = Chip(parts, identity=0x70)
    chip.reset()
    chip.machine.run(0.5)
    stage("control, another inertial sensor: no sample, and passes go on", chip.inertial.samples == 0 and chip.bitten is None and len(chip.fed) > 100)
    chip = Chip(parts, held=True)
    chip.reset()
    chip.machine.run(1.0)
    stage("control, the serial line's pin is held low: it is made new, and does not fly", not chip.fed and chip.inertial.samples == 0 and min(chip.lights) > 0)
    chip = Chip(parts, lost=[IRQ_SPI3])
    chip.reset()
    chip.machine.run(0.25, lambda: chip.bitten is not None)
    after = (chip.bitten or 0.0) - chip.fed[0]
    stage("control, the flight task stops: the watchdog bites", chip.bitten is not None and 0.095 < after < 0.105, f"{after * 1e3:.1f} ms")


def main():
    parts = segments(sys.argv[1])
    print(f"{sum(len(data) for _, data in parts)} bytes in flash, from reset:")
    boots(parts)
    refuses(parts)


main()
