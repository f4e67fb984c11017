//! Faults between chip and processor, and flaws of a chip, changeable at run time.

use crate::chips::Chip;
use crate::noise::Noise;
use crate::time::Clock;
use core::cell::{Cell, RefCell};
use stampfly_types::Duration;
use std::rc::Rc;

/// Bus faults of one chip. None by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// The chip does not answer: no acknowledge on I²C, all ones on SPI.
    pub dead: bool,
    /// Share of transfers that fail, 0 to 1: no acknowledge on I²C, controller overrun on SPI.
    pub refusals: f64,
    /// Probability of a wrong data bit when reading or writing, 0 to 1.
    pub bit_errors: f64,
    /// Time for which the chip holds the clock line low in every transfer. I²C only.
    pub stretch: Duration,
}

/// A defect in mounting or manufacture, or an obstacle in front of the sensor: the chip answers and
/// measures, but not what its driver expects. Each emulator implements the flaws of its part and
/// ignores the others.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Flaw {
    /// Other mounting or another variant of the part: the direction of each reported axis, as rows
    /// of the body's axes; the identity is the board's layout. BMI270, BMM150, MPU-6000, PMW3901.
    Mounting([[i8; 3]; 3]),
    /// Conversions repeat the last value. BMP280, BMM150, MPU-6000.
    Stuck,
    /// Ignores this number of wake-up requests after a reset. MPU-6000.
    Sleepy(u32),
    /// Measures too long by this, m: a cover glass, a recessed sensor. VL53L3CX.
    Offset(f64),
    /// An object at this distance covers it, m. VL53L3CX.
    Covered(f64),
    /// Its own distances are invalid, its histograms are valid. VL53L3CX.
    LightMode(Nonsense),
    /// Factor on the measured voltage, as with another divider. INA3221.
    Voltage(f64),
    /// Factor on the measured current, as with another shunt. INA3221.
    Current(f64),
}

/// Failure of a range finder whose ranging mode does not work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Nonsense {
    /// No interrupt comes.
    Silent,
    /// Every measurement fails: the detector has no bias voltage.
    Failing,
    /// The same distance every time.
    Frozen,
    /// Signal is received, but every distance has too large a standard deviation.
    Unseen,
    /// No signal is received.
    Blind,
}

impl Flaw {
    /// A vector of the body in the axes of a chip with this flaw.
    pub(super) fn turn(flaw: Option<Self>, body: [f64; 3]) -> [f64; 3] {
        let Some(Self::Mounting(rows)) = flaw else { return body };
        rows.map(|row| row.iter().zip(body).map(|(factor, part)| f64::from(*factor) * part).sum())
    }
}

/// A handle to a chip on a bus, for faults and flaws. Clones refer to the same chip.
///
/// ```
/// use embedded_hal_async::i2c::I2c;
/// use stampfly_sim::chips::{Bmp280, Faults, I2cBus};
/// use stampfly_sim::{Simulation, SimulationConfig, time::block_on};
///
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// let mut bus = I2cBus::new(&clock, 1);
/// let barometer = bus.attach(0x76, Bmp280::new(&simulation.world, &clock, 1));
/// let mut id = [0];
/// block_on(&clock, bus.write_read(0x76, &[0xD0], &mut id))?;
/// assert_eq!(id, [0x58]);
/// barometer.set_faults(Faults { dead: true, ..Default::default() });
/// assert!(block_on(&clock, bus.write_read(0x76, &[0xD0], &mut id)).is_err());
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Attached {
    clock: Clock,
    chip: Rc<RefCell<dyn Chip>>,
    faults: Rc<Cell<Faults>>,
}

impl Attached {
    pub(super) fn new(clock: &Clock, chip: Rc<RefCell<dyn Chip>>) -> Self {
        Self { clock: clock.clone(), chip, faults: Rc::default() }
    }

    /// The present faults.
    #[must_use]
    pub fn faults(&self) -> Faults {
        self.faults.get()
    }

    /// Replaces the faults, from the next transfer on.
    pub fn set_faults(&self, faults: Faults) {
        self.faults.set(faults);
    }

    /// Reads a register without the bus, with the side effects of reading.
    #[must_use]
    pub fn peek(&self, register: u16) -> u16 {
        self.chip.borrow_mut().read(register, self.clock.now())
    }

    /// Resets the chip as a dip of its supply does: it loses its settings.
    pub fn reset(&self) {
        self.chip.borrow_mut().reset(self.clock.now());
    }

    /// Breaks or repairs the sensing element, see [`Chip::set_broken`].
    pub fn set_broken(&self, broken: bool) {
        self.chip.borrow_mut().set_broken(broken);
    }

    /// Sets or removes a flaw, see [`Flaw`].
    pub fn set_flaw(&self, flaw: Option<Flaw>) {
        self.chip.borrow_mut().set_flaw(flaw);
    }

    /// Replaces the content of the identity register, as of another part.
    pub fn set_id(&self, id: u16) {
        self.chip.borrow_mut().set_id(id);
    }
}

/// Transmits a byte with random bit errors.
pub(super) fn carry(byte: u8, bit_errors: f64, noise: &mut Noise) -> u8 {
    if bit_errors <= 0.0 {
        return byte;
    }
    (0..8).fold(byte, |byte, bit| byte ^ (u8::from(noise.chance(bit_errors)) << bit))
}
