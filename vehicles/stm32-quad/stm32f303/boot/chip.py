"""What of an STM32F303CC the firmware touches, and what is wired to it. Registers that only keep what they are told are no code here.

Sources: RM0316 for the chip, RM-MPU-6000A-00 for the inertial sensor, the nRF24L01's product specification for the radio.
"""

from machine import HZ, Machine

RCC, FLASH_REGISTERS, IWDG, PERIPHERALS, PORTS, ADC = 0x4002_1000, 0x4002_2000, 0x4000_3000, 0x4000_0000, 0x4800_0000, 0x5000_0000
DEBUG = 0xE004_2000
TIM4, TIM15, USART1, DMA, SPI1, SPI2 = 0x4000_0800, 0x4001_4000, 0x4001_3800, 0x4002_0000, 0x4001_3000, 0x4000_3800
# Interrupts, by RM0316 table 82.
IRQ_DMA_CHANNEL_1, IRQ_ADC, IRQ_TIM15, IRQ_USART1, IRQ_SPI3 = 11, 18, 24, 37, 51
MICROSECOND = HZ // 1_000_000


class Inertial:
    """An MPU-6000 that stands level and hums."""

    def __init__(self, identity=0x68):
        self.registers = bytearray(128)
        self.registers[0x75] = identity
        self.samples, self.place, self.random = 0, None, 1

    def select(self):
        self.place = None

    def exchange(self, byte):
        if self.place is None:
            self.place, self.reads = byte & 0x7F, byte & 0x80
            if self.reads and self.place == 0x3B:
                self.measure()
            return 0
        place, self.place = self.place, self.place + 1 & 0x7F
        if not self.reads:
            self.registers[place] = 0 if place in (0x6B, 0x68) and byte & 0x87 != byte & 0x07 else byte
        return self.registers[place]

    def measure(self):
        self.samples += 1
        counts = []
        for level in (0, 0, 2048, 0, 0, 0, 0):
            self.random = self.random * 1_664_525 + 1_013_904_223 & 0xFFFF_FFFF
            counts.append(level + (self.random >> 28))
        self.registers[0x3B:0x49] = b"".join(count.to_bytes(2, "big", signed=True) for count in counts)


class Radio:
    """An nRF24L01, which hears a transmitter when it listens where that sends."""

    def __init__(self):
        self.registers = {0: 0x08, 7: 0x0E, 0x17: 0x11}
        self.long, self.command, self.enabled, self.packet, self.taken = {}, None, False, None, 0

    def select(self):
        self.command = None

    def hear(self, address, channel, packet):
        listens = self.enabled and self.registers[0] & 3 == 3 and self.registers.get(5) == channel
        if listens and all(self.long.get((0x0A, at)) == byte for at, byte in enumerate(address)):
            # The first pipe.
            self.packet, self.registers[7], self.registers[0x17] = packet, 0x40, 0x10
            self.taken += 1

    def exchange(self, byte):
        if self.command is None:
            self.command, self.at = byte, 0
            return self.registers[7]
        place, at, self.at = self.command & 0x1F, self.at, self.at + 1
        if self.command == 0x61 and self.packet:
            byte, self.packet = self.packet[0], self.packet[1:]
            if not self.packet:
                self.registers[7], self.registers[0x17] = self.registers[7] & 0x40 | 0x0E, 0x11
            return byte
        if self.command < 0x20:
            return self.long.get((place, at), self.registers.get(place, 0) if at == 0 else 0)
        if self.command < 0x40:
            if place in (0x0A, 0x0B, 0x10):
                self.long[place, at] = byte
            elif place == 7:
                self.registers[7] &= ~(byte & 0x70)
            else:
                self.registers[place] = byte
        return 0


