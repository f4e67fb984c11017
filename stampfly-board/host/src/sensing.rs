//! The tasks that feed the bus: models of the sensors, or the real drivers over emulated chips.

use stampfly_board::tasks::{Health, Retry, pump};
use stampfly_board::{devices, wiring};
use stampfly_drivers::chip::vl53l3cx::BootAddress;
use stampfly_drivers::shared::SharedI2c;
use stampfly_drivers::slot::Slots;
use stampfly_drivers::{Barometer, Imu, Magnetometer, MotionCapture, OpticalFlow, PowerMonitor, RangeFinder};
use stampfly_sim::chips::{self, I2cBus, stand_in_image};
use stampfly_sim::sensors::{BaroModel, CameraModel, FlowModel, ImuModel, MagModel, PowerModel, RangeModel};
use stampfly_sim::time::{Clock, Tasks};
use std::sync::LazyLock;

/// How far the simulation goes down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sensing {
    /// To samples: models of the sensors stand in for the drivers. Fast.
    #[default]
    Models,
    /// To bytes: the real drivers over emulated chips, on buses that take their time.
    Chips,
}

/// What stands in for the inertial sensor's configuration file, at both ends of the bus.
pub(crate) static IMAGE: LazyLock<Vec<u8>> = LazyLock::new(stand_in_image);

/// How each sensor's driver fares.
#[derive(Debug, Default)]
pub struct Healths {
    /// Inertial sensor.
    pub imu: Health,
    /// Range finder, down.
    pub tof: Health,
    /// Range finder, ahead.
    pub tof_front: Health,
    /// Flow.
    pub flow: Health,
    /// Magnetometer.
    pub mag: Health,
    /// Barometer.
    pub baro: Health,
    /// Battery monitor.
    pub power: Health,
    /// Motion capture.
    pub cameras: Health,
}

/// The ends that sensors publish to.
pub(crate) struct Topics<'b> {
    pub imu: wiring::sensor_imu::Tx<'b>,
    pub tof: wiring::sensor_tof::Tx<'b>,
    pub tof_front: wiring::sensor_tof_front::Tx<'b>,
    pub flow: wiring::sensor_flow::Tx<'b>,
    pub mag: wiring::sensor_mag::Tx<'b>,
    pub baro: wiring::sensor_baro::Tx<'b>,
    pub power: wiring::sensor_power::Tx<'b>,
}

/// The models of the sensors.
pub(crate) struct Models {
    pub imu: ImuModel,
    pub tof: RangeModel,
    pub flow: FlowModel,
    pub mag: MagModel,
    pub baro: BaroModel,
    pub power: PowerModel,
}

/// A task that publishes a sensor's samples for as long as the vehicle is on.
macro_rules! spawn {
    ($tasks:ident, $clock:ident, $retry:ident, $sensor:expr => $publisher:expr, $health:expr) => {{
        let (mut sensor, mut publisher) = ($sensor, $publisher);
        let (clock, health): (_, &Health) = ($clock.clone(), &$health);
        $tasks.spawn(async move {
            let publish = |at, data: &_| {
                publisher.publish(at, data);
            };
            match pump(async || sensor.next().await, publish, clock, Retry::$retry, health).await {}
        });
    }};
}

/// Starts a task for each model. The order is part of the flight: tasks due at the same instant run in it.
pub(crate) fn start_models<'a>(
    tasks: &mut Tasks<'a>,
    clock: &Clock,
    models: Models,
    topics: Topics<'a>,
    health: &'a Healths,
) {
    spawn!(tasks, clock, PROMPT, models.imu => topics.imu, health.imu);
    spawn!(tasks, clock, PATIENT, models.tof => topics.tof, health.tof);
    spawn!(tasks, clock, PATIENT, models.flow => topics.flow, health.flow);
    spawn!(tasks, clock, PATIENT, models.mag => topics.mag, health.mag);
    spawn!(tasks, clock, PATIENT, models.baro => topics.baro, health.baro);
    spawn!(tasks, clock, PATIENT, models.power => topics.power, health.power);
}

/// What the drivers of one vehicle share; to be made before the tasks.
pub(crate) struct Shared {
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

/// Starts a task for each driver, over these chips.
pub(crate) fn start_drivers<'a>(
    tasks: &mut Tasks<'a>,
    clock: &Clock,
    board: chips::Board,
    shared: &'a mut Shared,
    topics: Topics<'a>,
    health: &'a Healths,
) {
    let ([to_down, to_ahead, to_mag, to_baro, to_power], _) = shared.i2c.split();
    let chips::Board { imu, flow, shutdown_bottom, shutdown_front, .. } = board;
    let time = || clock.clone();
    let ready = imu.interrupt_pin();
    let (imu, flow, _) = shared.slots.split(imu, flow, devices::LONGEST_FLOW);
    let down = devices::range_down(to_down, shutdown_bottom, &shared.boot, time());
    let ahead = devices::range_ahead(to_ahead, shutdown_front, &shared.boot, time());
    spawn!(tasks, clock, PROMPT, devices::imu(imu, time(), &IMAGE).with_interrupt(ready) => topics.imu, health.imu);
    spawn!(tasks, clock, PATIENT, down => topics.tof, health.tof);
    spawn!(tasks, clock, PATIENT, ahead => topics.tof_front, health.tof_front);
    spawn!(tasks, clock, PATIENT, devices::flow(flow, time()) => topics.flow, health.flow);
    spawn!(tasks, clock, PATIENT, devices::magnetometer(to_mag, time()) => topics.mag, health.mag);
    spawn!(tasks, clock, PATIENT, devices::barometer(to_baro, time()) => topics.baro, health.baro);
    spawn!(tasks, clock, PATIENT, devices::power(to_power, time()) => topics.power, health.power);
}

/// Starts the task of the cameras.
pub(crate) fn start_cameras<'a>(
    tasks: &mut Tasks<'a>,
    clock: &Clock,
    cameras: CameraModel,
    topic: wiring::external_pose::Tx<'a>,
    health: &'a Healths,
) {
    spawn!(tasks, clock, PATIENT, cameras => topic, health.cameras);
}
