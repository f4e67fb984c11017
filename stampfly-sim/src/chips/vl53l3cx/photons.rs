//! Photon counts of a VL53L3CX in a histogram: propagation, pulse shape and shot noise.
//!
//! The laser's pulse is a rectangle of the configured length, blurred by the detectors' jitter, and
//! may fall anywhere between bins. It returns with the inverse square of the distance, in addition
//! to ambient light, and the count of each bin is Poisson distributed. The part reduces the signal
//! by using fewer detectors when more than the wanted rate returns. A pulse delayed by more than a
//! laser period arrives in a later one.
//!
//! Assumptions of ST's algorithms that hold here: bins of a PLL period; the phase of zero distance
//! as found by the part's reference pulse; ambient bins as long as the others; distances too long
//! by 2048/1987, and the factory offset before that (VL53LX bare driver: `VL53LX_range_maths`,
//! `VL53LX_hist_calc_zero_distance_phase`). *Unverified*: strength and shape of the pulse, jitter,
//! ambient light, positions of the reference pulse. The light budget is in `sensors/light.rs`. Not
//! modelled: dead time of the detectors.

use crate::noise::Noise;
use crate::sensors::light::{Echo, Echoes};

/// Number of bins of a histogram.
pub(super) const BINS: usize = 24;
/// Number of detectors without those behind smaller apertures.
const DETECTORS: f64 = 200.0;
/// Standard deviation of the blur, bins: 0.3 ns.
const JITTER: f64 = 0.23;
/// Speed of light in air, m/µs.
const LIGHT: f64 = 299.704;
/// Factor by which distances are reported too long.
const STRETCH: f64 = 2048.0 / 1987.0;
/// Laser periods counted in a macro period.
const COUNTED_PERIODS: f64 = 2048.0;
/// Mean above which counts are drawn from a normal distribution.
const MANY: f64 = 50.0;

/// Parameters of one histogram.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shot {
    /// Echoes of the targets.
    pub echoes: Echoes,
    /// Ambient light, 10⁶ photons/s over all detectors.
    pub ambient: f64,
    /// Distance by which the specimen measures too short, m.
    pub short: f64,
    /// Length of a bin, µs.
    pub bin: f64,
    /// Laser period, bins.
    pub period: usize,
    /// Macro periods.
    pub macro_periods: f64,
    /// Length of the pulse, bins.
    pub width: f64,
    /// Largest wanted rate of photons, 10⁶/s.
    pub wanted: f64,
    /// The four bins counted by each of the six groups; 7 is ambient light.
    pub groups: [u8; 6],
}

/// Optics of one specimen.
#[derive(Debug)]
pub(super) struct Photons {
    noise: Noise,
    /// Phase of zero distance, bins after the configured start of the laser.
    zero: f64,
    /// Delay of the laser's start for the reference pulse, bins.
    later: u8,
}

impl Photons {
    pub(super) fn new(mut noise: Noise) -> Self {
        let zero = 3.5 + noise.within(1.0);
        let later = (noise.unit() * 3.0) as u8;
        Self { noise, zero, later }
    }

    /// The reference pulse: its phase, 1/2048 bin, and the start of the laser for it.
    pub(super) fn reference(&mut self, laser_start: u8) -> (u16, u8) {
        let phase = self.zero - f64::from(self.later) + 0.002 * self.noise.normal();
        ((phase * 2048.0).round() as u16, laser_start + self.later)
    }

    /// A distance measured by the part itself, so near that the noise is 1 mm.
    pub(super) fn near(&mut self, metres: f64) -> f64 {
        metres + 0.001 * self.noise.normal()
    }

