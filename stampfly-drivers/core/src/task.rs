//! The task of a sensor: from its driver to a topic, with pauses after errors.
//!
//! [`run_sensor`] is a plain `async` function: firmware spawns one a sensor on its executor, a test polls it on virtual
//! time. It knows neither bus nor vehicle; samples go to a closure. Not needed where a program asks a driver itself.

use crate::time::sleep_until;
use crate::{Sample, SensorError, SensorErrorKind, Timebase};
use core::convert::Infallible;
use core::fmt;
use core::sync::atomic::{AtomicU32, Ordering};
use stampfly_types::{Duration, Instant};

/// How a sensor does: samples, errors, and the last error. Written by one [`run_sensor`], read by any context.
#[derive(Debug, Default)]
pub struct SensorHealth {
    samples: AtomicU32,
    errors: AtomicU32,
    /// Place in [`KINDS`] plus one, or zero.
    last: AtomicU32,
}

/// Every kind of error, so that one fits into a word.
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

    /// Samples published since power-on, modulo 2³².
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.samples.load(Ordering::Relaxed)
    }

    /// Errors since power-on, modulo 2³².
    #[must_use]
    pub fn errors(&self) -> u32 {
        self.errors.load(Ordering::Relaxed)
    }

    /// The newest error, whether or not the driver has recovered.
    #[must_use]
    pub fn last_error(&self) -> Option<SensorErrorKind> {
        let place = self.last.load(Ordering::Relaxed).checked_sub(1)?;
        KINDS.get(place as usize).copied()
    }

    fn count(counter: &AtomicU32) {
        // One task writes; a load and a store are enough on cores without atomic addition.
        counter.store(counter.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }

    fn note(&self, kind: SensorErrorKind) {
        Self::count(&self.errors);
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

/// The pause grows to `pause` times two to the power of this.
const MAX_DOUBLINGS: u32 = 4;

/// Exponential backoff: how long a driver waits after an error before its next attempt.
///
/// After `constant_for` errors in a row, each pause is twice as long as the one before, up to sixteen times `pause`.
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
    /// The first pause.
    pub pause: Duration,
    /// How many pauses are of that length.
    pub constant_for: u32,
}

impl Backoff {
    /// For a chip that shares its bus with others that are as important: it leaves them the bus at once.
    pub const SHARED: Self = Self { pause: Duration::from_millis(5), constant_for: 1 };
    /// For the sensor that the motors wait for, on a bus of its own: tried again at its own period for 40 ms, longer than
    /// motors turn without it.
    pub const CRITICAL: Self = Self { pause: Duration::from_micros(2_500), constant_for: 16 };

    /// The pause after so many errors in a row.
    #[must_use]
    pub fn after(self, errors: u32) -> Duration {
        self.pause * (1 << MAX_DOUBLINGS.min(errors.saturating_sub(self.constant_for)))
    }
}

/// The pause, less up to a quarter.
///
/// Two drivers that fail together, one because the other's chip holds the bus, would otherwise try again together each
/// time, and the healthy one would never get a sample. The clock is the source of the jitter: it needs no seed, and a
/// simulated flight repeats. The factor is 2⁶⁴ divided by the golden ratio, as in Fibonacci hashing.
fn with_jitter(now: Instant, pause: Duration) -> Duration {
    let random = now.as_micros().wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
    pause - Duration::from_micros(random.checked_rem((pause / 4).as_micros()).unwrap_or(0))
}

/// Publishes a driver's samples, as long as it is polled. After an error it waits as `backoff` says, so that a chip that
/// does not answer costs its neighbours on the bus next to nothing. Each pause is up to a quarter shorter, at random, so
/// that two drivers do not collide again and again.
///
/// Silence is not reported: a reader of the topic sees the age of the newest sample.
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
/// Dropping the future drops the driver's call or the pause. Nothing is published then; a new task starts afresh.
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
