//! Magnetometer hard and soft iron: the ellipsoid through samples of all directions.
//!
//! Turned every way in a constant field, an ideal magnetometer draws a sphere about zero. Magnets on board shift it (hard
//! iron), steel and unequal gains stretch it (soft iron). Fitting the ellipsoid gives both back.
//!
//! Use it outdoors or far from steel, once a vehicle and place. Not while motors run: their field follows their
//! current. Not for the orientation of the sensor, which lengths alone do not show; the correction found is the symmetric one.
//!
//! Method: the quadric with trace(A) = 3, linear in nine unknowns (Q. Li, J. G. Griffiths, "Least squares ellipsoid specific
//! fitting", GMP 2004, for quadrics in general), solved by a triangular factor that takes one sample after the other.
//! Coordinates are counted from the first sample, so hard iron of any size costs no digits.

use super::least_squares::LeastSquares;
use super::principal_axes::principal_axes;
use nalgebra::Matrix3;
use stampfly_types::{Vec3, math};

/// What is accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EllipsoidConfig {
    /// A sample nearer than this to the last one taken is left out, µT: waiting must not outweigh turning.
    pub spacing: f32,
    /// Samples needed.
    pub samples_min: u32,
    /// Directions needed, as a share of the 26 looked at.
    pub coverage_min: f32,
    /// Field strengths believed, µT. That of the earth is 22 to 67 µT, and gains differ.
    pub strength_range: [f32; 2],
    /// Longest axis over shortest: more is a broken sensor. Samples as flat as that are refused as well.
    pub stretch_max: f32,
    /// Largest root mean square of the corrected strength's error, as a share of the strength.
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

/// Why a sample was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MagRefusal {
    /// A number in it is not finite.
    NotFinite,
    /// Too near to the last one taken to say anything new.
    TooNear,
    /// So far from the first one that they cannot lie on one ellipsoid.
    TooFar,
}

/// Why there is no result.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum EllipsoidFailure {
    /// Fewer samples than needed.
    TooFew {
        /// Samples taken.
        samples: u32,
    },
    /// The samples are much wider one way than another: in a plane, on a line, on a cap.
    Flat {
        /// Least width over largest.
        flatness: f32,
    },
    /// What fits best is no ellipsoid, or nothing fits best.
    NotPositive,
    /// The field is too weak or too strong.
    Strength {
        /// Mean radius, µT.
        strength: f32,
    },
    /// The axes are too different.
    Stretched {
        /// Longest over shortest.
        stretch: f32,
    },
    /// Too few directions have been seen.
    Coverage {
        /// Share of the 26 directions.
        coverage: f32,
    },
    /// The samples do not lie on the ellipsoid: the field changed meanwhile.
    Residual {
        /// Root mean square, as a share of the strength.
        residual: f32,
    },
}

/// How good a result is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipsoidQuality {
    /// Root mean square of the corrected strength's error, µT.
    pub residual: f32,
    /// Share of 26 directions, evenly around, that a sample came within 30° of.
    pub coverage: f32,
    /// Longest axis over shortest: soft iron. One is a sphere.
    pub stretch: f32,
    /// Samples taken.
    pub samples: u32,
}

/// Corrects a magnetometer: matrix · (measured − offset).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MagCorrection {
    /// Hard iron, body FRD, µT.
    pub offset: Vec3,
    /// Inverse of the soft iron, symmetric; its determinant is one.
    pub matrix: Matrix3<f32>,
    /// Strength of the corrected field, µT.
    pub strength: f32,
}

impl MagCorrection {
    /// The field behind a measurement, body FRD, µT.
    #[inline]
    #[must_use]
    pub fn correct(&self, measured: Vec3) -> Vec3 {
        self.matrix * (measured - self.offset)
    }
}

/// Of the quadric.
const UNKNOWNS: usize = 9;
/// Coordinates are counted in this, µT, so that their squares are near one.
const UNIT: f32 = 50.0;
/// Cosine of 30°: samples that near to both poles are as wide as this share of the diameter.
const NEAR: f32 = 0.866;
/// Three faces, six edges and four corners of a cube: with their opposites, 26 directions.
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

/// Fits the ellipsoid, sample by sample.
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
    /// The first sample, and the last one taken, µT.
    origin: Vec3,
    last: Vec3,
    quadric: LeastSquares<{ UNKNOWNS + 1 }>,
    /// Least and most along each direction, from the first sample.
    extent: [[f32; 2]; 13],
    samples: u32,
}

impl Default for EllipsoidFit {
    fn default() -> Self {
        Self::new(EllipsoidConfig::default())
    }
}

impl EllipsoidFit {
    /// No sample yet.
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

    /// Samples taken so far.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Takes a field, body FRD, µT.
    ///
    /// # Errors
    /// Why it was left out.
    pub fn add(&mut self, field: &Vec3) -> Result<(), MagRefusal> {
        if !field.iter().all(|v| v.is_finite()) {
            return Err(MagRefusal::NotFinite);
        }
        if self.samples == 0 {
            self.origin = *field;
        } else if (field - self.last).norm() < self.config.spacing {
            return Err(MagRefusal::TooNear);
        }
        let from_origin = field - self.origin;
        let [_, strongest] = self.config.strength_range;
        if from_origin.amax() > 2.0 * strongest * self.config.stretch_max {
            // A first sample that no other agrees with was the wrong one.
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

    /// Offset, matrix and strength, and how well they fit.
    ///
    /// # Errors
    /// Why there are none.
    pub fn solve(&self) -> Result<(MagCorrection, EllipsoidQuality), EllipsoidFailure> {
        let config = &self.config;
        let samples = self.samples;
        if samples < config.samples_min.max(UNKNOWNS as u32 + 1) {
            return Err(EllipsoidFailure::TooFew { samples });
        }
        // A cap with noise is fitted well by an ellipsoid as flat as the cap, so the fit cannot be the judge of this.
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
        // Radius of the sphere of the same volume.
        let gain = math::cbrt(math::sqrt(squares.x * squares.y * squares.z));
        let strength = math::sqrt(square) / gain * UNIT;
        let stretch = math::sqrt(most / least);
        let coverage = self.coverage(&center, &inverse, square);
        // (x − c)ᵀ·A·(x − c) is the square of the corrected strength, so half its relative error is that of the strength.
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

    /// Least width of the samples over the largest.
    fn flatness(&self) -> f32 {
        let widths = self.extent.iter().zip(DIRECTIONS).map(|([low, high], d)| (high - low) / Vec3::from(d).norm());
        let (least, most) = widths.fold((f32::INFINITY, 0.0f32), |(least, most), w| (least.min(w), most.max(w)));
        least / most
    }

    /// Share of directions in which the samples reach the ellipsoid, or nearly so.
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
