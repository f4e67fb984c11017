//! The task of a sensor: forwards a driver's samples to a topic and pauses after errors.
//!
//! [`run_sensor`] is an ordinary `async` function: firmware spawns one per sensor on its executor,
//! and a test polls it on virtual time. It depends on neither bus nor vehicle, because it passes
//! the samples to a closure. Not needed in a program that calls the driver itself.

use crate::time::sleep_until;
use crate::{Sample, SensorError, SensorErrorKind, Timebase};
use core::convert::Infallible;
use core::fmt;
use core::sync::atomic::{AtomicU32, Ordering};
use stampfly_types::{Duration, Instant};

/// Counters of a sensor: samples, errors, and the kind of the latest error. Written by one
/// [`run_sensor`], readable from any context.
#[derive(Debug, Default)]
pub struct SensorHealth {
    samples: AtomicU32,
    errors: AtomicU32,
    /// Index into [`KINDS`] plus one, or zero before the first error.
    last: AtomicU32,
}

/// Every kind of error, so that one can be stored as an index in an atomic word.
const KINDS: [SensorErrorKind; 10] = [
    SensorErrorKind::Bus,
    SensorErrorKind::Timeout,
    SensorErrorKind::Identification,
    SensorErrorKind::Configuration,
    SensorErrorKind::SelfTest,
    SensorErrorKind::Data,
    SensorErrorKind::Restarted,
    SensorErrorKind::Absent,
    SensorErrorKind::Implausible,
    SensorErrorKind::Other,
];

impl SensorHealth {
    /// No sample and no error yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { samples: AtomicU32::new(0), errors: AtomicU32::new(0), last: AtomicU32::new(0) }
    }

    /// Number of samples published since power-on, modulo 2³².
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.samples.load(Ordering::Relaxed)
    }

    /// Number of errors since power-on, modulo 2³².
    #[must_use]
    pub fn errors(&self) -> u32 {
        self.errors.load(Ordering::Relaxed)
    }

    /// The latest error, whether or not the driver has recovered from it.
    #[must_use]
    pub fn last_error(&self) -> Option<SensorErrorKind> {
        let place = self.last.load(Ordering::Relaxed).checked_sub(1)?;
        KINDS.get(place as usize).copied()
    }

    fn count(counter: &AtomicU32) {
        // Only one task writes, so a load and a store suffice, also on cores without atomic
        // addition.
        counter.store(counter.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }

    fn note(&self, kind: SensorErrorKind) {
        Self::count(&self.errors);
        // A kind that is missing in the table counts as `Other`, its last entry.
        let place = KINDS.iter().position(|known| *known == kind).unwrap_or(KINDS.len() - 1);
        self.last.store(place as u32 + 1, Ordering::Relaxed);
    }
}

/// `samples: 70, errors: 2, last error: no new sample in time`
impl fmt::Display for SensorHealth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "samples: {}, errors: {}", self.samples(), self.errors())?;
        self.last_error().map_or(Ok(()), |kind| write!(f, ", last error: {kind}"))
    }
}

/// The longest pause is `pause` times two to the power of this.
const MAX_DOUBLINGS: u32 = 4;

/// Exponential backoff: the pause after an error, before the driver's next attempt.
///
/// After `constant_for` errors in a row, each pause is twice as long as the one before, up to
/// sixteen times `pause`.
///
/// ```
/// use stampfly_driver_core::task::Backoff;
/// use stampfly_types::Duration;
/// let backoff = Backoff { pause: Duration::from_millis(5), constant_for: 2 };
/// let pauses = [1, 2, 3, 4, 5, 6, 7].map(|errors| backoff.after(errors).as_millis());
/// assert_eq!(pauses, [5, 5, 10, 20, 40, 80, 80]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Backoff {
    /// Length of the first pause.
    pub pause: Duration,
    /// Number of errors in a row after which the pause starts to grow.
    pub constant_for: u32,
}

impl Backoff {
    /// For a chip that shares its bus with devices of equal importance: the pause grows from the
    /// second error in a row on.
    pub const SHARED: Self = Self { pause: Duration::from_millis(5), constant_for: 1 };
    /// For the sensor that the motors depend on, on a bus of its own. Retries at the sensor's own
    /// period for 40 ms, longer than the motors turn without it, before the pause grows.
    pub const CRITICAL: Self = Self { pause: Duration::from_micros(2_500), constant_for: 16 };

    /// The pause after this number of errors in a row.
    #[must_use]
    pub fn after(self, errors: u32) -> Duration {
        self.pause * (1 << MAX_DOUBLINGS.min(errors.saturating_sub(self.constant_for)))
    }
}

