"""A Cortex-M4F with the memories of an STM32F303CC, from Unicorn, and the interrupt controller that Unicorn does not have.

Time is counted in cycles of 64 MHz, one an instruction. A processor that waits for an event is moved on to the next one. What an interrupt saves is kept beside the memory,
so the depth of stacks is about right and their contents are not.
"""

import heapq
import struct

from unicorn import UC_ARCH_ARM, UC_HOOK_BLOCK, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn.arm_const import (
    UC_ARM_REG_LR,
    UC_ARM_REG_PC,
    UC_ARM_REG_PRIMASK,
    UC_ARM_REG_SP,
    UC_ARM_REG_XPSR,
    UC_CPU_ARM_CORTEX_M4,
)

HZ = 64_000_000
FLASH, FLASH_SIZE = 0x0800_0000, 256 * 1024
MEMORY, MEMORY_SIZE = 0x2000_0000, 40 * 1024
# Where an interrupt returns to: nothing of the chip is there.
RETURN = 0x1FFF_F000
YIELD, WFE, SEV = 0xBF10, 0xBF20, 0xBF40
# Where the state of an IT block is in the program status.
IT = 0x0600_FC00
# Registers and a floating point context with its reserve.
FRAME = 104


class Fault(Exception):
    pass


class Machine:
    def __init__(self, segments):
        self.cycles = 0
        self.uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M4)
        self.uc.mem_map(FLASH, FLASH_SIZE)
        self.uc.mem_map(MEMORY, MEMORY_SIZE)
        self.uc.mem_map(RETURN, 0x1000)
        self.uc.mem_write(FLASH, b"\xff" * FLASH_SIZE)
        for place, data in segments:
            self.uc.mem_write(place, data)
        self.uc.hook_add(UC_HOOK_BLOCK, self._block)
        self.blocks = {}
        self.events, self.order = [], 0
        self.enabled, self.pending, self.priority = set(), set(), {}
        self.active = []
        # Set by an event, cleared by whoever waits for one.
        self.latch = False
        # Lines that stay pending as long as they hold, and what is lost on the way.
        self.levels, self.lost = [], set()
        # Instructions between entry and exit of each interrupt that did not interrupt another: number, instructions.
        self.on_exit = lambda number, cycles: None
        self.uc.mmio_map(0xE000_E000, 0x1000, self._core_read, None, self._core_write, None)

    def word(self, place):
        return struct.unpack("<I", self.uc.mem_read(place, 4))[0]

    # Time.

    def after(self, cycles, what):
        self.order += 1
        heapq.heappush(self.events, (self.cycles + max(1, cycles), self.order, what))

    def seconds(self):
        return self.cycles / HZ

    def happen(self):
        while self.events and self.events[0][0] <= self.cycles:
            heapq.heappop(self.events)[2]()

    # Interrupts.

    def pend(self, number):
        if number not in self.lost:
            self.pending.add(number)

    def _urgent(self):
        """The interrupt that is to be taken now, if there is one."""
        for number, holds in self.levels:
            if holds():
                self.pend(number)
        waiting = self.pending & self.enabled
        if not waiting:
            return None
        number = min(waiting, key=lambda number: (self.priority.get(number, 0), number))
        running = min((self.priority.get(active, 0) for active, _, _ in self.active), default=256)
        if self.priority.get(number, 0) >= running or self.uc.reg_read(UC_ARM_REG_PRIMASK):
            return None
        return number

    def _enter(self, number):
        self.pending.discard(number)
        self.active.append((number, self.uc.context_save(), self.cycles))
        self.uc.reg_write(UC_ARM_REG_SP, (self.uc.reg_read(UC_ARM_REG_SP) - FRAME) & ~7)
        self.uc.reg_write(UC_ARM_REG_LR, RETURN | 1)
        self.uc.reg_write(UC_ARM_REG_PC, self.word(FLASH + 4 * (16 + number)))
        self.latch = True

    def _leave(self):
        number, context, since = self.active.pop()
        self.uc.context_restore(context)
        self.latch = True
        self.on_exit(number, self.cycles - since)

    def _core_read(self, _, offset, size, __):
        if 0x100 <= offset < 0x280:
            held = self.enabled if offset < 0x200 else self.pending
            first = 8 * (offset & 0x1F)
            return sum(1 << bit for bit in range(32) if first + bit in held)
        return 0

    def _core_write(self, _, offset, size, value, __):
        if 0x100 <= offset < 0x300:
            numbers = {8 * (offset & 0x1F) + bit for bit in range(32) if value >> bit & 1}
            if offset < 0x180:
                self.enabled |= numbers
            elif offset < 0x200:
                self.enabled -= numbers
            elif offset < 0x280:
                for number in numbers:
                    self.pend(number)
            else:
                self.pending -= numbers
        elif offset == 0xF00:
            self.pend(value)
        elif 0x400 <= offset < 0x500:
            for byte in range(size):
                self.priority[offset - 0x400 + byte] = value >> 8 * byte & 0xFF

    # Instructions.

    def _look(self, place, size):
        """Instructions of a block, and whether it is one that sends an event."""
        code, at, count, sends = bytes(self.uc.mem_read(place, size)), 0, 0, False
        while at < size:
            half = struct.unpack_from("<H", code, at)[0]
            sends |= half == SEV
            at += 4 if half >> 11 in (0b11101, 0b11110, 0b11111) else 2
            count += 1
        return count, sends

    def _block(self, uc, place, size, _):
        key = place, size
        if key not in self.blocks:
            self.blocks[key] = self._look(place, size)
        is_due = self.events and self.events[0][0] <= self.cycles or self.pending and self._urgent() is not None
        # A block may begin between an IT and its instructions. The core takes that state along and begins a handler without it; Unicorn would skip the
        # handler's first instructions.
        if is_due and not uc.reg_read(UC_ARM_REG_XPSR) & IT:
            # Before the block, which comes again.
            uc.emu_stop()
            return
        count, sends = self.blocks[key]
        self.cycles += count
        self.latch |= sends

    def run(self, until, is_over=lambda: False):
        """Until this many seconds have passed, or what is waited for is true."""
        while self.seconds() < until and not is_over():
            self.happen()
            number = self._urgent()
            if number is not None:
                self._enter(number)
            place = self.uc.reg_read(UC_ARM_REG_PC)
            try:
                self.uc.emu_start(place | 1, RETURN)
            except UcError as error:
                place = self.uc.reg_read(UC_ARM_REG_PC)
                half = struct.unpack("<H", self.uc.mem_read(place - 2, 2))[0] if place > FLASH else 0
                # Unicorn stops behind these two.
                if half == YIELD:
                    continue
                if half != WFE:
                    raise Fault(f"at {place:#010x}: {error}") from error
                if not self.latch and self._urgent() is None and self.events:
                    self.cycles = max(self.cycles, self.events[0][0])
                self.latch = False
                continue
            if self.uc.reg_read(UC_ARM_REG_PC) == RETURN:
                self._leave()
