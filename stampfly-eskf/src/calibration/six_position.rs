//! Accelerometer scale and bias from six positions.
//!
//! The vehicle lies on each of its faces, in any order, for about two seconds. At rest an
//! accelerometer measures one g in any attitude; the scales and biases found give all holds that
//! length. Exact placement is not needed: a face tilted by ten degrees is as good as an upright
//! one.
//!
//! Use it once per vehicle, and after a crash, at a temperature close to that of flight. Not for
//! cross-axis errors, which six faces do not show (0.5 % and less by data sheets).
//!
//! Method: Gauss-Newton on the lengths; D. Tedaldi, A. Pretto, E. Menegatti, "A robust and easy to
//! implement method for IMU calibration without external equipments", ICRA 2014, with three scales
//! and three biases as unknowns.

use super::least_squares::LeastSquares;
use super::{NotStill, StillAverage, StillMean, StillnessConfig};
use stampfly_types::messages::ImuData;
use stampfly_types::{GRAVITY, Instant, Vec3, math};

/// The side of the vehicle that is down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// Nose down.
    Front,
    /// Tail down.
    Rear,
    /// On its right side.
    Right,
    /// On its left side.
    Left,
    /// On its landing gear.
    Bottom,
    /// On its back.
    Top,
}

impl Face {
    /// All faces.
    pub const ALL: [Self; 6] = [Self::Front, Self::Rear, Self::Right, Self::Left, Self::Bottom, Self::Top];

    /// Cosine of 25°, the largest tilt of a face.
    const UPRIGHT: f32 = 0.906;

    /// The face that is down for this specific force, body FRD; `None` if it is tilted by more than
    /// 25°.
    #[must_use]
    pub fn of(force: &Vec3) -> Option<Self> {
        let limit = Self::UPRIGHT * force.norm();
        let pairs = [(force.x, Self::Front, Self::Rear), (force.y, Self::Right, Self::Left)];
        let pairs = pairs.into_iter().chain([(force.z, Self::Bottom, Self::Top)]);
        // The support pushes upwards, so the force is opposite to the axis that points down.
        let mut found = pairs.filter(|(along, ..)| along.abs() >= limit && limit > 0.0);
        found.next().map(|(along, down, up)| if along < 0.0 { down } else { up })
    }
}

/// Reason for which a sample or a hold was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SixPositionRefusal {
    /// The vehicle moves.
    Moving(NotStill),
    /// It turned slowly during the hold.
    Creeping,
    /// It is tilted by more than 25° from the nearest face.
    NotAFace,
    /// An earlier hold of this face had another length, so one of the two was not at rest.
    Contradiction(Face),
    /// This face has two holds already.
    FaceFull(Face),
}

/// Reason for which there is no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SixPositionFailure {
    /// This face has no hold.
    Missing(Face),
    /// The holds do not determine scale and bias.
    NotSolvable,
    /// A scale error above a fifth or a bias above 3 m/s²: a fault, not a tolerance.
    Implausible,
}

/// Quality of a result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SixPositionQuality {
    /// Root mean square of |a| − g over the holds, as measured, m/s².
    pub residual_before: f32,
    /// The same after correction. Without meaning while `redundancy` is zero.
    pub residual: f32,
    /// Number of holds beyond the six required. Hold a face a second time to check the result.
    pub redundancy: u32,
    /// Standard error of a bias from the noise of the holds, m/s².
    pub noise: f32,
}

/// Accelerometer correction: (measured − bias) · scale.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AccelCorrection {
    /// Measurement without any force, body FRD, m/s².
    pub bias: Vec3,
    /// Factor of each axis.
    pub scale: Vec3,
}

impl Default for AccelCorrection {
    /// No correction.
    fn default() -> Self {
        Self { bias: Vec3::zeros(), scale: Vec3::repeat(1.0) }
    }
}

impl AccelCorrection {
    /// The corrected specific force, body FRD, m/s².
    #[inline]
    #[must_use]
    pub fn correct(&self, measured: Vec3) -> Vec3 {
        (measured - self.bias).component_mul(&self.scale)
    }
}

/// Holds per face: one is required, the second checks it.
const HOLDS: usize = 2;
/// Largest difference in length of two holds of a face: a constant, m/s², plus a share of their
/// distance. The share is the effect of a bias of 1 m/s² on two holds of different tilt.
const AGREEMENT: (f32, f32) = (0.1, 0.1);
/// Largest standard deviation of the specific force in a hold, m/s². More is a turn too slow to be
/// detected as motion.
const CREEP: f32 = 0.25;

/// Six-position calibration of an accelerometer.
///
/// ```
/// use stampfly_eskf::calibration::SixPosition;
/// use stampfly_types::{GRAVITY, Duration, Instant, Vec3, messages::ImuData};
/// let mut calibration = SixPosition::default();
/// let mut now = Instant::ZERO;
/// for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
///     for force in [axis * GRAVITY, axis * -GRAVITY] {
///         let measured = force * 1.01 + Vec3::new(0.1, -0.2, 0.3);
///         for k in 0..1200 {
///             now += Duration::from_micros(2_500);
///             // It is picked up and turned, then left alone.
///             let gyro = if k < 100 { Vec3::new(3.0, 0.0, 0.0) } else { Vec3::zeros() };
///             let _ = calibration.step(now, &ImuData { accel: measured, gyro, temperature: 25.0, ..Default::default() });
///         }
///     }
/// }
/// let (correction, quality) = calibration.solve().unwrap();
/// assert!((correction.bias - Vec3::new(0.1, -0.2, 0.3)).amax() < 1e-3);
/// assert!(quality.residual < 1e-3 && quality.residual_before > 0.1);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SixPosition {
    average: StillAverage,
    /// A hold has been taken and the vehicle has not moved since.
    taken: bool,
    holds: [[Option<Vec3>; HOLDS]; 6],
    noise: f32,
}

