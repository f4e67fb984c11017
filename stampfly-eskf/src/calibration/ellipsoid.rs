//! Magnetometer hard and soft iron from an ellipsoid fit.
//!
//! Turned in all directions in a constant field, an ideal magnetometer measures a sphere about
//! zero. Magnets on board shift it (hard iron), steel and unequal gains stretch it (soft iron). The
//! fit of an ellipsoid gives both.
//!
//! Use it outdoors or away from steel, once per vehicle and place. Not while motors run: their
//! field follows their current. The orientation of the sensor cannot be found from lengths alone;
//! the correction is the symmetric one.
//!
//! Method: the quadric with trace(A) = 3, linear in nine unknowns (Q. Li, J. G. Griffiths, "Least
//! squares ellipsoid specific fitting", GMP 2004, for quadrics in general), solved by a triangular
//! factor that takes one sample after the other. Coordinates are relative to the first sample, so a
//! large hard iron costs no precision.

use super::least_squares::LeastSquares;
use super::principal_axes::principal_axes;
use nalgebra::Matrix3;
use stampfly_types::{Vec3, math};

/// Limits for samples and results.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EllipsoidConfig {
    /// Smallest distance between samples, µT, so that a pause does not outweigh turning.
    pub spacing: f32,
    /// Smallest number of samples.
    pub samples_min: u32,
    /// Smallest share of the 26 directions that must be covered.
    pub coverage_min: f32,
    /// Accepted field strengths, µT. The earth's is 22 to 67 µT, and gains differ.
    pub strength_range: [f32; 2],
    /// Largest ratio of the longest to the shortest axis; more is a broken sensor. Also limits the
    /// flatness of the samples.
    pub stretch_max: f32,
    /// Largest root mean square error of the corrected strength, as a share of the strength.
    pub residual_max: f32,
}

impl Default for EllipsoidConfig {
    fn default() -> Self {
        Self {
            spacing: 2.0,
            samples_min: 100,
            coverage_min: 0.75,
            strength_range: [15.0, 90.0],
            stretch_max: 1.5,
            residual_max: 0.1,
        }
    }
}

/// Reason for which a sample was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MagRefusal {
    /// A value is NaN or infinite.
    NotFinite,
    /// Closer to the last used sample than `spacing`.
    TooNear,
    /// Too far from the first sample for one ellipsoid.
    TooFar,
}

/// Reason for which there is no result.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum EllipsoidFailure {
    /// Too few samples.
    TooFew {
        /// Samples used.
        samples: u32,
    },
    /// The samples are much wider in one direction than in another: in a plane, on a line, on a
    /// cap.
    Flat {
        /// Smallest width divided by the largest.
        flatness: f32,
    },
    /// The best fit is not an ellipsoid, or not unique.
    NotPositive,
    /// The field is too weak or too strong.
    Strength {
        /// Mean radius, µT.
        strength: f32,
    },
    /// The axes differ too much.
    Stretched {
        /// Longest axis divided by the shortest.
        stretch: f32,
    },
    /// Too few directions were covered.
    Coverage {
        /// Share of the 26 directions.
        coverage: f32,
    },
    /// The samples do not lie on the ellipsoid: the field changed.
    Residual {
        /// Root mean square, as a share of the strength.
        residual: f32,
    },
}

/// Quality of a result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipsoidQuality {
    /// Root mean square error of the corrected strength, µT.
    pub residual: f32,
    /// Share of 26 evenly spaced directions with a sample within 30°.
    pub coverage: f32,
    /// Longest axis divided by the shortest: the soft iron. One is a sphere.
    pub stretch: f32,
    /// Samples used.
    pub samples: u32,
}

/// Magnetometer correction: matrix · (measured − offset).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MagCorrection {
    /// Hard iron, body FRD, µT.
    pub offset: Vec3,
    /// Inverse of the soft iron; symmetric, with determinant one.
    pub matrix: Matrix3<f32>,
    /// Strength of the corrected field, µT.
    pub strength: f32,
}

impl MagCorrection {
    /// The corrected field, body FRD, µT.
    #[inline]
    #[must_use]
    pub fn correct(&self, measured: Vec3) -> Vec3 {
        self.matrix * (measured - self.offset)
    }
}

