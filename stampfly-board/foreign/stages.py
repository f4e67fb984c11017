"""Runs the firmware on a machine that is not ours and says how far it comes: `stages.py FIRMWARE MASK_ROM RECORD`.

Exit code 0 when every stage that is known to be reached was reached, and every control was refused.
"""

import sys
import time
from pathlib import Path

from interrupts import Interrupts
from lights import Pulses
from machine import Board
from program import Program

GPIO_OUT, GPIO_ENABLE, GPIO_FUNCTION = 0x6009_1004, 0x6009_1020, 0x6009_1554
# `esp32s3/src/pins.rs`, the table of the ESP32-C6.
MOTORS = 0b1111
SELECTS = 1 << 7 | 1 << 8
LIGHT_SUPPLY = 1 << 23
# The signal of a pin that does what the GPIO registers say (technical reference manual, "Simple GPIO Output").
PLAIN = 128
# CPU clock: from the crystal at reset, from the PLL when esp-hal has started the chip.
SYSCLK = 0x6009_6110
# Idle level of the SPI clock, bit 29 of SPI_MISC.
SPI_MISC, IDLE_HIGH = 0x6008_1020, 1 << 29
LEDC_DUTIES = [0x6000_7008 + 0x14 * channel for channel in range(4)]
GOOD = "self test: every bit as recorded"
# The row of `control` in the activation table, `stampfly-board/src/schedule.rs`, which has so many.
CONTROL, ACTIVATIONS = 5, 12
SENSORS = ["imu", "flow", "tof", "tof_front", "mag", "baro", "power"]
# Without an inertial sensor the flight band runs every 10 ms. The lights are first written after five to eight of them, and do not end.
PASSES = 50
# What the lights show of a vehicle without an inertial sensor (`stampfly-mode/src/signal.rs`).
RED, WHITE = [(32, 0, 0)], [(32, 32, 32)] * 2
# Timer group 1, by its number in the interrupt matrix.
CUT_OFF = 54
MILLION = 1_000_000


class Missed(Exception):
    """A stage that was not reached."""


def expect(condition: bool, what: str):
    if not condition:
        raise Missed(what)


def say(what: str):
    print(what, flush=True)


def pins(board: Board) -> tuple[int, int]:
    return board.sim.read_u32(GPIO_ENABLE), board.sim.read_u32(GPIO_OUT)


def motors_low(board: Board):
    """Runs until all motor pins are outputs, and sees that they are low and that nothing came before."""
    clock = board.sim.read_u32(SYSCLK)
    for _ in range(4_000):
        board.run(200)
        enabled, out = pins(board)
        if enabled & MOTORS == MOTORS:
            break
    expect(enabled & MOTORS == MOTORS, "the motors' pins never become outputs")
    expect(out & MOTORS == 0, "a motor's pin is high")
    functions = board.words(GPIO_FUNCTION, 4)
    expect(all(function & 0xFF == PLAIN for function in functions), "something else drives a motor's pin")
    expect(enabled & SELECTS != SELECTS, "the chip selects came before the motors")
    expect(board.sim.read_u32(SYSCLK) == clock, "the clocks came before the motors")
    return clock


def selects_high(board: Board, clock: int):
    """The same of the chip selects, before the clocks."""
    for _ in range(100):
        enabled, out = pins(board)
        if enabled & out & SELECTS == SELECTS:
            break
        expect(out & MOTORS == 0, "a motor's pin is high")
        board.run(20)
    expect(enabled & out & SELECTS == SELECTS, "the chip selects are not high")
    expect(board.sim.read_u32(SYSCLK) == clock, "the clocks came before the chip selects")


def golden_flight(board: Board, limit: int):
    """Runs until the self test has spoken."""
    for _ in range(limit):
        board.run(MILLION)
        expect(pins(board)[1] & MOTORS == 0, "a motor's pin is high during the self test")
        said = [line for line in board.sim.uart_transcript().splitlines() if line.startswith("self test: ") and len(line) > 11]
        if said:
            expect(said[0].strip() == GOOD, said[0].strip())
            return
    raise Missed(f"the self test says nothing in {limit} million cycles")


def clock_idles_high(board: Board):
    """The flow sensor would take another level's change for a bit: it comes with the sensor already selected."""
    expect(board.sim.read_u32(SPI_MISC) & IDLE_HIGH != 0, "the SPI clock idles low")


def light_has_supply(board: Board):
    enabled, out = pins(board)
    expect(enabled & out & LIGHT_SUPPLY != 0, "the supply of the status light is off")


