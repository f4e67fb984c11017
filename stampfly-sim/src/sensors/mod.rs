//! Sensor and actuator models of the StampFly and of other vehicles.
//!
//! Each model implements the trait of `stampfly-drivers` that the driver of the hardware
//! implements, and holds a handle to the world. Rates, ranges and resolutions are those of the
//! chips. Each chip's clock is off by up to 2 %; noise, offsets and mounting errors are drawn from
//! the seed. Models never fail: faults act on their samples ([`fault`](crate::fault)). To test a
//! driver use the register-level emulators in [`chips`](crate::chips).
//!
//! | model | chip | rate | trait |
//! |---|---|---|---|
//! | [`ImuModel`] | BMI270 | 1600 → 400 Hz | `Imu` |
//! | [`RangeModel`] | VL53L3CX | 30 Hz | `RangeFinder` |
//! | [`FlowModel`] | PMW3901 | 100 Hz | `OpticalFlow` |
//! | [`MagModel`] | BMM150 | 25 Hz | `Magnetometer` |
//! | [`BaroModel`] | BMP280 | 13.5 Hz | `Barometer` |
//! | [`PowerModel`] | INA3221 | 10 Hz | `PowerMonitor` |
//! | [`CameraModel`] | a room full of cameras | 100 Hz | `MotionCapture` |
//! | [`Mpu6000Model`] | MPU-6000, of other vehicles | 4 kHz | `Imu` |
//! | [`GnssModel`] | a satellite receiver like a u-blox M8, of other vehicles | 5 Hz | `Gnss` |
//! | [`AirspeedModel`] | a pitot tube with an SDP33, of other vehicles | 50 Hz | `Airspeed` |
//!
//! Actuators: [`MotorModel`] (`MotorOutputs`), [`ServoModel`] (`ServoOutputs`, of aeroplanes),
//! [`IndicatorRecorder`], [`ButtonModel`].

mod actuators;
mod airspeed;
pub(crate) mod baro;
mod cameras;
pub(crate) mod flow;
mod gnss;
pub mod imu;
pub(crate) mod light;
pub(crate) mod mag;
pub(crate) mod mounting;
mod mpu6000;
pub(crate) mod power;
pub(crate) mod schedule;
mod servos;
mod swept;
pub mod tof;
mod weather;

pub use actuators::{ButtonModel, IndicatorRecorder, MotorModel};
pub use airspeed::AirspeedModel;
pub use baro::BaroModel;
pub use cameras::CameraModel;
pub use flow::FlowModel;
pub use gnss::{GnssConfig, GnssModel};
pub use imu::ImuModel;
pub use mag::MagModel;
pub use mpu6000::Mpu6000Model;
pub use power::PowerModel;
pub use servos::ServoModel;
pub use tof::{Mount, RangeModel};

use crate::time::Clock;
use crate::world::World;

/// Sensors and actuators of the StampFly, and a motion capture system.
#[derive(Debug)]
pub struct Sensors {
    /// Inertial measurement unit.
    pub imu: ImuModel,
    /// Bottom range finder.
    pub tof: RangeModel,
    /// Optical flow.
    pub flow: FlowModel,
    /// Magnetometer.
    pub mag: MagModel,
    /// Barometer.
    pub baro: BaroModel,
    /// Motion capture.
    pub cameras: CameraModel,
    /// Battery monitor.
    pub power: PowerModel,
    /// Motors.
    pub motors: MotorModel,
    /// Lights and buzzer.
    pub indicator: IndicatorRecorder,
    /// The button.
    pub button: ButtonModel,
}

impl Sensors {
    pub(crate) fn new(world: &World, clock: &Clock, seed: u64, vibration: f64) -> Self {
        Self {
            imu: ImuModel::new(world, clock, seed, vibration),
            tof: RangeModel::new(world, clock, seed, Mount::Bottom),
            flow: FlowModel::new(world, clock, seed),
            mag: MagModel::new(world, clock, seed),
            baro: BaroModel::new(world, clock, seed),
            cameras: CameraModel::new(world, clock, seed),
            power: PowerModel::new(world, clock, seed),
            motors: MotorModel::new(world, clock),
            indicator: IndicatorRecorder::new(clock),
            button: ButtonModel::default(),
        }
    }
}
