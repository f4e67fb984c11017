//! Side effects of reading and writing the BMI270's registers.

use super::{
    ACCEL, ACCEL_SETTINGS, AFTER_RESET, Bmi270, COMMAND, COMMAND_READY, EVENT, FEATURE_PAGE, FIFO_CONTENT, FIFO_DATA,
    FIFO_LENGTH, FIFO_MODE, GYRO, GYRO_RANGE, GYRO_SELF_TEST, GYRO_SETTINGS, GYRO_TEST, ID, INTERNAL_STATUS,
    INTERRUPTS, NOT_PREPARED, POWER, READY_ACCEL, READY_GYRO, START_UP, STATUS, SelfTest, TEST_STATUS, TEST_WORD_HIGH,
    TEST_WORD_LOW, TIME, UPLOAD_ADDRESS_HIGH, UPLOAD_ADDRESS_LOW, UPLOAD_CHECK, UPLOAD_CONTROL, UPLOAD_DATA,
    UPLOAD_SIZE,
};
use crate::chips::{Chip, Flaw};
use stampfly_types::Instant;

impl Chip for Bmi270 {
    fn read(&mut self, register: u16, now: Instant) -> u16 {
        self.update(now);
        if now < self.ready {
            return 0;
        }
        let value = self.register(register);
        u16::from(match register {
            ID => self.id,
            STATUS => value | COMMAND_READY,
            ACCEL..TIME => {
                let (first, flag) = if register < GYRO { (ACCEL, READY_ACCEL) } else { (GYRO, READY_GYRO) };
                let place = usize::from(first - ACCEL);
                // Data that arrived during this transfer are still unread.
                if self.shadow[place..place + 6] == self.registers[usize::from(first)..usize::from(first) + 6] {
                    self.set(STATUS, self.register(STATUS) & !flag);
                }
                self.shadow[usize::from(register - ACCEL)]
            }
            TIME..EVENT => self.time(now)[usize::from(register - TIME)],
            EVENT => {
                self.set(EVENT, value & !1);
                value
            }
            INTERRUPTS => {
                self.interrupt.unlatch();
                core::mem::take(&mut self.registers[usize::from(INTERRUPTS)])
            }
            TEST_STATUS if self.register(FEATURE_PAGE) == 0 => self.test_status,
            TEST_WORD_LOW | TEST_WORD_HIGH if self.register(FEATURE_PAGE) == 1 => {
                self.test_word[usize::from(register - TEST_WORD_LOW)]
            }
            FIFO_LENGTH => self.fifo.len() as u8,
            0x25 => (self.fifo.len() >> 8) as u8 & 0x3F,
            FIFO_DATA if self.saves_power() => 0,
            FIFO_DATA => {
                let timed = self.register(FIFO_MODE) & 2 != 0 && self.register(FIFO_CONTENT) & 0x10 != 0;
                self.fifo.pop(timed.then(|| self.time(now)))
            }
            UPLOAD_DATA | COMMAND => 0,
            _ => value,
        })
    }

    fn write(&mut self, register: u16, value: u16, now: Instant) {
        self.update(now);
        let value = value as u8;
        if now < self.ready || register >= 0x80 {
            return;
        }
        match register {
            // Read-only.
            0x00..=0x2E => {}
            UPLOAD_CONTROL if self.saves_power() => {}
            UPLOAD_CONTROL => {
                self.set(UPLOAD_CONTROL, value);
                self.prepared = value & 1 == 0;
                if self.prepared {
                    self.memory.clear();
                    self.set(INTERNAL_STATUS, 0);
                    self.switch(now);
                } else {
                    self.check = Some(now + UPLOAD_CHECK);
                }
            }
            UPLOAD_ADDRESS_LOW | UPLOAD_ADDRESS_HIGH => {
                self.set(register, value);
                let words = usize::from(self.register(UPLOAD_ADDRESS_HIGH)) << 4
                    | usize::from(self.register(UPLOAD_ADDRESS_LOW) & 0x0F);
                self.address = 2 * words;
            }
            UPLOAD_DATA if self.saves_power() || !self.prepared => {}
            UPLOAD_DATA => {
                if self.address < UPLOAD_SIZE {
                    self.memory.resize(self.memory.len().max(self.address + 1), 0);
                    self.memory[self.address] = value;
                    self.address += 1;
                }
            }
            COMMAND if value == 0xB6 => self.reset(now),
            COMMAND if value == 0xB0 => self.fifo.clear(),
            COMMAND if value == 0x02 && !self.saves_power() && self.register(INTERNAL_STATUS) & 0x0F == 1 => {
                let selected = self.test_word[1] & 0x03 == 0;
                let announced = self.register(GYRO_TEST) & 0x04 != 0;
                let prepared = self.register(POWER) & 0x06 == 0x04 && self.test_word[0] == 0;
                self.set(GYRO_SELF_TEST, 0);
                if announced && selected && prepared {
                    self.self_test.begin_gyro(now);
                    self.test_status = 0;
                } else {
                    // A test without preparation ends immediately.
                    self.test_status = NOT_PREPARED;
                    self.set(GYRO_TEST, self.register(GYRO_TEST) & !0x04);
                }
            }
            TEST_WORD_LOW | TEST_WORD_HIGH if self.register(FEATURE_PAGE) == 1 => {
                self.test_word[usize::from(register - TEST_WORD_LOW)] = value;
            }
            // Results on feature page 0 are read-only.
            0x30..=0x3F if self.register(FEATURE_PAGE) == 0 => {}
            COMMAND | GYRO_SELF_TEST => {}
            POWER => {
                self.set(POWER, value & 0x0F);
                self.switch(now);
            }
            ACCEL_SETTINGS..=GYRO_RANGE => {
                let sensor = usize::from(register >= GYRO_SETTINGS);
                if self.register(register) != value && self.register(FIFO_CONTENT) & (0x40 << sensor) != 0 {
                    self.fifo.push_configuration(1 << sensor);
                }
                self.set(register, value);
                self.sums[sensor] = Default::default();
                self.check_settings();
            }
            _ => self.set(register, value),
        }
    }

    fn reset(&mut self, now: Instant) {
        self.registers = [0; 128];
        for (register, value) in AFTER_RESET {
            self.set(register, value);
        }
        self.ready = now + START_UP;
        self.epoch = now;
        self.spi = false;
        self.idle_until = now;
        self.prepared = false;
        self.check = None;
        self.address = 0;
        self.memory.clear();
        self.on = [None; 2];
        self.sums = Default::default();
        self.fifo.clear();
        self.shadow = [0; 12];
        self.self_test = SelfTest::default();
        self.test_word = [0; 2];
        self.test_status = 0;
        self.interrupt.stop();
        self.drive_pin();
    }

    fn set_broken(&mut self, broken: bool) {
        self.broken = broken;
    }

    fn set_flaw(&mut self, flaw: Option<Flaw>) {
        self.flaw = flaw;
    }

    fn set_id(&mut self, id: u16) {
        self.id = id as u8;
    }
}
