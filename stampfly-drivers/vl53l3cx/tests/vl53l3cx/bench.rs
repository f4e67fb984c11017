//! Two chips on one bus, each with a reset pin: registers, measurements in virtual time, faults.

use embedded_hal::digital::{ErrorType as PinErrorType, OutputPin};
use embedded_hal_async::i2c::{self, I2c, Operation};
use stampfly_driver_core::Timebase;
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::chip::TransferLimit;
use stampfly_driver_fakes::closure::{Clock, Fault, finish};
use stampfly_types::Duration;
use stampfly_vl53l3cx::{BootAddress, Config, NoXshut, Vl53l3cx};
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

/// Time from the release of the reset until the chip answers, µs.
pub const BOOT: u64 = 1_200;

pub struct Chip {
    pub clock: Clock,
    pub registers: Vec<u8>,
    /// Time since which it is out of reset.
    pub up: Option<u64>,
    pub address: u8,
    /// Number of resets.
    pub resets: u32,
    /// Start of ranging, and the period.
    pub ranging: Option<(u64, u64)>,
    /// Number of measurements whose interrupt has been cleared.
    pub cleared: u64,
    /// Measurements that have been read.
    pub read: Vec<u64>,
    pub identification: [u8; 2],
    /// The factory's correction, mm.
    pub factory: i16,
    /// Status code, and distance in mm.
    pub target: (u8, i16),
    pub blind: bool,
    pub boots: bool,
    /// Number of reads of the interrupt status.
    pub looks: u32,
    /// A bit that is flipped in writes to the registers of the ranging parts.
    pub flip: u8,
    /// The next clear of the interrupt is acknowledged but has no effect.
    pub deaf: bool,
    /// The measurement that the chip holds until the interrupt is cleared; it makes no other
    /// meanwhile.
    pub held: Option<u64>,
    /// Held in reset by its register: it still acknowledges but returns no data.
    pub held_by_register: bool,
    /// The clock stands still once the register holds the chip.
    pub stops_clock: bool,
    /// Whether the chip keeps its address while the register holds it and afterwards, or returns to
    /// the boot address.
    pub keeps_address: bool,
    /// Faults of the next accesses to a register.
    pub faults: Vec<(u16, Fault)>,
}

impl Chip {
    pub fn new(clock: &Clock) -> Self {
        Self {
            clock: clock.clone(),
            registers: vec![0; 0x120],
            up: Some(0),
            address: 0x29,
            resets: 0,
            ranging: None,
            cleared: 0,
            read: Vec::new(),
            identification: [0xEA, 0xAA],
            factory: 0,
            target: (9, 1_234),
            blind: false,
            boots: true,
            looks: 0,
            flip: 0,
            deaf: false,
            held: None,
            held_by_register: false,
            stops_clock: false,
            keeps_address: false,
            faults: Vec::new(),
        }
    }

    /// Effect of the reset register.
    fn reset_by_register(&mut self, let_go: bool) {
        let address = self.address;
        if let_go && !self.held_by_register {
            return;
        }
        self.restart();
        self.resets += u32::from(!let_go);
        self.held_by_register = !let_go;
        if self.keeps_address {
            self.address = address;
        }
        if !let_go {
            self.up = Some(0);
            if core::mem::take(&mut self.stops_clock) {
                self.clock.stop(true);
            }
        }
    }

    /// Effect of a loss of power: all settings are lost, and the chip is back at the boot address.
    pub fn restart(&mut self) {
        self.registers.fill(0);
        self.registers[0x30] = 0x11;
        (self.address, self.ranging) = (0x29, None);
        self.up = self.up.map(|_| self.clock.now().as_micros());
    }

    /// Number of finished measurements, and the time of the newest one.
    pub fn measured(&self) -> (u64, u64) {
        if let Some(held) = self.held {
            return (held, 0);
        }
        let Some((begun, period)) = self.ranging.filter(|_| !self.blind) else { return (self.cleared, 0) };
        // A budget of 33 ms for the first measurement, then one per period.
        let Some(since) = (self.clock.now().as_micros()).checked_sub(begun + 33_000) else { return (0, 0) };
        (1 + since / period, begun + 33_000 + since / period * period)
    }

    pub fn answers(&self, address: u8) -> bool {
        self.up.is_some_and(|up| self.clock.now().as_micros() >= up + BOOT) && self.address == address
    }

    pub fn write(&mut self, register: u16, data: &[u8]) {
        if register == 0x0000 {
            return self.reset_by_register(data == [1]);
        }
        for (offset, value) in data.iter().enumerate() {
            self.registers[usize::from(register) + offset] = *value;
        }
        if register == 0x5E {
            self.registers[0x60] ^= core::mem::take(&mut self.flip);
        }
        match (register, data) {
            (0x0001, [address]) => self.address = *address,
            (0x0086, [1]) if core::mem::take(&mut self.deaf) => {}
            (0x0086, [1]) => {
                self.held = None;
                self.cleared = self.measured().0;
            }
            (0x0087, [0x40]) => {
                let ticks = u32::from_be_bytes(self.registers[0x6C..0x70].try_into().expect("four bytes"));
                assert_eq!(self.registers[0x30], 0x01, "configured");
                self.cleared = 0;
                self.ranging = Some((self.clock.now().as_micros(), u64::from(ticks) * 40_000 / 43 / 1_000));
            }
            (0x0087, [0x00]) => self.ranging = None,
            _ => {}
        }
    }