/// Shortens the pause by up to a quarter.
///
/// Two drivers can fail together, for example when one chip holds the bus. Without jitter they
/// would retry together each time, and the healthy chip would never deliver a sample. The time is
/// the source of the jitter: it needs no seed, and a simulated flight stays repeatable. The factor
/// is 2⁶⁴ divided by the golden ratio, as in Fibonacci hashing.
fn with_jitter(now: Instant, pause: Duration) -> Duration {
    let random = now.as_micros().wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
    pause - Duration::from_micros(random.checked_rem((pause / 4).as_micros()).unwrap_or(0))
}

/// Publishes a driver's samples for as long as it is polled. After an error it pauses according to
/// `backoff`, so that a chip that does not answer takes hardly any bus time from its neighbours.
/// Each pause is shortened by up to a quarter, so that two failing drivers do not retry in step.
///
/// A silent sensor is not an error here: a reader of the topic sees the age of the newest sample.
///
/// ```
/// use stampfly_driver_core::task::{Backoff, SensorHealth, run_sensor};
/// use stampfly_driver_core::blocking::BlockingClock;
/// use stampfly_driver_core::{Sample, SensorErrorKind};
/// use stampfly_types::Instant;
/// # #[derive(Clone)] struct Delay;
/// # impl embedded_hal::delay::DelayNs for Delay { fn delay_ns(&mut self, _: u32) {} }
/// # let clock = BlockingClock::new(Delay, || Instant::ZERO);
/// let (health, mut calls, mut published) = (SensorHealth::new(), 0, Vec::new());
/// let task = run_sensor(
///     async || {
///         calls += 1;
///         match calls {
///             1 | 3 => Ok(Sample { at: Instant::from_micros(calls), data: calls }),
///             2 => Err(SensorErrorKind::Bus),
///             _ => std::future::pending().await,
///         }
///     },
///     |at, data: &u64| published.push((at, *data)),
///     clock,
///     Backoff::SHARED,
///     &health,
/// );
/// # use core::{future::Future, pin::pin, task::{Context, Waker}};
/// # assert!(pin!(task).poll(&mut Context::from_waker(Waker::noop())).is_pending());
/// assert_eq!(published, [(Instant::from_micros(1), 1), (Instant::from_micros(3), 3)]);
/// assert_eq!(health.to_string(), "samples: 2, errors: 1, last error: the bus refused or garbled a transfer");
/// ```
///
/// # Cancellation
/// Dropping the future drops the driver's call or the pause. No sample is published then, and a new
/// task starts with the first pause of `backoff`.
pub async fn run_sensor<M, E: SensorError>(
    mut next: impl AsyncFnMut() -> Result<Sample<M>, E>,
    mut publish: impl FnMut(Instant, &M),
    mut clock: impl Timebase,
    backoff: Backoff,
    health: &SensorHealth,
) -> Infallible {
    let mut failures = 0u32;
    loop {
        match next().await {
            Ok(sample) => {
                failures = 0;
                publish(sample.at, &sample.data);
                SensorHealth::count(&health.samples);
            }
            Err(error) => {
                health.note(error.kind());
                failures = failures.saturating_add(1);
                let now = clock.now();
                sleep_until(&mut clock, now + with_jitter(now, backoff.after(failures))).await;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;
    use std::vec::Vec;

    #[test]
    fn drivers_that_fail_a_little_apart_do_not_stay_a_little_apart() {
        let pause = Duration::from_millis(80);
        let pauses: Vec<_> =
            (0..1_000).map(|n| with_jitter(Instant::from_micros(1_000_000 + 97 * n), pause).as_micros()).collect();
        let apart = pauses.windows(2).filter(|pair| pair[0].abs_diff(pair[1]) > 5_000).count();
        assert!(apart > 400, "{apart} are further apart than a transfer takes");
        assert!(pauses.iter().all(|pause| (60_000..=80_000).contains(pause)));
        for short in (0..4).map(Duration::from_micros) {
            assert_eq!(with_jitter(Instant::from_micros(12_345), short), short, "too short for a jitter");
        }
    }

    #[test]
    fn pauses_stay_then_grow_then_stay() {
        let pauses = |backoff: Backoff, errors: [u32; 7]| errors.map(|n| backoff.after(n).as_micros());
        assert_eq!(
            pauses(Backoff::SHARED, [1, 2, 3, 4, 5, 6, u32::MAX]),
            [5_000, 10_000, 20_000, 40_000, 80_000, 80_000, 80_000]
        );
        assert_eq!(
            pauses(Backoff::CRITICAL, [1, 2, 16, 17, 20, 21, u32::MAX]),
            [2_500, 2_500, 2_500, 5_000, 40_000, 40_000, 40_000]
        );
    }

    #[test]
    fn every_kind_of_error_is_remembered() {
        let health = SensorHealth::new();
        assert_eq!((health.last_error(), health.to_string().as_str()), (None, "samples: 0, errors: 0"));
        for (place, kind) in KINDS.into_iter().enumerate() {
            health.note(kind);
            assert_eq!((health.last_error(), health.errors()), (Some(kind), place as u32 + 1));
            assert!(health.to_string().ends_with(&kind.to_string()));
        }
    }
}
