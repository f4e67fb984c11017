//! The StampFly's chips on their two buses with their pins.

use super::{
    Attached, Bmi270, Bmm150, Bmp280, Controller, I2cBus, Ina3221, Pmw3901, ShutdownPin, SpiBus, SpiPort, Vl53l3cx,
};
use crate::SimulationConfig;
use crate::sensors::Mount;
use crate::time::Clock;
use crate::world::World;
use embedded_hal::spi::{MODE_3, Mode};

/// SPI configuration of the processor.
///
/// ```
/// use embedded_hal::spi::{MODE_0, Operation, SpiDevice};
/// use stampfly_sim::chips::{Board, SpiSetup, stand_in_image};
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::Instant;
///
/// // The inertial sensor in another mode than the flow sensor, on an ESP32-S3.
/// let setup = SpiSetup { imu: (MODE_0, 10_000_000), ..SpiSetup::default() };
/// let config = SimulationConfig::example();
/// let Simulation { world, clock, .. } = Simulation::new(&config);
/// let Board { mut imu, mut flow, .. } = Board::on(&setup, &world, &clock, &config, &stand_in_image());
/// clock.advance_to(Instant::from_millis(50));
/// imu.write(&[0x80, 0, 0])?;
/// let mut id = [0];
/// flow.transaction(&mut [Operation::Write(&[0]), Operation::DelayNs(35_000), Operation::Read(&mut id)])?;
/// assert_ne!(id, [0x49], "the clock rose under the selected chip");
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpiSetup {
    /// When the controller sets the clock's idle level.
    pub controller: Controller,
    /// Mode and clock of the inertial sensor, Hz.
    pub imu: (Mode, u32),
    /// Mode and clock of the flow sensor, Hz.
    pub flow: (Mode, u32),
    /// Before the first transfer, send a byte in the inertial sensor's mode without a selected
    /// chip, which sets the clock's idle level.
    pub begins_with_nobody: bool,
}

impl Default for SpiSetup {
    /// As the StampFly's firmware: an ESP32-S3, both chips in mode 3, each with its highest clock.
    fn default() -> Self {
        Self {
            controller: Controller::LevelWithTransfer,
            imu: (MODE_3, 10_000_000),
            flow: (MODE_3, 2_000_000),
            begins_with_nobody: true,
        }
    }
}

/// The chips of one vehicle after power-on, with both SPI chip selects high. The same configuration
/// gives the same specimens as [`Sensors`](crate::sensors::Sensors).
///
/// ```
/// use stampfly_drivers::chip::ina3221::{Config, Ina3221};
/// use stampfly_drivers::PowerMonitor;
/// use stampfly_sim::chips::{Board, stand_in_image};
/// use stampfly_sim::{Simulation, SimulationConfig, time::block_on};
///
/// let config = SimulationConfig::example();
/// let simulation = Simulation::new(&config);
/// let board = Board::new(&simulation.world, &simulation.clock, &config, &stand_in_image());
/// let mut monitor = Ina3221::new(board.i2c, Ina3221::A0_GROUND, simulation.clock.clone(), Config::default());
/// let sample = block_on(&simulation.clock, monitor.next())?;
/// assert!((3.7..4.4).contains(&sample.data.voltage));
/// # Ok::<(), stampfly_drivers::chip::ChipError<stampfly_sim::chips::BusError>>(())
/// ```
#[derive(Debug)]
pub struct Board {
    /// Magnetometer, barometer, battery monitor and both range finders.
    pub i2c: I2cBus,
    /// The inertial sensor, on the SPI shared with the flow sensor.
    pub imu: SpiPort<Bmi270>,
    /// The flow sensor, on the same SPI.
    pub flow: SpiPort<Pmw3901>,
    /// XSHUT of the bottom range finder.
    pub shutdown_bottom: ShutdownPin,
    /// XSHUT of the front range finder.
    pub shutdown_front: ShutdownPin,
    /// Handles for faults of each chip.
    pub attached: AttachedChips,
}

/// Fault handles of all chips.
#[derive(Clone, Debug)]
pub struct AttachedChips {
    /// BMI270.
    pub imu: Attached,
    /// PMW3901.
    pub flow: Attached,
    /// BMM150.
    pub mag: Attached,
    /// BMP280.
    pub baro: Attached,
    /// INA3221.
    pub power: Attached,
    /// Bottom VL53L3CX.
    pub tof: Attached,
    /// Front VL53L3CX.
    pub tof_front: Attached,
}

impl AttachedChips {
    /// All chips with the names of their quantities, those on SPI first.
    #[must_use]
    pub const fn all(&self) -> [(&'static str, &Attached); 7] {
        let Self { imu, flow, mag, baro, power, tof, tof_front } = self;
        [
            ("imu", imu),
            ("flow", flow),
            ("mag", mag),
            ("baro", baro),
            ("power", power),
            ("tof", tof),
            ("tof_front", tof_front),
        ]
    }

    /// The chip with this name.
    #[must_use]
    pub fn named(&self, name: &str) -> Option<&Attached> {
        self.all().into_iter().find_map(|(known, chip)| (known == name).then_some(chip))
    }
}

impl Board {
    /// Address of both range finders after power-on.
    const RANGE: u8 = 0x29;

    /// Chips in this world. `image` is the configuration file that the inertial sensor accepts.
    #[must_use]
    pub fn new(world: &World, clock: &Clock, config: &SimulationConfig, image: &[u8]) -> Self {
        Self::on(&SpiSetup::default(), world, clock, config, image)
    }

    /// As [`new`](Self::new), with another SPI configuration.
    #[must_use]
    pub fn on(setup: &SpiSetup, world: &World, clock: &Clock, config: &SimulationConfig, image: &[u8]) -> Self {
        let seed = config.seed;
        let (i2c, spi) = (I2cBus::new(clock, seed), SpiBus::new(clock, seed));
        spi.set_controller(setup.controller);
        if setup.begins_with_nobody {
            spi.send_to_nobody(setup.imu.0);
        }
        let (imu, imu_attached) = spi.attach(setup.imu.1, Bmi270::new(world, clock, seed, config.vibration, image));
        let (flow, flow_attached) = spi.attach(setup.flow.1, Pmw3901::new(world, clock, seed));
        let (imu, flow) = (imu.with_mode(setup.imu.0), flow.with_mode(setup.flow.0));
        let (bottom, shutdown_bottom) = Vl53l3cx::new(world, clock, seed, Mount::Bottom);
        let (front, shutdown_front) = Vl53l3cx::new(world, clock, seed, Mount::Front);
        let attached = AttachedChips {
            imu: imu_attached,
            flow: flow_attached,
            mag: i2c.attach(0x10, Bmm150::new(world, clock, seed)),
            baro: i2c.attach(0x76, Bmp280::new(world, clock, seed)),
            power: i2c.attach(0x40, Ina3221::new(world, clock, seed)),
            tof: i2c.attach(Self::RANGE, bottom),
            tof_front: i2c.attach(Self::RANGE, front),
        };
        Self { i2c, imu, flow, shutdown_bottom, shutdown_front, attached }
    }
}

/// A placeholder for the inertial sensor's proprietary configuration file: 8 kB in which no two
/// bursts are equal. The emulator only compares the bytes.
#[must_use]
pub fn stand_in_image() -> Vec<u8> {
    (0..8_192u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect()
}
