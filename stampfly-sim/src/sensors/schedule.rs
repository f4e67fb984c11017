//! Conversion instants of a chip by its own clock, which differs from the processor's.

use crate::noise::Noise;
use stampfly_types::Instant;

/// Conversions at a fixed rate, numbered from zero.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Schedule {
    first: f64,
    period: f64,
    next: u64,
}

impl Schedule {
    /// Nominally `rate` hertz with an error of up to the share `tolerance`, starting at random
    /// within the first period.
    pub(crate) fn new(start: Instant, rate: f64, tolerance: f64, noise: &mut Noise) -> Self {
        let period = 1e6 / rate * (1.0 + noise.within(tolerance));
        Self { first: start.as_micros() as f64 + period * noise.unit(), period, next: 0 }
    }

    /// Length of one period of the chip's clock, in true microseconds.
    pub(crate) fn period(&self) -> f64 {
        self.period
    }

    /// The instant of conversion `number`.
    pub(crate) fn instant(&self, number: u64) -> Instant {
        Instant::from_micros((self.first + number as f64 * self.period) as u64)
    }

    /// Number of periods between conversion zero and the end of this microsecond; at the instant of
    /// a conversion at least its number.
    pub(crate) fn phase(&self, at: Instant) -> f64 {
        (at.as_micros() as f64 + 1.0 - self.first) / self.period
    }

    /// The next conversion to report: the one after the last reported, unless newer ones have
    /// overwritten it in the chip's registers by `now`. A conversion can be read `latency`
    /// microseconds after its instant.
    pub(crate) fn upcoming(&self, now: Instant, latency: f64) -> u64 {
        // Number of the newest conversion that can be read now.
        let ready = (now.as_micros() as f64 - latency - self.first) / self.period;
        self.next.max(ready.max(0.0) as u64)
    }

    /// Marks a conversion as reported.
    pub(crate) fn reported(&mut self, number: u64) {
        self.next = number + 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::Duration;

    #[test]
    fn nothing_is_reported_twice_and_a_late_reader_gets_the_newest() {
        let mut schedule = Schedule::new(Instant::from_secs(1), 100.0, 0.02, &mut Noise::new(1, 1));
        assert!((schedule.period() / 10_000.0 - 1.0).abs() <= 0.02);
        let mut now = Instant::from_secs(1);
        for expected in 0..5 {
            let number = schedule.upcoming(now, 500.0);
            assert_eq!(number, expected);
            now = schedule.instant(number) + Duration::from_micros(500);
            schedule.reported(number);
        }
        now = schedule.instant(20) + Duration::from_micros(600);
        assert_eq!(schedule.upcoming(now, 500.0), 20, "it is ready and the newest");
        now = schedule.instant(20) + Duration::from_micros(400);
        assert_eq!(schedule.upcoming(now, 500.0), 19, "the next one is not ready yet");
    }
}
