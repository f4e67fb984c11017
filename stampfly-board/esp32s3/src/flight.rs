//! The core that flies: inertial sensor, flow sensor, every runnable, the motors. Nothing else runs there.

use crate::changes;
use crate::clock::Clock;
use crate::motors::Motors;
use crate::pins::MotorPins;
use crate::record::{KEPT, NAME, Record, Writer};
use crate::sensors::Healths;
use crate::{imu_config, spi};
use alloc::boxed::Box;
use core::cell::RefCell;
use embassy_futures::join::join;
use stampfly_board::console::Profile;
use stampfly_board::schedule::Runnables;
use stampfly_board::{Corrector, devices, topics};
use stampfly_drivers::slot::Slots;
use stampfly_drivers::task::{Backoff, run_sensor};
use stampfly_drivers::{Imu, MotorOutputs, OpticalFlow, Timebase};
use stampfly_flight::compact::Watching;
use stampfly_flight::task::fly;
use stampfly_flight::{FlightLoop, Stopwatch, Watchdog};
use static_cell::StaticCell;

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
    /// Applies what calibrations have found.
    pub corrector: Corrector,
    /// Where the flight record goes.
    pub ring: Writer,
}

/// The record's half here. Made where it stays, or the task would need stack for it all the time.
#[inline(never)]
fn record(ring: Writer, flight_loop: &FlightLoop<'static, Runnables>) -> &'static RefCell<Record> {
    static RECORD: StaticCell<RefCell<Record>> = StaticCell::new();
    RECORD.init_with(|| RefCell::new(Record::new(ring, flight_loop.heads(), NAME, KEPT)))
}

/// Applies what has changed, as far as it may now. By itself: no pass needs it.
#[cold]
#[inline(never)]
fn change(is_armed: bool, flight_loop: &mut FlightLoop<'_, Runnables>, record: &RefCell<Record>) {
    if let Some(mut change) = changes::take() {
        change.apply(is_armed, flight_loop, &mut Watching(record));
        changes::give_back(change);
    }
}

/// Flies until power-off.
#[embassy_executor::task]
pub async fn run(parts: Box<Parts>) {
    let Parts {
        flight_loop,
        mut imu,
        mut flow,
        mut duties,
        motors,
        spi,
        watchdog,
        health,
        profile,
        mut corrector,
        ring,
    } = *parts;
    let mut motors = Motors::new(motors, watchdog);
    let mut bus = spi::Bus::start(spi);
    let mut slots = Slots::new(Clock, devices::RHYTHM);
    let (imu_chip, flow_chip, ready) = bus.devices();
    let (imu_chip, flow_chip, _) = slots.split(imu_chip, flow_chip, devices::LONGEST_FLOW);
    let mut imu_chip = devices::imu(imu_chip, Clock, imu_config::FILE).with_interrupt(ready);
    let mut flow_chip = devices::flow(flow_chip, Clock);
    let sensing = run_sensor(
        async || imu_chip.next().await,
        |at, sample| {
            let mut sample = *sample;
            corrector.imu(&mut sample);
            imu.sensor_imu.publish(at, &sample);
        },
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
    let record = record(ring, flight_loop);
    let mut is_armed = true;
    let write = |_, flight_loop: &mut FlightLoop<'_, Runnables>| {
        if duties.actuator_motor.has_new()
            && let Some(output) = duties.actuator_motor.latest()
        {
            // An error has no receiver in flight; the cut-off remains.
            let _ = motors.write(&output.data);
            is_armed = output.data.armed;
        }
        if changes::is_due(is_armed) {
            change(is_armed, flight_loop, record);
        }
        // Borrowed by nobody between two passes.
        if let Ok(mut record) = record.try_borrow_mut()
            && record.wants_key_frame()
        {
            let _ = record.key_frame(flight_loop);
        }
    };
    // Closest to the activations: the stopwatch.
    let observers = (Watching(record), Stopwatch::new(profile, clock));
    let flying = fly(sensing, flight_loop, clock, Clock, observers, write);
    join(flying, looking_down).await;
}