class Flying:
    """The tasks, with interrupts."""

    def __init__(self, board: Board, program: Program, interrupts=Interrupts):
        self.board = board
        self.pulses = Pulses(board.sim)
        self.interrupts = interrupts(board.sim, self.pulses)
        self.profile, size = program.symbol("start07PROFILE")
        expect(size == 8 + 32 * ACTIVATIONS, "the table of the run times is not as large as it was")
        self.health, size = program.symbol("start06HEALTH")
        expect(size == 12 * len(SENSORS), "the table of the sensors is not as large as it was")

    def passes(self) -> int:
        """How often `control` ran: the classes of its times, added up (`stampfly-flight/src/profile.rs`)."""
        return sum(self.board.words(self.profile + 8 + 32 * CONTROL, 7))

    def motors_still(self) -> bool:
        """No duty in the PWM unit, and no level of the pins' own."""
        duties = [self.board.sim.read_u32(duty) for duty in LEDC_DUTIES]
        return not any(duties) and self.board.sim.read_u32(GPIO_OUT) & MOTORS == 0

    def sensors(self) -> dict[str, tuple[int, int, int]]:
        words = self.board.words(self.health, 3 * len(SENSORS))
        return {name: tuple(words[3 * number : 3 * number + 3]) for number, name in enumerate(SENSORS)}

    def run(self, limit: int, done) -> bool:
        """Runs until that is true, at most so many tenths of a million cycles."""
        for _ in range(limit):
            self.interrupts.run(MILLION // 10)
            expect(self.motors_still(), "a motor's duty is not zero on a vehicle that is not armed")
            if done():
                return True
        return False


class NoInterrupts(Interrupts):
    """A chip whose interrupts never come."""

    def run(self, cycles: int):
        self.sim.run_for(f"{cycles * 6250 // 1000}ns")


def spoilt(program: Program, record: bytes) -> Program:
    """The program with one bit of the recorded flight's beginning turned round: it is refused before it is flown."""
    other = Program(bytes(program.data))
    at = other.data.find(record)
    expect(at > 0, "the program has no recorded flight")
    other.data[at + 40] ^= 1
    return other


def refused(what: str, why: str, check):
    """A check that accepts everything would look just like one that found nothing."""
    try:
        check()
    except Missed as missed:
        expect(why in str(missed), f"{what}: refused, but because {missed}")
        say(f"refused, as it should be: {what}: {missed}")
        return
    raise Missed(f"{what} is accepted")


def controls(program: Program, rom: Program, record: bytes):
    """Machines and programs with a fault: each must miss its stage. The last one flies on, with its record damaged."""
    blind = Board(program, rom, without=("gpio",))
    refused("a chip whose pins do not obey", "never become outputs", lambda: motors_low(blind))
    early = Board(program, rom)
    clock = motors_low(early)
    early.sim.write_u32(GPIO_OUT, MOTORS & 0b0100)
    refused("a motor that is switched on", "a motor's pin is high", lambda: selects_high(early, clock))
    refused("a chip that has not started its SPI", "idles low", lambda: clock_idles_high(early))
    refused("a chip that has not switched the light on", "is off", lambda: light_has_supply(early))
    damaged = Board(spoilt(program, record), rom)
    refused("a bit of the recorded flight", "FAILED", lambda: golden_flight(damaged, 10))
    still = Flying(damaged, program, NoInterrupts)

    def dead():
        expect(still.run(20, lambda: still.passes() > 0), "no pass of the flight band")

    refused("a chip without interrupts", "no pass", dead)


def firmware(program: Program, rom: Program):
    """Every stage, one after the other."""
    begun = time.monotonic()
    board = Board(program, rom)

    def reached(what: str):
        say(f"reached after {board.sim.cycles / MILLION:.1f} million cycles, {time.monotonic() - begun:.0f} s: {what}")

    clock = motors_low(board)
    reached("motors low, before anything else")
    selects_high(board, clock)
    reached("chip selects high, before the clocks")
    golden_flight(board, 400)
    reached(GOOD)
    flying = Flying(board, program)
    expect(flying.run(60, lambda: flying.passes() >= 1), "no pass of the flight band in six million cycles")
    reached("the first control pass")
    clock_idles_high(board)
    reached("the SPI clock idles high, as the flow sensor wants it")
    light_has_supply(board)
    reached("the supply of the status light is on")
    expect(flying.run(20 * PASSES, lambda: flying.passes() >= PASSES), f"{flying.passes()} control passes, not {PASSES}")
    offers = flying.interrupts.offered.get(CUT_OFF, 0)
    expect(offers > PASSES, f"the cut-off's timer has asked {offers} times only")
    reached(f"{flying.passes()} control passes, motors still; the cut-off's timer has asked {offers} times")
    status, body = flying.pulses.written
    expect(not status and not body, "lights that never end are seen")
    flying.pulses.works = True
    expect(flying.run(20 * PASSES, lambda: RED in status and WHITE in body), f"the lights show {status} and {body}")
    reached("the status light is red and the body's are white, now that pulses end")
    say(f"sensors (samples, errors, kind of the last): {flying.sensors()}")
    said = board.sim.uart_transcript()
    expect("panicked" not in said, said)
    say(f"the firmware has said on USB: {said!r}")


def main(firmware_file: str, rom_file: str, record_file: str):
    program, rom = Program(Path(firmware_file).read_bytes()), Program(Path(rom_file).read_bytes())
    instructions, functions = program.adapt()
    say(f"{instructions} instructions and {functions} functions of the radio exchanged")
    try:
        controls(program, rom, Path(record_file).read_bytes())
        firmware(program, rom)
    except (Missed, RuntimeError) as stop:
        say(f"stopped: {stop}")
        sys.exit(1)


if __name__ == "__main__":
    main(*sys.argv[1:])
