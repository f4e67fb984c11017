//! Wind: a constant mean plus gusts.
//!
//! Gusts are a first-order Gauss-Markov process per world axis, the simplest approximation of
//! Dryden's spectra: correct in intensity and correlation time, inexact in the shape of the
//! spectrum, to which a vehicle of this size is insensitive.

use crate::noise::Noise;
use crate::normals::Normals;
use nalgebra::Vector3;
use stampfly_types::Vec3;

/// Dependence of the wind on the height above the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindProfile {
    /// Indoors: half of the wind remains at 0.3 m, a tenth at 3 cm.
    Room,
    /// Logarithmic law over open ground (WMO, Guide to Instruments and Methods of Observation, part
    /// I, 5), equal to the configured wind at 10 m. For heights up to about 100 m.
    Open {
        /// Roughness length, m: 0.005 over snow or tarmac, 0.03 over short grass, 0.1 over low
        /// crops (Davenport's classification).
        roughness: f64,
    },
}

impl WindProfile {
    /// Share of the wind at `height`, m.
    fn share(self, height: f64) -> f64 {
        let height = height.max(0.0);
        match self {
            Self::Room => height / (height + BOUNDARY_LAYER),
            Self::Open { roughness } if height > roughness => {
                libm::log(height / roughness) / libm::log(10.0 / roughness)
            }
            Self::Open { .. } => 0.0,
        }
    }
}

/// Mean wind and gusts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindConfig {
    /// Mean wind at full strength of the [profile](Self::profile), world NED, m/s; the direction
    /// the air moves to.
    pub mean: Vec3,
    /// Standard deviation of the gusts along north and east, m/s; half of it along down.
    pub gust: f32,
    /// Correlation time of the gusts, s.
    pub correlation: f32,
    /// Profile applied to mean wind and gusts.
    pub profile: WindProfile,
}

impl Default for WindConfig {
    /// An occupied room: no mean wind, gusts of 0.5 m/s with a correlation time of 1.5 s.
    fn default() -> Self {
        Self { mean: Vec3::zeros(), gust: 0.5, correlation: 1.5, profile: WindProfile::Room }
    }
}

impl WindConfig {
    /// Still air.
    pub const CALM: Self =
        Self { mean: Vec3::new(0.0, 0.0, 0.0), gust: 0.0, correlation: 1.5, profile: WindProfile::Room };

    /// A calm summer day over short grass: gusts of 0.5 m/s with a correlation time of 5 s, which
    /// is 75 m at 15 m/s (MIL-F-8785C has 50 to 200 m near the ground).
    pub const MEADOW: Self = Self {
        mean: Vec3::new(0.0, 0.0, 0.0),
        gust: 0.5,
        correlation: 5.0,
        profile: WindProfile::Open { roughness: 0.03 },
    };
}

/// Physics steps per step of the gusts, which change slowly.
const DECIMATION: u32 = 4;

/// Height at which half of the wind remains, m.
const BOUNDARY_LAYER: f64 = 0.3;

/// The air at the vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    noise: Normals,
    mean: Vector3<f64>,
    gust: Vector3<f64>,
    keep: f64,
    drive: Vector3<f64>,
    countdown: u32,
    profile: WindProfile,
}

impl Wind {
    /// Wind with this configuration; `dt` is the length of one physics step, s.
    pub(crate) fn new(config: &WindConfig, dt: f64, mut noise: Noise) -> Self {
        let deviation = f64::from(config.gust) * Vector3::new(1.0, 1.0, 0.5);
        // Exact discretisation of the first-order process at the decimated rate.
        let keep = libm::exp(-dt * f64::from(DECIMATION) / f64::from(config.correlation).max(1e-3));
        // Drawn from the stationary distribution, so that there is no transient at the start.
        let gust = deviation.component_mul(&noise.normal3());
        // This drive keeps the variance stationary.
        let drive = deviation * (1.0 - keep * keep).sqrt();
        Self {
            noise: noise.into(),
            mean: Vector3::from(config.mean).cast(),
            gust,
            keep,
            drive,
            countdown: DECIMATION,
            profile: config.profile,
        }
    }

    pub(crate) fn step(&mut self) {
        self.countdown -= 1;
        if self.countdown == 0 {
            self.countdown = DECIMATION;
            // Calm air draws no random numbers.
            if self.drive.x > 0.0 {
                self.gust = self.gust * self.keep + self.drive.component_mul(&Vector3::from(self.noise.next()));
            }
        }
    }

    /// Velocity of the air at `height`, m, above the ground, world NED, m/s.
    #[must_use]
    pub fn velocity(&self, height: f64) -> Vector3<f64> {
        (self.mean + self.gust) * self.profile.share(height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gusts_have_the_strength_and_the_duration_asked_for() {
        let config = WindConfig { gust: 0.5, correlation: 0.2, ..Default::default() };
        let mut wind = Wind::new(&config, 0.001, Noise::new(5, 0));
        let (mut sum, mut lagged, n) = (0.0, 0.0, 400_000);
        let mut past = std::collections::VecDeque::from(vec![0.0; 200]);
        for _ in 0..n {
            wind.step();
            let x = wind.velocity(1e9).x;
            sum += x * x / f64::from(n);
            lagged += x * past.pop_front().expect("filled") / f64::from(n);
            past.push_back(x);
        }
        assert!((sum.sqrt() - 0.5).abs() < 0.05, "{}", sum.sqrt());
        assert!((lagged / sum - (-1f64).exp()).abs() < 0.08, "{}", lagged / sum);
    }

    #[test]
    fn over_grass_the_wind_grows_with_the_logarithm_of_the_height() {
        let config = WindConfig { mean: Vec3::x() * 5.0, gust: 0.0, ..WindConfig::MEADOW };
        let wind = Wind::new(&config, 0.001, Noise::new(5, 0));
        let speeds = [0.0, 0.03, 1.0, 10.0, 30.0].map(|height| wind.velocity(height).x);
        // 5 m/s · ln(h / 0.03 m) / ln(10 m / 0.03 m).
        for (speed, expected) in speeds.into_iter().zip([0.0, 0.0, 3.0182, 5.0, 5.9456]) {
            assert!((speed - expected).abs() < 1e-4, "{speeds:?}");
        }
    }

    #[test]
    fn calm_is_calm() {
        let mut wind = Wind::new(&WindConfig::CALM, 0.001, Noise::new(5, 0));
        for _ in 0..100 {
            wind.step();
        }
        assert_eq!(wind.velocity(1.0), Vector3::zeros());
    }
}
