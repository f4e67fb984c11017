//! What may go wrong between a chip and the processor, switched on and off while the simulation runs.

use crate::chips::Chip;
use crate::noise::Noise;
use crate::time::Clock;
use core::cell::{Cell, RefCell};
use stampfly_types::Duration;
use std::rc::Rc;

/// The faults of one chip. The default is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// The chip answers nothing: no acknowledge on I²C, all ones on SPI.
    pub dead: bool,
    /// Share of transfers that fail, 0 to 1: no acknowledge on I²C, an overrun of the controller on SPI.
    pub refusals: f64,
    /// Probability that a data bit is read or written wrongly, 0 to 1.
    pub bit_errors: f64,
    /// How long the chip holds the clock line low in every transfer. I²C only.
    pub stretch: Duration,
}

/// What is wrong with how a chip was soldered or made, or with what is in front of it: it answers and measures, but not what
/// its driver takes it for. Each emulator knows those that can happen to its part and takes no notice of the others.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Flaw {
    /// Soldered otherwise, or another variant of the part: where each axis that it reports points, as rows of the body's
    /// axes where the board's layout has the identity. BMI270, BMM150, MPU-6000, PMW3901.
    Mounting([[i8; 3]; 3]),
    /// Its conversions repeat the last. BMP280, BMM150, MPU-6000.
    Stuck,
    /// It stays asleep at so many requests to wake after a reset. MPU-6000.
    Sleepy(u32),
    /// It measures longer by this, m: a cover glass, a sensor that was pressed in. VL53L3CX.
    Offset(f64),
    /// Something lies this far in front of it, m. VL53L3CX.
    Covered(f64),
    /// What it computes by itself is nonsense; its histograms are not. VL53L3CX.
    LightMode(Nonsense),
    /// It sees so many times the voltage, as behind another divider. INA3221.
    Voltage(f64),
    /// It sees so many times the current, as across another shunt. INA3221.
    Current(f64),
}

/// What a range finder says that cannot measure in the way it is driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Nonsense {
    /// Its interrupt never comes.
    Silent,
    /// No measurement succeeds: there is no bias voltage for the detector.
    Failing,
    /// The same distance, to the last bit.
    Frozen,
    /// Light comes back, but the distance is never certain enough.
    Unseen,
    /// No light comes back.
    Blind,
}

impl Flaw {
    /// A vector of the body as a chip with this flaw is exposed to it.
    pub(super) fn turn(flaw: Option<Self>, body: [f64; 3]) -> [f64; 3] {
        let Some(Self::Mounting(rows)) = flaw else { return body };
        rows.map(|row| row.iter().zip(body).map(|(factor, part)| f64::from(*factor) * part).sum())
    }
}

/// A handle to a chip on a bus: its faults, and what somebody else may do to it. Clones mean the same chip.
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

    /// The faults at present.
    #[must_use]
    pub fn faults(&self) -> Faults {
        self.faults.get()
    }

    /// Replaces the faults, from the next transfer on.
    pub fn set_faults(&self, faults: Faults) {
        self.faults.set(faults);
    }

    /// What a register holds now, without the bus but with whatever reading does to the chip.
    #[must_use]
    pub fn peek(&self, register: u16) -> u16 {
        self.chip.borrow_mut().read(register, self.clock.now())
    }

    /// The supply dips: the chip loses its settings and starts again.
    pub fn reset(&self) {
        self.chip.borrow_mut().reset(self.clock.now());
    }

    /// Breaks or mends the sensing element: see [`Chip::set_broken`].
    pub fn set_broken(&self, broken: bool) {
        self.chip.borrow_mut().set_broken(broken);
    }

    /// Gives the chip a flaw, or mends it: see [`Flaw`].
    pub fn set_flaw(&self, flaw: Option<Flaw>) {
        self.chip.borrow_mut().set_flaw(flaw);
    }

    /// Another part has been soldered: this is what its identity register says from now on.
    pub fn set_id(&self, id: u16) {
        self.chip.borrow_mut().set_id(id);
    }
}

/// A byte as it arrives at the other end of the line.
pub(super) fn carry(byte: u8, bit_errors: f64, noise: &mut Noise) -> u8 {
    if bit_errors <= 0.0 {
        return byte;
    }
    (0..8).fold(byte, |byte, bit| byte ^ (u8::from(noise.chance(bit_errors)) << bit))
}
