//! From a driver to a topic, for as long as the vehicle is on.

use core::convert::Infallible;
use core::sync::atomic::{AtomicU32, Ordering};
use stampfly_drivers::time::sleep_until;
use stampfly_drivers::{Sample, SensorError, SensorErrorKind, Timebase};
use stampfly_types::{Duration, Instant};

/// How a driver fares. Written by its [`pump`], read by whoever reports: a console, a log.
#[derive(Debug, Default)]
pub struct Health {
    samples: AtomicU32,
    errors: AtomicU32,
    /// Index in [`KINDS`] plus one, or zero.
    last: AtomicU32,
}

/// Every kind of error there is, so that one fits into a word.
const KINDS: [SensorErrorKind; 8] = [
    SensorErrorKind::Bus,
    SensorErrorKind::Timeout,
    SensorErrorKind::Identification,
    SensorErrorKind::Configuration,
    SensorErrorKind::SelfTest,
    SensorErrorKind::Data,
    SensorErrorKind::Restarted,
    SensorErrorKind::Other,
];

impl Health {
    /// A driver that has not been asked yet.
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
        let index = self.last.load(Ordering::Relaxed).checked_sub(1)?;
        KINDS.get(index as usize).copied()
    }

    fn count(counter: &AtomicU32) {
        // One pump writes; a load and a store are enough where there is no atomic addition.
        counter.store(counter.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }

    fn note(&self, kind: SensorErrorKind) {
        Self::count(&self.errors);
        let index = KINDS.iter().position(|known| *known == kind).unwrap_or(KINDS.len() - 1);
        self.last.store(index as u32 + 1, Ordering::Relaxed);
    }
}

/// A pause of so long, less up to a quarter.
///
/// Two drivers that fail together, one because the other's chip holds the bus, would otherwise ask together for ever,
/// and the healthy one would starve. The clock scatters them: no seed is needed, and the same flight pauses the same.
fn scattered(now: Instant, pause: Duration) -> Duration {
    let scatter = now.as_micros().wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
    pause - Duration::from_micros(scatter.checked_rem(pause.as_micros() / 4).unwrap_or(0))
}

/// After so many doublings the pause before the next attempt grows no more.
const LONGEST_RETRY: u32 = 4;

/// How long a driver that failed is left alone.
///
/// A pause follows every error. After `even` errors in a row each is twice as long as the one before, up to sixteen
/// times `pause`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Retry {
    /// The first pause.
    pub pause: Duration,
    /// How many pauses are of that length.
    pub even: u32,
}

impl Retry {
    /// For a chip that shares its bus with others that are as important: it makes room at once.
    pub const PATIENT: Self = Self { pause: Duration::from_millis(5), even: 1 };
    /// For the sensor that the motors wait for, on a bus that it leads: asked again in its own rhythm for 40 ms, longer
    /// than motors turn without it.
    pub const PROMPT: Self = Self { pause: Duration::from_micros(2_500), even: 16 };

    /// The pause after so many errors in a row.
    fn after(self, errors: u32) -> Duration {
        self.pause * (1 << LONGEST_RETRY.min(errors.saturating_sub(self.even)))
    }
}

/// Publishes a driver's samples for ever. After an error the driver is left alone for the pause that `retry` says, which
/// grows, so that a dead chip costs its neighbours on the bus next to nothing. Each pause is up to a quarter shorter, so
/// that two drivers do not get into each other's way for ever.
///
/// Silence is not this task's business: whoever reads the topic sees the age of the newest sample.
///
/// ```
/// use stampfly_board::tasks::{Health, Retry, pump};
/// use stampfly_drivers::blocking::{BlockingClock, block_on};
/// use stampfly_drivers::{Sample, SensorErrorKind};
/// use stampfly_types::Instant;
/// # #[derive(Clone)] struct Delay;
/// # impl embedded_hal::delay::DelayNs for Delay { fn delay_ns(&mut self, _: u32) {} }
/// # let clock = BlockingClock::new(Delay, || Instant::ZERO);
/// let (health, mut calls, mut published) = (Health::new(), 0, Vec::new());
/// let endless = pump(
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
///     Retry::PATIENT,
///     &health,
/// );
/// # use core::{future::Future, pin::pin, task::{Context, Waker}};
/// # assert!(pin!(endless).poll(&mut Context::from_waker(Waker::noop())).is_pending());
/// assert_eq!(published, [(Instant::from_micros(1), 1), (Instant::from_micros(3), 3)]);
/// assert_eq!((health.samples(), health.errors(), health.last_error()), (2, 1, Some(SensorErrorKind::Bus)));
/// ```
pub async fn pump<M, E: SensorError>(
    mut next: impl AsyncFnMut() -> Result<Sample<M>, E>,
    mut publish: impl FnMut(Instant, &M),
    mut clock: impl Timebase,
    retry: Retry,
    health: &Health,
) -> Infallible {
    let mut failures = 0u32;
    loop {
        match next().await {
            Ok(sample) => {
                failures = 0;
                publish(sample.at, &sample.data);
                Health::count(&health.samples);
            }
            Err(error) => {
                health.note(error.kind());
                let now = clock.now();
                failures = failures.saturating_add(1);
                sleep_until(&mut clock, now + scattered(now, retry.after(failures))).await;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Retry, scattered};
    use stampfly_types::{Duration, Instant};
    use std::vec::Vec;

    #[test]
    fn drivers_that_fail_a_little_apart_do_not_stay_a_little_apart() {
        let pauses = (0..1_000u64)
            .map(|n| scattered(Instant::from_micros(1_000_000 + 97 * n), Duration::from_micros(80_000)).as_micros());
        let apart: Vec<i64> = pauses.clone().zip(pauses.clone().skip(1)).map(|(a, b)| a as i64 - b as i64).collect();
        assert!(
            apart.iter().filter(|apart| apart.abs() > 5_000).count() > 400,
            "most are further than a transfer apart"
        );
        assert!(pauses.clone().all(|pause| (60_000..=80_000).contains(&pause)));
        assert!(
            (0..4).map(Duration::from_micros).all(|short| scattered(Instant::from_micros(12_345), short) == short),
            "nothing to scatter"
        );
    }

    #[test]
    fn pauses_grow_after_the_even_ones_and_not_for_ever() {
        let pauses =
            |retry: Retry, errors: &[u32]| -> Vec<u64> { errors.iter().map(|n| retry.after(*n).as_micros()).collect() };
        assert_eq!(
            pauses(Retry::PATIENT, &[1, 2, 3, 4, 5, 6, u32::MAX]),
            [5_000, 10_000, 20_000, 40_000, 80_000, 80_000, 80_000]
        );
        assert_eq!(
            pauses(Retry::PROMPT, &[1, 2, 16, 17, 20, 21, u32::MAX]),
            [2_500, 2_500, 2_500, 5_000, 40_000, 40_000, 40_000]
        );
    }
}