    pub fn read(&mut self, register: u16, into: &mut [u8]) {
        let (measured, _) = self.measured();
        self.registers[0x31] = u8::from(measured > self.cleared);
        self.registers[0xE5] = u8::from(self.boots);
        self.registers[0xDE..0xE0].copy_from_slice(&1_000u16.to_be_bytes());
        self.registers[0x22..0x24].copy_from_slice(&self.factory.to_be_bytes());
        self.registers[0x10F..0x111].copy_from_slice(&self.identification);
        self.looks += u32::from(register == 0x30);
        if register == 0x89 {
            self.read.push(measured);
            assert_eq!(into.len(), 17, "a short read");
            self.registers[0x89] = self.target.0;
            self.registers[0x8B] = measured as u8;
            self.registers[0x92..0x94].copy_from_slice(&10u16.to_be_bytes());
            self.registers[0x96..0x98].copy_from_slice(&self.target.1.to_be_bytes());
        }
        into.copy_from_slice(&self.registers[usize::from(register)..][..into.len()]);
        if self.held_by_register {
            into.fill(0);
        }
    }
}

pub type Shared = Rc<RefCell<Chip>>;

#[derive(Clone)]
pub struct Bus(pub Clock, pub [Shared; 2]);

impl i2c::ErrorType for Bus {
    type Error = Fault;
}

impl I2c for Bus {
    async fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), Fault> {
        let mut outcome = Err(Fault::Nack);
        let answering: Vec<&Shared> = self.1.iter().filter(|chip| chip.borrow().answers(address)).collect();
        assert!(answering.len() < 2, "two chips answer at {address:#04x}");
        for chip in answering {
            let mut chip = chip.borrow_mut();
            let [Operation::Write([high, low, written @ ..]), read @ ..] = operations else {
                panic!("not a register access")
            };
            let register = u16::from_be_bytes([*high, *low]);
            outcome = match chip.faults.iter().position(|fault| fault.0 == register) {
                Some(position) => Err(chip.faults.remove(position).1),
                None => Ok(()),
            };
            match read {
                _ if outcome.is_err() => {}
                [Operation::Read(into)] => chip.read(register, into),
                [] => chip.write(register, written),
                other => panic!("not a register access: {other:?}"),
            }
        }
        finish(&self.0, outcome).await
    }
}

pub struct Xshut(pub Shared);

impl PinErrorType for Xshut {
    type Error = Infallible;
}

impl OutputPin for Xshut {
    fn set_low(&mut self) -> Result<(), Infallible> {
        let mut chip = self.0.borrow_mut();
        chip.restart();
        chip.resets += u32::from(chip.up.take().is_some());
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        let mut chip = self.0.borrow_mut();
        chip.up = Some(chip.clock.now().as_micros());
        Ok(())
    }
}

pub type Driver<'b> = Vl53l3cx<'b, Bus, Xshut, Clock>;

pub struct Bench {
    pub clock: Clock,
    pub chips: [Shared; 2],
    pub boot: BootAddress,
}

impl Bench {
    pub fn new() -> Self {
        let clock = Clock::default();
        let chips = [(); 2].map(|()| Rc::new(RefCell::new(Chip::new(&clock))));
        Self { clock, chips, boot: BootAddress::new() }
    }

    pub fn drivers_with(&self, config: Config) -> [Driver<'_>; 2] {
        [0, 1].map(|index| {
            let bus = Bus(self.clock.clone(), self.chips.clone());
            let pin = Xshut(self.chips[index].clone());
            Vl53l3cx::new(bus, pin, &self.boot, 0x30 + index as u8, self.clock.clone(), config)
                .with_transfer_limit(TransferLimit::I2C_SENSORS)
        })
    }

    /// A driver of the first chip, without a pin.
    pub fn without_pin(&self, address: u8) -> Vl53l3cx<'_, Bus, NoXshut, Clock> {
        let bus = Bus(self.clock.clone(), self.chips.clone());
        Vl53l3cx::new(bus, NoXshut, &self.boot, address, self.clock.clone(), Config::default())
    }

    pub fn drivers(&self) -> [Driver<'_>; 2] {
        self.drivers_with(Config::default())
    }

    pub fn timed<T>(&self, call: impl Future<Output = T>) -> (T, Duration) {
        let begun = self.clock.now();
        (block_on(call), self.clock.now().since(begun))
    }
}
