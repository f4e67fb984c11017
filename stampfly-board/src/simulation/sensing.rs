//! The tasks that feed the bus: models of the sensors, or the real drivers over emulated chips.

use super::faults::Wrong;
use crate::devices;
use crate::topics::{self, Id};
use stampfly_drivers::chip::vl53l3cx::BootAddress;
use stampfly_drivers::shared::SharedI2c;
use stampfly_drivers::slot::Slots;
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{Barometer, Imu, Magnetometer, MotionCapture, OpticalFlow, PowerMonitor, RangeFinder};
use stampfly_eskf::calibration::{Corrections, Corrector};
use stampfly_sim::chips::{self, Controller, I2cBus, SpiSetup, stand_in_image};
use stampfly_sim::sensors::{ButtonModel, IndicatorRecorder, MotorModel, Sensors};
use stampfly_sim::time::{Clock, Tasks};
use std::sync::LazyLock;
use std::vec::Vec;

/// How far the simulation goes down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sensing {
    /// To samples: models of the sensors stand in for the drivers. Fast.
    #[default]
    Models,
    /// To bytes: the real drivers over emulated chips, on buses that take their time.
    Chips,
}

/// The SPI as the firmware has it.
pub const SPI: SpiSetup = SpiSetup {
    controller: Controller::LevelWithTransfer,
    imu: (devices::SPI_MODE, devices::SPI_CLOCKS[0]),
    flow: (devices::SPI_MODE, devices::SPI_CLOCKS[1]),
    begins_with_nobody: true,
};

/// What stands in for the inertial sensor's configuration file, at both ends of the bus.
pub static IMAGE: LazyLock<Vec<u8>> = LazyLock::new(stand_in_image);

/// How the sensors do, in the order in which they were started.
pub type Healths = [SensorHealth; 8];

/// What each sensor measures: the topics' names without `sensor_`. There is no model of the one that looks ahead.
pub const NAMES: [&str; 7] = ["imu", "tof", "tof_front", "flow", "mag", "baro", "power"];

impl Sensing {
    /// What each sensor measures, in the order in which they are started: the topics' names without `sensor_`.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        NAMES.into_iter().filter(move |name| self == Self::Chips || *name != "tof_front")
    }
}

/// A task that publishes a sensor's samples, as far as they come through its line, for as long as the vehicle is on.
macro_rules! spawn {
    ($tasks:ident, $clock:ident, $health:ident, $wrong:ident, $backoff:ident, $sensor:expr => $ends:ident.$owner:ident.$topic:ident $(, $correct:expr)?) => {{
        let (mut sensor, mut line, mut publisher) = ($sensor, $wrong.line(Id::$topic), $ends.$owner.$topic);
        let (clock, health): (_, &SensorHealth) = ($clock.clone(), $health.next().expect("one for each sensor"));
        $tasks.spawn(async move {
            let publish = |at, data: &_| {
                #[allow(unused_mut, reason = "not every sensor is corrected")]
                if let Some(mut data) = line.pass(at, data) {
                    $($correct(&mut data);)?
                    publisher.publish(at, &data);
                }
            };
            match run_sensor(async || sensor.next().await, publish, clock, Backoff::$backoff, health).await {}
        });
    }};
}

