//! The flight task: from the inertial sensor's sample to the motors in one task.
//!
//! The sensor's own task is polled inside this one, so between the arrival of a sample and the motors there is no queue and
//! no context switch. Background activations run here too, one at a time and only while the flight band has nothing to do:
//! what is due waits at most for the longest of them, which the response times of the activation table account for.
//!
//! For firmware, on any `async` executor, and for tests on virtual time. Not for a simulator that runs faster than real
//! time: that calls the [`FlightLoop`] itself.

use crate::{FlightLoop, Observer};
use core::convert::Infallible;
use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::Poll;
use embedded_hal_async::delay::DelayNs;
use stampfly_bus::{Band, Schedule};
use stampfly_types::{Duration, Instant};

/// Longest sleep when the table names no instant at which something is due.
const IDLE: Duration = Duration::from_millis(10);

/// Runs what is due, as long as it is polled.
///
/// * `sensing` publishes the samples that activate the flight band, and is polled first. While it is silent, the periods
///   and deadlines of the activation table run what they name.
/// * `clock` and `delay` tell the same time: the instants of samples, and how long to sleep.
/// * `after_flight_band` is called after each pass through the flight band in which something ran, with the instant at
///   which the pass began: write to the motors there, and feed a [`Watchdog`](crate::Watchdog) that cuts them off when
///   this task stops. Nothing is pending then, so a disarmed vehicle may be given [other parameters](crate::live), and a record its key frame.
///
/// The flight loop is borrowed because it is large and a future holds its arguments more than once; firmware keeps it in
/// a `static`. A topic that activates a runnable and is not published by `sensing` is to be published by a task of the same
/// executor that wakes this one, as a [`Hook`](stampfly_bus::Hook) on the bus can do.
///
/// ```
/// # mod rover { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/flight/common/mod.rs")); }
/// use rover::{Rover, topics}; // the rover of `tests/flight/common`
/// use stampfly_flight::{Assembled, FlightLoop, task::fly};
/// use stampfly_types::{Instant, messages::TofData};
/// # use embedded_hal_async::delay::DelayNs;
/// # struct Delay;
/// # impl DelayNs for Delay { async fn delay_ns(&mut self, _: u32) { std::future::pending().await } }
///
/// # fn main() {
/// let mut bus = topics::Bus::new();
/// let Assembled { mut flight_loop, outside, .. } = Assembled::<Rover>::new(&mut bus, None, &0.5, Instant::ZERO);
/// let topics::Outside { mut range_finder, mut motors } = outside;
///
/// let clock = || Instant::from_millis(21);
/// let sensing = async {
///     let range = TofData { distance: 1.5, valid: true, ..Default::default() };
///     range_finder.sensor_range.publish(Instant::from_millis(20), &range);
///     std::future::pending().await
/// };
/// let mut duty = 0.0;
/// let write_motors = |_, _: &mut FlightLoop<'_, Rover>| if let Some(output) = motors.actuator_motor.latest() { duty = output.data.duty[0] };
/// let flying = fly(sensing, &mut flight_loop, clock, Delay, (), write_motors);
/// // On an executor: `flying.await`.
/// # use std::{pin::pin, task::{Context, Waker}};
/// # assert!(pin!(flying).poll(&mut Context::from_waker(Waker::noop())).is_pending());
/// assert_eq!(duty, 0.75);
/// # }
/// ```
///
/// # Cancellation
/// Dropping the future between two polls stops flying: `sensing` is dropped with it, and the motors keep their last duty
/// until they are stopped elsewhere. No activation is left half done, and the flight loop may fly again.
pub async fn fly<R: Schedule>(
    sensing: impl Future<Output = Infallible>,
    flight_loop: &mut FlightLoop<'_, R>,
    clock: impl Fn() -> Instant,
    mut delay: impl DelayNs,
    mut observer: impl Observer,
    mut after_flight_band: impl FnMut(Instant, &mut FlightLoop<'_, R>),
) -> Infallible {
    let mut sensing = pin!(sensing);
    loop {
        let now = clock();
        let deadline = flight_loop.next_tick().unwrap_or(now + IDLE);
        let left = u32::try_from(deadline.since(now).as_micros()).unwrap_or(u32::MAX);
        let due = {
            let mut alarm = pin!(delay.delay_us(left));
            poll_fn(|context| {
                if let Poll::Ready(never) = sensing.as_mut().poll(context) {
                    match never {}
                }
                let now = clock();
                if flight_loop.is_due(Band::Flight, now) {
                    return Poll::Ready(Some(Band::Flight));
                }
                if flight_loop.is_due(Band::Background, now) {
                    return Poll::Ready(Some(Band::Background));
                }
                alarm.as_mut().poll(context).map(|()| None)
            })
            .await
        };
        let now = clock();
        match due {
            Some(Band::Background) => {
                if flight_loop.run_next(Band::Background, now, &mut observer) {
                    yield_now().await;
                }
            }
            // By the clock: something may be due now that was not then.
            _ => {
                if flight_loop.run_band(Band::Flight, now, &mut observer) {
                    after_flight_band(now, flight_loop);
                }
            }
        }
    }
}

/// Lets the other tasks of the executor run, drivers among them.
async fn yield_now() {
    let mut waited = false;
    poll_fn(|context| {
        context.waker().wake_by_ref();
        if core::mem::replace(&mut waited, true) { Poll::Ready(()) } else { Poll::Pending }
    })
    .await;
}
