//! The core that flies: inertial sensor, flow sensor, every runnable, the motors. Nothing else runs there.

use crate::clock::Clock;
use crate::motors::Motors;
use crate::pins::MotorPins;
use crate::sensors::HEALTH;
use crate::{imu_config, spi};
use embassy_futures::join::join;
use stampfly_board::profile::{Profile, Stopwatch};
use stampfly_board::tasks::{Retry, fly, pump};
use stampfly_board::{FlightLoop, devices, wiring};
use stampfly_drivers::slot::Slots;
use stampfly_drivers::{Imu, OpticalFlow};

/// How long every runnable takes, for whoever reports.
pub static PROFILE: Profile = Profile::new();

/// What flies.
pub struct Parts {
    pub flight_loop: &'static mut FlightLoop<'static>,
    pub imu: wiring::sensor_imu::Tx<'static>,
    pub flow: wiring::sensor_flow::Tx<'static>,
    pub duties: wiring::actuator_motor::Rx<'static>,
    pub motors: MotorPins<'static>,
    pub spi: spi::Parts,
}

/// Flies for ever.
#[embassy_executor::task]
pub async fn run(parts: Parts) {
    let Parts { flight_loop, mut imu, mut flow, duties, motors, spi } = parts;
    let motors = Motors::new(motors);
    let mut bus = spi::Bus::start(spi);
    let mut slots = Slots::new(Clock, devices::RHYTHM);
    let (imu_chip, flow_chip, ready) = bus.devices();
    let (imu_chip, flow_chip, _) = slots.split(imu_chip, flow_chip, devices::LONGEST_FLOW);
    let mut imu_chip = devices::imu(imu_chip, Clock, imu_config::FILE).with_interrupt(ready);
    let mut flow_chip = devices::flow(flow_chip, Clock);
    let sensing = pump(
        async || imu_chip.next().await,
        |at, sample| _ = imu.publish(at, sample),
        Clock,
        Retry::PROMPT,
        &HEALTH.imu,
    );
    let looking_down = pump(
        async || flow_chip.next().await,
        |at, sample| _ = flow.publish(at, sample),
        Clock,
        Retry::PATIENT,
        &HEALTH.flow,
    );
    let mut stopwatch = Stopwatch::new(&PROFILE, Clock);
    // A motor channel that refuses has nobody to tell in flight; the cut-off remains.
    let flying = fly(sensing, flight_loop, duties, motors, Clock, &mut stopwatch, |_| {});
    join(flying, looking_down).await;
}