class Chip:
    def __init__(self, segments, identity=0x68, lost=(), held=False):
        self.machine = machine = Machine(segments)
        machine.lost = set(lost)
        self.kept = {RCC: 0x83}
        self.inertial, self.radio = Inertial(identity), Radio()
        # Registers, channels of the DMA for sending and receiving, the chip, and its select: port and pin.
        self.spis = {SPI1: (3, 2, self.radio, (0, 4)), SPI2: (5, 4, self.inertial, (1, 12))}
        self.flags, self.transfers = 0, set()
        self.timer_zero, self.timer_flags, self.timer_runs, self.turns = 0, 0, False, {}
        self.said, self.heard = bytearray(), bytearray()
        self.conversions, self.converted = 0, False
        self.lights = [0, 0]
        # When the watchdog was started, last fed, and by when the program has to have fed it.
        self.guarded, self.fed, self.bitten = False, [], None
        # The serial line's out pin, PA9, is held low.
        self.held = held
        for base, size in ((PERIPHERALS, 0x3_0000), (PORTS, 0x2000), (ADC, 0x1000), (DEBUG, 0x1000)):
            machine.uc.mmio_map(base, size, self._read, base, self._write, base)
        machine.levels.append((IRQ_USART1, self._line_calls))

    def transmit(self, address, hops, sticks):
        """Sends what `sticks` returns, every 9 ms on the next channel."""

        def send(hop=0):
            self.radio.hear(address, hops[hop % len(hops)], sticks())
            self.machine.after(9_000 * MICROSECOND, lambda: send(hop + 1))

        send()

    def reset(self):
        from unicorn.arm_const import UC_ARM_REG_PC, UC_ARM_REG_SP

        self.machine.uc.reg_write(UC_ARM_REG_SP, self.machine.word(0x0800_0000))
        self.machine.uc.reg_write(UC_ARM_REG_PC, self.machine.word(0x0800_0004) & ~1)

    def register(self, place):
        return self.kept.get(place, 0)

    # Registers.

    def _read(self, _, offset, size, base):
        place = base + offset
        return self._value(place & ~3) >> 8 * (place & 3) & (1 << 8 * size) - 1

    def _value(self, place):
        kept = self.register(place)
        if place == RCC:
            # What is switched on is ready.
            return kept | kept << 1 & 0x0202_0002
        if place == RCC + 0x04:
            return kept & ~0xC | kept << 2 & 0xC
        if place in (RCC + 0x20, RCC + 0x24):
            return kept | kept << 1 & 2
        if PORTS <= place < PORTS + 0x2000 and place & 0x3FF == 0x10:
            # Every other pin is pulled up, and nothing pulls down.
            return 0xFDFF if self.held and place < PORTS + 0x400 else 0xFFFF
        if place == TIM15 + 0x24:
            return self._ticks() & 0xFFFF
        if place == TIM15 + 0x10:
            return self.timer_flags
        if place == DMA:
            return self.flags
        if place == USART1 + 0x1C:
            return 0x0060_00C0 | (0x20 if self.heard else 0)
        if place == USART1 + 0x24:
            return self.heard.pop(0) if self.heard else 0
        if place in (SPI1 + 0x08, SPI2 + 0x08):
            return 0x02
        if place == ADC:
            return 0x01 | (4 if self.converted else 0)
        if place == ADC + 0x08:
            return kept & 0x7FFF_FFFB
        if place == ADC + 0x40:
            self.converted = False
            return 1900
        if place in (FLASH_REGISTERS + 0x0C, IWDG + 0x0C):
            return 0
        return kept

    def _write(self, _, offset, size, value, base):
        place = base + offset
        low, mask = 8 * (place & 3), (1 << 8 * size) - 1
        place &= ~3
        if size < 4 and place not in (USART1 + 0x28, SPI1 + 0x0C, SPI2 + 0x0C):
            value = self.register(place) & ~(mask << low) | (value & mask) << low
        before, self.kept[place] = self.register(place), value
        if PORTS <= place < PORTS + 0x2000:
            self._pins(place, value)
        elif place == IWDG:
            self._watchdog(value)
        elif TIM15 <= place < TIM15 + 0x400:
            self._timer(place - TIM15, value, before)
        elif DMA <= place < DMA + 0x100:
            if place == DMA + 4:
                self.flags &= ~value
            self._serial_peripherals()
        elif place & ~0xFF in (SPI1 & ~0xFF, SPI2 & ~0xFF) and place & 0x3FF in (0, 4):
            self._serial_peripherals()
        elif place == USART1 + 0x28:
            self.said.append(value & 0xFF)
        elif place == ADC + 0x08 and value & 4:
            self.machine.after(700, self._convert)

    def _pins(self, place, value):
        port, register = (place - PORTS) >> 10, place & 0x3FF
        if register not in (0x18, 0x28):
            return
        low = value >> 16 if register == 0x18 else value
        for _, _, chip, (of, pin) in self.spis.values():
            if of == port and low >> pin & 1:
                chip.select()
        if port == 0 and value & 1 << 3:
            self.radio.enabled = register == 0x18
        elif port == 0 and register == 0x18 and low & 1 << 3:
            self.radio.enabled = False
        if port == 1:
            for light, pin in enumerate((3, 4)):
                self.lights[light] += value >> pin & 1 if register == 0x18 else 0

    def _watchdog(self, key):
        if key == 0xCCCC:
            self.guarded = True
        if key in (0xAAAA, 0xCCCC) and self.guarded:
            self.fed.append(self.machine.seconds())
            at = len(self.fed)
            periods = 4 << self.register(IWDG + 0x04)
            # 40 kHz.
            timeout = (self.register(IWDG + 0x08) + 1) * periods * HZ // 40_000

            def bite():
                if len(self.fed) == at and self.bitten is None:
                    self.bitten = self.machine.seconds()

            self.machine.after(timeout, bite)

    # The timer that the program's clock is: a tick a microsecond.

    def _ticks(self):
        return (self.machine.cycles - self.timer_zero) // MICROSECOND if self.timer_runs else 0

    def _timer(self, register, value, before):
        if register == 0x10:
            self.kept[TIM15 + 0x10] = 0
            self.timer_flags &= value
        if register == 0x00 and value & 1 and not self.timer_runs:
            assert self.register(TIM15 + 0x28) == 63, "the clock's prescaler is not for 64 MHz"
            self.timer_zero, self.timer_runs = self.machine.cycles, True
        # What is due by now was before this.
        self.machine.happen()
        for flag, of in ((1, 0x00), (2, 0x34), (4, 0x38)):
            if register in (0x00, of):
                self.turns[flag] = self.turns.get(flag, 0) + 1
                self._next_match(flag, 0x1_0000 if flag == 1 else self.register(TIM15 + of), self.turns[flag])
        if register == 0x0C:
            self._timer_calls()

    def _next_match(self, flag, at, turn):
        if not self.timer_runs:
            return
        ticks = (at - self._ticks() - 1) % 0x1_0000 + 1
        into = (self.machine.cycles - self.timer_zero) % MICROSECOND

        def match():
            if turn == self.turns[flag]:
                self.timer_flags |= flag
                self._timer_calls()
                self._next_match(flag, at, turn)

        self.machine.after(ticks * MICROSECOND - into, match)

    def _timer_calls(self):
        if self.timer_flags & self.register(TIM15 + 0x0C) & 0b111:
            self.machine.pend(IRQ_TIM15)

    # Serial peripherals with their DMA.

    def _channel(self, number):
        base = DMA + 8 + 20 * (number - 1)
        return [self.register(base + 4 * field) for field in (0, 1, 3)]

    def _serial_peripherals(self):
        for spi, (out, into, chip, _) in self.spis.items():
            if not self.register(spi) & 0x40 or not self.register(spi + 4) & 2 or spi in self.transfers:
                continue
            settings, count, place = self._channel(out)
            if not settings & 1 or not count:
                continue
            receives = self.register(spi + 4) & 1 and self._channel(into)[0] & 1
            sent = self.machine.uc.mem_read(place, count if settings & 0x80 else 1)
            answer = bytes(chip.exchange(sent[at if settings & 0x80 else 0]) for at in range(count))
            self.transfers.add(spi)
            divider = 2 << (self.register(spi) >> 3 & 7)
            bus = HZ if spi == SPI1 else HZ // 2
            self.machine.after(count * 8 * divider * HZ // bus, lambda spi=spi, answer=answer, receives=receives: self._done(spi, answer, receives))

    def _done(self, spi, answer, receives):
        out, into, _, _ = self.spis[spi]
        self.transfers.discard(spi)
        if receives:
            self.machine.uc.mem_write(self._channel(into)[2], answer)
        for channel in (into, out) if receives else (out,):
            base = DMA + 8 + 20 * (channel - 1)
            self.kept[base + 4] = 0
            self.flags |= 3 << 4 * (channel - 1)
            if self.kept[base] & 2:
                self.machine.pend(IRQ_DMA_CHANNEL_1 + channel - 1)

    # Converter and serial line.

    def _convert(self):
        self.converted = True
        self.conversions += 1
        if self.register(ADC + 0x04) & 4:
            self.machine.pend(IRQ_ADC)

    def _line_calls(self):
        control = self.register(USART1)
        return bool(self.heard and control & 0x20 or control & 0xC0)