/// What is left when the sensors have been started: models, and the ends of everybody else outside.
pub(super) struct Others<'b> {
    pub motors: (MotorModel, topics::MotorsEnds<'b>),
    pub indicator: (IndicatorRecorder, topics::IndicatorEnds<'b>),
    pub button: (ButtonModel, topics::ButtonPinEnds<'b>),
    pub link: topics::LinkEnds<'b>,
    pub cutoff: topics::CutoffEnds<'b>,
    pub self_test: topics::SelfTestEnds<'b>,
    pub console: topics::ConsoleEnds<'b>,
}

/// What the drivers of one vehicle share; to be made before the tasks.
pub(super) struct Shared {
    boot: BootAddress,
    slots: Slots<Clock>,
    i2c: SharedI2c<I2cBus, 5>,
}

impl Shared {
    /// For the chips of this bus.
    pub fn new(clock: &Clock, i2c: &I2cBus) -> Self {
        Self {
            boot: BootAddress::new(),
            slots: Slots::new(clock.clone(), devices::RHYTHM),
            i2c: SharedI2c::new(i2c.clone()),
        }
    }
}

/// Starts a task for each model of a sensor; cameras have nothing else. The order is part of the flight: tasks due at the
/// same instant run in it.
pub(super) fn start_models<'a>(
    tasks: &mut Tasks<'a>,
    clock: &Clock,
    (models, wrong): (Sensors, &Wrong),
    ends: topics::Outside<'a>,
    (cameras, corrections): (bool, &Corrections),
    health: &'a Healths,
) -> Others<'a> {
    let mut health = health.iter();
    let (mut inertial, magnetic) = (Corrector::new(corrections), Corrector::new(corrections));
    spawn!(tasks, clock, health, wrong, CRITICAL, models.imu => ends.imu.sensor_imu, |imu: &mut _| inertial.imu(imu));
    spawn!(tasks, clock, health, wrong, SHARED, models.tof => ends.tof.sensor_tof);
    spawn!(tasks, clock, health, wrong, SHARED, models.flow => ends.flow.sensor_flow);
    spawn!(tasks, clock, health, wrong, SHARED, models.mag => ends.mag.sensor_mag, |mag: &mut _| magnetic.mag(mag));
    spawn!(tasks, clock, health, wrong, SHARED, models.baro => ends.baro.sensor_baro);
    spawn!(tasks, clock, health, wrong, SHARED, models.power => ends.power.sensor_power);
    if cameras {
        spawn!(tasks, clock, health, wrong, SHARED, models.cameras => ends.cameras.external_pose);
    }
    Others {
        motors: (models.motors, ends.motors),
        indicator: (models.indicator, ends.indicator),
        button: (models.button, ends.button_pin),
        link: ends.link,
        cutoff: ends.cutoff,
        self_test: ends.self_test,
        console: ends.console,
    }
}

/// Starts a task for each driver, over these chips.
pub(super) fn start_drivers<'a>(
    tasks: &mut Tasks<'a>,
    clock: &Clock,
    (board, shared): (chips::Board, &'a mut Shared),
    (models, wrong): (Sensors, &Wrong),
    ends: topics::Outside<'a>,
    (cameras, corrections): (bool, &Corrections),
    health: &'a Healths,
) -> Others<'a> {
    let mut health = health.iter();
    let (mut inertial, magnetic) = (Corrector::new(corrections), Corrector::new(corrections));
    let ([to_down, to_ahead, to_mag, to_baro, to_power], _) = shared.i2c.split();
    let chips::Board { imu, flow, shutdown_bottom, shutdown_front, .. } = board;
    let time = || clock.clone();
    let ready = imu.interrupt_pin();
    let (imu, flow, _) = shared.slots.split(imu, flow, devices::LONGEST_FLOW);
    let down = devices::range_down(to_down, shutdown_bottom, &shared.boot, time());
    let ahead = devices::range_ahead(to_ahead, shutdown_front, &shared.boot, time());
    let imu = devices::imu(imu, time(), &IMAGE).with_interrupt(ready);
    spawn!(tasks, clock, health, wrong, CRITICAL, imu => ends.imu.sensor_imu, |imu: &mut _| inertial.imu(imu));
    spawn!(tasks, clock, health, wrong, SHARED, down => ends.tof.sensor_tof);
    spawn!(tasks, clock, health, wrong, SHARED, ahead => ends.tof_front.sensor_tof_front);
    spawn!(tasks, clock, health, wrong, SHARED, devices::flow(flow, time()) => ends.flow.sensor_flow);
    let mag = devices::magnetometer(to_mag, time());
    spawn!(tasks, clock, health, wrong, SHARED, mag => ends.mag.sensor_mag, |mag: &mut _| magnetic.mag(mag));
    spawn!(tasks, clock, health, wrong, SHARED, devices::barometer(to_baro, time()) => ends.baro.sensor_baro);
    spawn!(tasks, clock, health, wrong, SHARED, devices::power(to_power, time()) => ends.power.sensor_power);
    if cameras {
        spawn!(tasks, clock, health, wrong, SHARED, models.cameras => ends.cameras.external_pose);
    }
    Others {
        motors: (models.motors, ends.motors),
        indicator: (models.indicator, ends.indicator),
        button: (models.button, ends.button_pin),
        link: ends.link,
        cutoff: ends.cutoff,
        self_test: ends.self_test,
        console: ends.console,
    }
}
