//! The core that flies: inertial sensor, flow sensor, every runnable, the motors. Nothing else runs there.

use crate::clock::Clock;
use crate::motors::Motors;
use crate::pins::MotorPins;
use crate::sensors::Healths;
use crate::{imu_config, spi};
use alloc::boxed::Box;
use embassy_futures::join::join;
use stampfly_board::console::Profile;
use stampfly_board::schedule::Runnables;
use stampfly_board::{devices, topics};
use stampfly_drivers::slot::Slots;
use stampfly_drivers::task::{Backoff, run_sensor};
use stampfly_drivers::{Imu, MotorOutputs, OpticalFlow, Timebase};
use stampfly_flight::task::fly;
use stampfly_flight::{FlightLoop, Stopwatch, Watchdog};

/// What flies.
pub struct Parts {
    pub flight_loop: &'static mut FlightLoop<'static, Runnables>,
    pub imu: topics::ImuEnds<'static>,
    pub flow: topics::FlowEnds<'static>,
    pub duties: topics::MotorsEnds<'static>,
    pub motors: MotorPins<'static>,
    pub spi: spi::Parts,
    pub watchdog: &'static Watchdog,
    pub health: &'static Healths,
    pub profile: &'static Profile,
}

/// Flies until power-off.
#[embassy_executor::task]
pub async fn run(parts: Box<Parts>) {
    let Parts { flight_loop, mut imu, mut flow, mut duties, motors, spi, watchdog, health, profile } = *parts;
    let mut motors = Motors::new(motors, watchdog);
    let mut bus = spi::Bus::start(spi);
    let mut slots = Slots::new(Clock, devices::RHYTHM);
    let (imu_chip, flow_chip, ready) = bus.devices();
    let (imu_chip, flow_chip, _) = slots.split(imu_chip, flow_chip, devices::LONGEST_FLOW);
    let mut imu_chip = devices::imu(imu_chip, Clock, imu_config::FILE).with_interrupt(ready);
    let mut flow_chip = devices::flow(flow_chip, Clock);
    let sensing = run_sensor(
        async || imu_chip.next().await,
        |at, sample| _ = imu.sensor_imu.publish(at, sample),
        Clock,
        Backoff::CRITICAL,
        &health.imu,
    );
    let looking_down = run_sensor(
        async || flow_chip.next().await,
        |at, sample| _ = flow.sensor_flow.publish(at, sample),
        Clock,
        Backoff::SHARED,
        &health.flow,
    );
    let clock = || Clock.now();
    let write = |_, _: &FlightLoop<'_, Runnables>| {
        if duties.actuator_motor.has_new()
            && let Some(output) = duties.actuator_motor.latest()
        {
            // An error has no receiver in flight; the cut-off remains.
            let _ = motors.write(&output.data);
        }
    };
    let flying = fly(sensing, flight_loop, clock, Clock, Stopwatch::new(profile, clock), write);
    join(flying, looking_down).await;
}