/// Unknowns of the quadric.
const UNKNOWNS: usize = 9;
/// Unit of the coordinates, µT, so that their squares are close to one.
const UNIT: f32 = 50.0;
/// Cosine of 30°. Samples that close to both poles span at least this share of the diameter.
const NEAR: f32 = 0.866;
/// Three face, six edge and four corner directions of a cube. With their opposites they are 26.
const DIRECTIONS: [[f32; 3]; 13] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [0.0, 1.0, 1.0],
    [0.0, 1.0, -1.0],
    [1.0, 1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0],
    [1.0, -1.0, -1.0],
];

/// Ellipsoid fit, sample by sample.
///
/// ```
/// use stampfly_eskf::calibration::EllipsoidFit;
/// use stampfly_types::{Vec3, math};
/// let mut fit = EllipsoidFit::default();
/// for k in 0..400 {
///     // A spiral over the sphere, 48 µT, shifted and stretched.
///     let z = 1.0 - k as f32 / 200.0;
///     let (sin, cos) = math::sin_cos(k as f32 * 0.5);
///     let across = math::sqrt(1.0 - z * z);
///     let field = Vec3::new(across * cos, across * sin, z) * 48.0;
///     let _ = fit.add(&(field.component_mul(&Vec3::new(1.1, 1.0, 1.0 / 1.1)) + Vec3::new(120.0, -30.0, 15.0)));
/// }
/// let (correction, quality) = fit.solve().unwrap();
/// assert!((correction.offset - Vec3::new(120.0, -30.0, 15.0)).amax() < 0.01);
/// assert!((correction.strength - 48.0).abs() < 0.01 && quality.coverage == 1.0 && quality.residual < 0.01);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EllipsoidFit {
    config: EllipsoidConfig,
    /// The first and the last used sample, µT.
    origin: Vec3,
    last: Vec3,
    quadric: LeastSquares<{ UNKNOWNS + 1 }>,
    /// Smallest and largest component along each direction, relative to the first sample.
    extent: [[f32; 2]; 13],
    samples: u32,
}

impl Default for EllipsoidFit {
    fn default() -> Self {
        Self::new(EllipsoidConfig::default())
    }
}

impl EllipsoidFit {
    /// A fit without samples.
    #[must_use]
    pub fn new(config: EllipsoidConfig) -> Self {
        Self {
            config,
            origin: Vec3::zeros(),
            last: Vec3::zeros(),
            quadric: LeastSquares::default(),
            extent: [[0.0; 2]; 13],
            samples: 0,
        }
    }

    /// Number of samples used.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Takes a field, body FRD, µT.
    ///
    /// # Errors
    /// The reason for which it was not used.
    pub fn add(&mut self, field: &Vec3) -> Result<(), MagRefusal> {
        if !field.iter().all(|v| v.is_finite()) {
            return Err(MagRefusal::NotFinite);
        }
        if self.samples == 0 {
            self.origin = *field;
        } else if (field - self.last).norm() < self.config.spacing {
            return Err(MagRefusal::TooNear);
        }
        // Relative to the first sample, so that a large hard iron costs no precision.
        let from_origin = field - self.origin;
        let [_, strongest] = self.config.strength_range;
        if from_origin.amax() > 2.0 * strongest * self.config.stretch_max {
            // If the second to fifth sample contradict the first, the first was wrong.
            if self.samples < 5 {
                *self = Self::new(self.config);
            }
            return Err(MagRefusal::TooFar);
        }
        self.last = *field;
        self.samples = self.samples.saturating_add(1);
        let at = from_origin / UNIT;
        for ([low, high], direction) in self.extent.iter_mut().zip(DIRECTIONS) {
            let along = at.dot(&Vec3::from(direction));
            (*low, *high) = (low.min(along), high.max(along));
        }
        let (x, y, z) = (at.x, at.y, at.z);
        let (xx, yy, zz) = (x * x, y * y, z * z);
        let (p, q) = (xx + yy - 2.0 * zz, xx + zz - 2.0 * yy);
        let (xy, xz, yz) = (2.0 * x * y, 2.0 * x * z, 2.0 * y * z);
        self.quadric.add([p, q, xy, xz, yz, 2.0 * x, 2.0 * y, 2.0 * z, 1.0, xx + yy + zz]);
        Ok(())
    }

