//! Level trim: the tilt of the inertial sensor in the airframe.
//!
//! A sensor soldered two degrees askew makes a vehicle drift with two degrees of tilt. On a level
//! floor the airframe is level by definition, so the measured tilt is that of the sensor.
//!
//! Use it once per vehicle, on a floor known to be level: its slope enters the trim, and so does a
//! bias of the accelerometer that [`SixPosition`](super::SixPosition) has not removed (0.17 m/s² is
//! one degree). Not for a sensor mounted in another orientation, which the driver handles. Heading
//! is not affected. For the attitude of a still vehicle use
//! [`attitude_from_specific_force`](crate::attitude_from_specific_force).

use super::{NotStill, StillAverage, StillnessConfig};
use crate::filter::state::{rotate, rotate_back, rotation_matrix};
use crate::level::attitude_from_specific_force;
use stampfly_types::messages::ImuData;
use stampfly_types::{GRAVITY, Instant, Vec3, math};

/// Reason for which there is no trim.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LevelTrimRefusal {
    /// The vehicle moves.
    Moving(NotStill),
    /// The tilt is larger than any mounting error.
    Tilted {
        /// Tilt, rad.
        tilt: f32,
    },
}

/// Quality of a trim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelTrimQuality {
    /// Standard error of roll and pitch from the noise, rad.
    pub noise: f32,
    /// Length of the mean specific force minus gravity, m/s². An accelerometer error of this size
    /// may also be horizontal.
    pub force_error: f32,
    /// Samples averaged.
    pub samples: u32,
}

/// Tilt of the sensor relative to the airframe.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Trim {
    /// Roll of the sensor relative to the airframe, rad.
    pub roll: f32,
    /// Pitch of the sensor relative to the airframe, rad.
    pub pitch: f32,
    /// Sensor → airframe.
    rotation: [[f32; 3]; 3],
}

impl Default for Trim {
    /// A sensor without tilt.
    fn default() -> Self {
        Self { roll: 0.0, pitch: 0.0, rotation: rotation_matrix([1.0, 0.0, 0.0, 0.0]) }
    }
}

impl Trim {
    /// From roll and pitch of the sensor, rad.
    pub(super) fn of(roll: f32, pitch: f32) -> Self {
        let ((sr, cr), (sp, cp)) = (math::sin_cos(0.5 * roll), math::sin_cos(0.5 * pitch));
        Self { roll, pitch, rotation: rotation_matrix([cr * cp, sr * cp, cr * sp, -sr * sp]) }
    }

    /// The trim that makes this specific force point straight up. No trim for a force of zero.
    pub(super) fn levelling(force: &Vec3) -> Self {
        Self {
            roll: math::atan2(-force.y, -force.z),
            pitch: math::atan2(force.x, math::sqrt(force.y * force.y + force.z * force.z)),
            rotation: rotation_matrix(attitude_from_specific_force(force)),
        }
    }

    /// Rotates a vector from the sensor to the airframe, body FRD: specific force, angular rate,
    /// and field if the magnetometer is on the same board.
    #[inline]
    #[must_use]
    pub fn correct(&self, measured: Vec3) -> Vec3 {
        rotate(&self.rotation, &measured)
    }

    /// Rotates a vector from the airframe to the sensor.
    #[inline]
    #[must_use]
    pub fn undo(&self, corrected: Vec3) -> Vec3 {
        rotate_back(&self.rotation, &corrected)
    }
}

/// Measures the trim of a vehicle that stands on a level floor.
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
    /// Largest tilt by default, rad: five degrees. More is a vehicle that does not stand level.
    pub const TILT_MAX: f32 = 0.0873;

    /// Nothing collected yet; `tilt_max` is the largest accepted tilt, rad.
    #[must_use]
    pub fn new(still: StillnessConfig, tilt_max: f32) -> Self {
        Self { average: StillAverage::new(still), tilt_max }
    }

    /// Collected share of the still stretch, 0 to 1.
    #[must_use]
    pub fn progress(&self) -> f32 {
        self.average.progress()
    }

    /// Takes an inertial sample. Returns the trim with the last sample of each still stretch.
    ///
    /// # Errors
    /// The reason for which the sample, or with its last sample the stretch, is not used.
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