impl Default for SixPosition {
    /// 0.7 s to settle, 1.25 s at 400 Hz to average, an accelerometer within a fifth of g.
    fn default() -> Self {
        let limits = StillnessConfig { force_range: [7.8, 11.8], settle: 0.7, samples: 500, ..Default::default() };
        Self::new(limits)
    }
}

impl SixPosition {
    /// No holds yet. `force_range` must leave room for the errors to be found.
    #[must_use]
    pub fn new(still: StillnessConfig) -> Self {
        Self { average: StillAverage::new(still), taken: false, holds: [[None; HOLDS]; 6], noise: 0.0 }
    }

    /// Takes an inertial sample. Returns the face when its hold is complete: turn the vehicle now.
    ///
    /// # Errors
    /// The reason for which the sample, or with its last sample the hold, is not used. Earlier
    /// holds stay.
    pub fn step(&mut self, now: Instant, imu: &ImuData) -> Result<Option<Face>, SixPositionRefusal> {
        match self.average.step(now, imu) {
            Err(reason) => {
                // Only motion allows the next hold: otherwise one position would be counted twice.
                self.taken &= reason == NotStill::NotFinite;
                Err(SixPositionRefusal::Moving(reason))
            }
            Ok(Some(mean)) if !self.taken => {
                let face = self.hold(&mean)?;
                self.taken = true;
                Ok(Some(face))
            }
            Ok(_) => Ok(None),
        }
    }

    fn hold(&mut self, mean: &StillMean) -> Result<Face, SixPositionRefusal> {
        if mean.accel_noise.amax() > CREEP {
            return Err(SixPositionRefusal::Creeping);
        }
        let face = Face::of(&mean.accel).ok_or(SixPositionRefusal::NotAFace)?;
        let full = SixPositionRefusal::FaceFull(face);
        let places = self.holds.get_mut(face as usize).ok_or(full)?;
        for before in places.iter().flatten() {
            let (constant, share) = AGREEMENT;
            if (before.norm() - mean.accel.norm()).abs() > constant + share * (before - mean.accel).norm() {
                return Err(SixPositionRefusal::Contradiction(face));
            }
        }
        *places.iter_mut().find(|place| place.is_none()).ok_or(full)? = Some(mean.accel);
        self.noise = self.noise.max(mean.accel_noise.amax() / math::sqrt(mean.samples as f32));
        Ok(face)
    }

    /// Whether this face has a hold.
    #[must_use]
    pub fn has(&self, face: Face) -> bool {
        self.holds.get(face as usize).is_some_and(|holds| holds.iter().any(Option::is_some))
    }

    fn forces(&self) -> impl Iterator<Item = &Vec3> {
        self.holds.iter().flatten().flatten()
    }

    /// Root mean square of |a| − g.
    fn residual(&self, correction: &AccelCorrection) -> f32 {
        let squares = self.forces().map(|force| {
            let off = correction.correct(*force).norm() - GRAVITY;
            off * off
        });
        math::sqrt(squares.sum::<f32>() / (self.forces().count() as f32).max(1.0))
    }

    /// Scale and bias of the accelerometer, with their quality.
    ///
    /// # Errors
    /// The reason for which there is no result.
    pub fn solve(&self) -> Result<(AccelCorrection, SixPositionQuality), SixPositionFailure> {
        if let Some(missing) = Face::ALL.into_iter().find(|face| !self.has(*face)) {
            return Err(SixPositionFailure::Missing(missing));
        }
        let none = AccelCorrection::default();
        let mut correction = none;
        // Converges to the last bit within four iterations.
        for _ in 0..8 {
            let mut equations = LeastSquares::<7>::default();
            for measured in self.forces() {
                let force = correction.correct(*measured);
                let up = force / force.norm();
                // Derivatives of |a|: by scale in g, so that both kinds of unknowns have a similar
                // size, and by bias.
                let by_scale = up.component_mul(&(measured - correction.bias)) / GRAVITY;
                let by_bias = -up.component_mul(&correction.scale);
                let short = GRAVITY - force.norm();
                equations.add([by_scale.x, by_scale.y, by_scale.z, by_bias.x, by_bias.y, by_bias.z, short]);
            }
            let [sx, sy, sz, bx, by, bz, _] = equations.solve().ok_or(SixPositionFailure::NotSolvable)?;
            correction.scale += Vec3::new(sx, sy, sz) / GRAVITY;
            correction.bias += Vec3::new(bx, by, bz);
        }
        let residual = self.residual(&correction);
        if !residual.is_finite() {
            return Err(SixPositionFailure::NotSolvable);
        }
        if correction.scale.iter().any(|s| (s - 1.0).abs() > 0.2) || correction.bias.amax() > 3.0 {
            return Err(SixPositionFailure::Implausible);
        }
        let quality = SixPositionQuality {
            residual_before: self.residual(&none),
            residual,
            redundancy: (self.forces().count() as u32).saturating_sub(6),
            // Two opposite faces determine each bias.
            noise: self.noise * core::f32::consts::FRAC_1_SQRT_2,
        };
        Ok((correction, quality))
    }
}
