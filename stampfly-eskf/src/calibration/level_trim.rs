//! Level trim: how the inertial sensor is tilted in the airframe.
//!
//! A sensor that is soldered two degrees askew makes a vehicle drift two degrees. Standing on a level floor, the airframe
//! is level by definition, so the tilt that gravity shows then is the sensor's.
//!
//! Use it once a vehicle, on a floor you trust: its slope goes into the trim, and so does a bias of the accelerometer that
//! [`SixPosition`](super::SixPosition) has not removed (0.17 m/s² is one degree). Not for a sensor mounted the wrong way
//! round, which is a matter of the driver, and it says nothing about heading. The attitude of a still vehicle is
//! [`attitude_from_specific_force`](crate::attitude_from_specific_force).

use super::{NotStill, StillAverage, StillnessConfig};
use crate::filter::state::{rotate, rotate_back, rotation_matrix};
use crate::level::attitude_from_specific_force;
use stampfly_types::messages::ImuData;
use stampfly_types::{GRAVITY, Instant, Vec3, math};

/// Why there is no trim.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LevelTrimRefusal {
    /// It moves.
    Moving(NotStill),
    /// It is tilted by more than a mounting ever is.
    Tilted {
        /// By how much, rad.
        tilt: f32,
    },
}

/// How good a trim is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelTrimQuality {
    /// Expected standard error of roll and pitch from the noise, rad.
    pub noise: f32,
    /// Mean specific force above gravity, m/s². A vertical error of this size hints at a horizontal one.
    pub force_error: f32,
    /// Samples averaged.
    pub samples: u32,
}

/// The tilt of the sensor against the airframe.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Trim {
    /// The sensor is rolled by this against the airframe, rad.
    pub roll: f32,
    /// The sensor is pitched by this against the airframe, rad.
    pub pitch: f32,
    /// Turns sensor into airframe.
    rotation: [[f32; 3]; 3],
}

impl Default for Trim {
    /// A sensor that sits straight.
    fn default() -> Self {
        Self { roll: 0.0, pitch: 0.0, rotation: rotation_matrix([1.0, 0.0, 0.0, 0.0]) }
    }
}

impl Trim {
    /// Of a sensor that is rolled and pitched so, rad.
    pub(super) fn of(roll: f32, pitch: f32) -> Self {
        let ((sr, cr), (sp, cp)) = (math::sin_cos(0.5 * roll), math::sin_cos(0.5 * pitch));
        Self { roll, pitch, rotation: rotation_matrix([cr * cp, sr * cp, cr * sp, -sr * sp]) }
    }

    /// The trim that makes this specific force point straight up. Straight for a force of zero.
    pub(super) fn levelling(force: &Vec3) -> Self {
        Self {
            roll: math::atan2(-force.y, -force.z),
            pitch: math::atan2(force.x, math::sqrt(force.y * force.y + force.z * force.z)),
            rotation: rotation_matrix(attitude_from_specific_force(force)),
        }
    }

    /// A vector in the axes of the airframe, body FRD: specific force, angular rate, and field if that sensor sits on the
    /// same board.
    #[inline]
    #[must_use]
    pub fn correct(&self, measured: Vec3) -> Vec3 {
        rotate(&self.rotation, &measured)
    }

    /// A vector in the axes of the sensor, of one in the axes of the airframe.
    #[inline]
    #[must_use]
    pub fn undo(&self, corrected: Vec3) -> Vec3 {
        rotate_back(&self.rotation, &corrected)
    }
}

/// Finds the trim of a vehicle that stands on a level floor.
///
/// ```
/// use stampfly_eskf::calibration::LevelTrim;
/// use stampfly_types::{GRAVITY, Instant, Vec3, math, messages::ImuData};
/// let (sin, cos) = math::sin_cos(0.02);
/// let felt = ImuData { accel: Vec3::new(0.0, -sin, -cos) * GRAVITY, ..Default::default() };
/// let mut level = LevelTrim::default();
/// let (trim, quality) = (0..).find_map(|k| level.step(Instant::from_micros(2_500 * k), &felt).unwrap()).unwrap();
/// assert!((trim.roll - 0.02).abs() < 1e-5 && trim.pitch.abs() < 1e-5);
/// assert!(trim.correct(felt.accel).horizontal().norm() < 1e-4 && quality.force_error.abs() < 1e-3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LevelTrim {
    average: StillAverage,
    tilt_max: f32,
}

impl Default for LevelTrim {
    fn default() -> Self {
        Self::new(StillnessConfig::default(), Self::TILT_MAX)
    }
}

impl LevelTrim {
    /// Five degrees: more is a vehicle that does not stand level, not a crooked sensor.
    pub const TILT_MAX: f32 = 0.0873;

    /// Nothing collected yet; accepts a tilt of up to `tilt_max`, rad.
    #[must_use]
    pub fn new(still: StillnessConfig, tilt_max: f32) -> Self {
        Self { average: StillAverage::new(still), tilt_max }
    }

    /// Share of the still stretch that has been collected, 0 to 1.
    #[must_use]
    pub fn progress(&self) -> f32 {
        self.average.progress()
    }

    /// Takes an inertial sample. Gives the trim with the last sample of a still stretch; the next stretch gives it anew.
    ///
    /// # Errors
    /// Why the sample, or with its last sample the stretch, does not count.
    pub fn step(&mut self, now: Instant, imu: &ImuData) -> Result<Option<(Trim, LevelTrimQuality)>, LevelTrimRefusal> {
        let Some(mean) = self.average.step(now, imu).map_err(LevelTrimRefusal::Moving)? else { return Ok(None) };
        let tilt = math::atan2(mean.accel.horizontal().norm(), -mean.accel.z);
        if tilt > self.tilt_max {
            return Err(LevelTrimRefusal::Tilted { tilt });
        }
        let quality = LevelTrimQuality {
            noise: mean.accel_noise.horizontal().amax() / (GRAVITY * math::sqrt(mean.samples as f32)),
            force_error: mean.accel.norm() - GRAVITY,
            samples: mean.samples,
        };
        Ok(Some((Trim::levelling(&mean.accel), quality)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn on_a_slope_or_on_its_back_there_is_no_trim() {
        for (felt, tilt) in [(Vec3::new(1.7, 0.0, -9.66), 0.174), (Vec3::new(0.0, 0.0, 9.81), math::PI)] {
            let mut level = LevelTrim::default();
            let imu = ImuData { accel: felt, ..Default::default() };
            let refusal = (0..2_000).find_map(|k| level.step(Instant::from_micros(2_500 * k), &imu).err()).unwrap();
            assert!(
                matches!(refusal, LevelTrimRefusal::Tilted { tilt: found } if (found - tilt).abs() < 1e-3),
                "{refusal:?}"
            );
        }
    }

    #[test]
    fn a_straight_sensor_is_left_alone() {
        let vector = Vec3::new(1.0, -2.0, 3.0);
        assert_eq!(Trim::default().correct(vector), vector);
    }
}