    /// Counts of the bins, and number of detectors in use.
    pub(super) fn count(&mut self, shot: &Shot) -> ([u32; BINS], f64) {
        let strength: f64 = shot.echoes.iter().map(Echo::rate).sum();
        // Automatic reduction of the number of detectors to the wanted rate.
        let share = (shot.wanted / (strength + shot.ambient)).min(1.0);
        let exposure = shot.macro_periods * COUNTED_PERIODS * shot.bin * share;
        let period = shot.period as f64;
        let middle = |distance: f64| self.zero + (distance * STRETCH - shot.short) / (0.5 * LIGHT * shot.bin);
        let arriving: Vec<_> = shot
            .echoes
            .iter()
            .filter(|echo| echo.brightness > 0.0)
            .map(|echo| (middle(echo.distance), echo.rate()))
            .collect();
        let mut bins = [0; BINS];
        for (place, bin) in bins.iter_mut().enumerate() {
            let group = shot.groups[place / 4];
            let ambient = shot.ambient * exposure;
            let mean = if group & 7 == 7 {
                ambient
            } else {
                let from = f64::from(group) * 4.0 + (place % 4) as f64;
                arriving.iter().fold(ambient, |mean, (middle, rate)| {
                    // Pulses emitted in earlier laser periods arrive in this one as well.
                    let rounds = (-1..=8).map(|round| from + f64::from(round) * period - middle);
                    let arrived: f64 =
                        rounds.map(|from| fraction(from + 1.0, shot.width) - fraction(from, shot.width)).sum();
                    mean + rate * exposure * shot.width * arrived
                })
            };
            *bin = self.poisson(mean);
        }
        (bins, DETECTORS * share)
    }

    fn poisson(&mut self, mean: f64) -> u32 {
        // Knuth's multiplication method below; its run time grows with the mean.
        if mean > MANY {
            return (mean + mean.sqrt() * self.noise.normal()).round().max(0.0) as u32;
        }
        let (limit, mut product, mut count) = (libm::exp(-mean), self.noise.unit(), 0);
        while product > limit {
            product *= self.noise.unit();
            count += 1;
        }
        count
    }
}

/// Share of a pulse of this width, centred at zero, that has arrived by `by`: integral of a
/// rectangle with blurred edges.
fn fraction(by: f64, width: f64) -> f64 {
    let edge = |at: f64| {
        let scaled = at / JITTER;
        let normal = 0.5 * libm::erfc(-scaled / core::f64::consts::SQRT_2);
        let density = libm::exp(-0.5 * scaled * scaled) / libm::sqrt(core::f64::consts::TAU);
        at * normal + JITTER * density
    };
    (edge(by + 0.5 * width) - edge(by - 0.5 * width)) / width
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(distance: Option<f64>) -> Echoes {
        let echo = distance.map(|distance| Echo { distance, brightness: 8.0 });
        [echo.unwrap_or(Echo::NONE), Echo::NONE, Echo::NONE]
    }

    const SHOT: Shot = Shot {
        echoes: [Echo { distance: 1.0, brightness: 8.0 }, Echo::NONE, Echo::NONE],
        ambient: 0.5,
        short: 0.0,
        bin: 1.0 / (64.0 * 11.8),
        period: 24,
        macro_periods: 72.0,
        width: 2.5,
        wanted: 40.0,
        groups: [0, 1, 2, 3, 4, 5],
    };

    #[test]
    fn a_pulse_arrives_once_half_of_it_by_its_middle() {
        assert!(
            fraction(-3.0, 2.5) < 1e-6 && (fraction(0.0, 2.5) - 0.5).abs() < 1e-12 && fraction(3.0, 2.5) > 1.0 - 1e-6
        );
    }

    #[test]
    fn light_weakens_with_the_square_of_the_distance_and_scatters_as_its_square_root() {
        let mut photons = Photons::new(Noise::new(1, 0));
        let mut sums = |distance| -> Vec<f64> {
            let shot = Shot { echoes: at(distance), ..SHOT };
            (0..2_000).map(|_| photons.count(&shot).0.iter().map(|bin| f64::from(*bin)).sum()).collect()
        };
        let mean = |sums: &[f64]| sums.iter().sum::<f64>() / sums.len() as f64;
        let [dark, one, two] = [None, Some(1.0), Some(2.0)].map(&mut sums);
        let ratio = (mean(&one) - mean(&dark)) / (mean(&two) - mean(&dark));
        assert!((ratio - 4.0).abs() < 0.05, "{ratio}");
        for sums in [dark, one, two] {
            let variance = sums.iter().map(|sum| (sum - mean(&sums)).powi(2)).sum::<f64>() / sums.len() as f64;
            assert!((variance / mean(&sums) - 1.0).abs() < 0.12, "{variance} of {}", mean(&sums));
        }
    }

    #[test]
    fn what_is_near_is_seen_by_fewer_detectors() {
        let mut photons = Photons::new(Noise::new(1, 0));
        let near = photons.count(&Shot { echoes: at(Some(0.1)), ..SHOT }).1;
        let far = photons.count(&SHOT).1;
        assert!((near - 200.0 * 40.0 / 800.5).abs() < 0.01 && far == 200.0, "{near} {far}");
    }
}