    /// Offset, matrix and strength, with their quality.
    ///
    /// # Errors
    /// The reason for which there is no result.
    pub fn solve(&self) -> Result<(MagCorrection, EllipsoidQuality), EllipsoidFailure> {
        let config = &self.config;
        let samples = self.samples;
        if samples < config.samples_min.max(UNKNOWNS as u32 + 1) {
            return Err(EllipsoidFailure::TooFew { samples });
        }
        // Tested on the samples: a noisy cap is fitted well by an ellipsoid as flat as the cap.
        let flatness = self.flatness();
        if flatness.is_nan() || flatness * config.stretch_max < NEAR {
            return Err(EllipsoidFailure::Flat { flatness });
        }
        let [p, q, xy, xz, yz, bx, by, bz, constant, _] = self.quadric.solve().ok_or(EllipsoidFailure::NotPositive)?;
        // xᵀ·A·x − 2·bᵀ·x = constant, which is (x − c)ᵀ·A·(x − c) = square with A·c = b.
        let shape = Matrix3::new(1.0 - p - q, -xy, -xz, -xy, 1.0 - p + 2.0 * q, -yz, -xz, -yz, 1.0 + 2.0 * p - q);
        let b = Vec3::new(bx, by, bz);
        let (axes, squares) = principal_axes(shape);
        let (least, most) = (squares.min(), squares.max());
        let inverse = axes * Matrix3::from_diagonal(&squares.map(|value| 1.0 / value).into()) * axes.transpose();
        let center = inverse * b;
        let square = constant + b.dot(&center);
        if !(least > 0.0 && square > 0.0 && squares.sum().is_finite() && square.is_finite()) {
            return Err(EllipsoidFailure::NotPositive);
        }
        // Radius of the sphere with the same volume.
        let gain = math::cbrt(math::sqrt(squares.x * squares.y * squares.z));
        let strength = math::sqrt(square) / gain * UNIT;
        let stretch = math::sqrt(most / least);
        let coverage = self.coverage(&center, &inverse, square);
        // (x − c)ᵀ·A·(x − c) is the squared corrected strength: half its relative error is that of
        // the strength.
        let residual = 0.5 * self.quadric.residual() / square / math::sqrt(samples as f32 - UNKNOWNS as f32);
        let [weakest, strongest] = config.strength_range;
        if stretch > config.stretch_max {
            return Err(EllipsoidFailure::Stretched { stretch });
        }
        if !(weakest..=strongest).contains(&strength) {
            return Err(EllipsoidFailure::Strength { strength });
        }
        if coverage < config.coverage_min {
            return Err(EllipsoidFailure::Coverage { coverage });
        }
        if residual.is_nan() || residual > config.residual_max {
            return Err(EllipsoidFailure::Residual { residual });
        }
        let roots = Matrix3::from_diagonal(&squares.map(|value| math::sqrt(value) / gain).into());
        let matrix = axes * roots * axes.transpose();
        let correction = MagCorrection { offset: self.origin + center * UNIT, matrix, strength };
        Ok((correction, EllipsoidQuality { residual: residual * strength, coverage, stretch, samples }))
    }

    /// Smallest width of the samples divided by the largest.
    fn flatness(&self) -> f32 {
        let widths = self.extent.iter().zip(DIRECTIONS).map(|([low, high], d)| (high - low) / Vec3::from(d).norm());
        let (least, most) = widths.fold((f32::INFINITY, 0.0f32), |(least, most), w| (least.min(w), most.max(w)));
        least / most
    }

    /// Share of the directions in which the samples reach at least `NEAR` of the ellipsoid.
    fn coverage(&self, center: &Vec3, inverse: &Matrix3<f32>, square: f32) -> f32 {
        let reached: usize = self
            .extent
            .iter()
            .zip(DIRECTIONS)
            .map(|([low, high], direction)| {
                let direction = Vec3::from(direction);
                let middle = center.dot(&direction);
                let near = NEAR * math::sqrt(square * direction.dot(&(inverse * direction)));
                usize::from(high - middle >= near) + usize::from(middle - low >= near)
            })
            .sum();
        reached as f32 / (2 * DIRECTIONS.len()) as f32
    }
}
