//! How far an estimate is from the truth: attitude as BROAD measures it, position and velocity.
//!
//! The error of the attitude is the rotation that is missing, in the world's axes: q = truth · estimate⁻¹. Its whole
//! angle is 2·acos|w|, the part about the vertical (heading) 2·atan|z/w|, what is left (tilt, the angle between the
//! two verticals) 2·acos √(w² + z²). Laidig et al., "BROAD", Data 6(7):72, 2021, section 4.
//!
//! A camera marker and an inertial sensor are never mounted exactly alike. `tilt_aligned` first removes the one constant
//! rotation of the body that brings all verticals together as well as possible (Kabsch, Acta Cryst. A32, 1976).

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use stampfly_types::{Quat, Vec3};

/// Root mean square of what was added.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rms {
    sum: f64,
    count: usize,
}

impl Rms {
    pub(super) fn add(&mut self, square: f64) {
        self.sum += square;
        self.count += 1;
    }

    pub(super) fn get(self) -> Option<f64> {
        (self.count > 0).then(|| (self.sum / self.count as f64).sqrt())
    }
}

/// Collects errors, sample by sample.
///
/// ```
/// use stampfly_lab::estimate::Accuracy;
/// use stampfly_types::Quat;
///
/// let mut accuracy = Accuracy::default();
/// accuracy.attitude(&Quat::from_euler_angles(0.03, 0.0, 0.04), &Quat::identity());
/// let degrees = accuracy.tilt().unwrap();
/// assert!((degrees - 0.03f64.to_degrees()).abs() < 1e-3);
/// ```
#[derive(Clone, Debug, Default)]
pub struct Accuracy {
    total: Rms,
    heading: Rms,
    tilt: Rms,
    position: Rms,
    velocity: Rms,
    farthest: Option<f64>,
    /// The world's vertical in the estimated and in the true body.
    verticals: Vec<[Vector3<f64>; 2]>,
}

fn exact(attitude: &Quat) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(UnitQuaternion::from(*attitude).into_inner().cast())
}

impl Accuracy {
    /// Takes an attitude and what it should have been.
    pub fn attitude(&mut self, estimate: &Quat, truth: &Quat) {
        let (estimate, truth) = (exact(estimate), exact(truth));
        let error = truth * estimate.inverse();
        let (w, x, y, z) = (error.w.abs(), error.i, error.j, error.k.abs());
        // Arc tangents of halves: the arc cosine is useless near zero, where the errors are.
        self.total.add((2.0 * error.imag().norm().atan2(w)).powi(2));
        self.heading.add((2.0 * z.atan2(w)).powi(2));
        self.tilt.add((2.0 * x.hypot(y).atan2(w.hypot(z))).powi(2));
        self.verticals.push([estimate, truth].map(|q| q.inverse() * Vector3::z()));
    }

    /// Takes a position and what it should have been.
    pub fn position(&mut self, estimate: &Vec3, truth: &Vec3) {
        let apart = f64::from((estimate - truth).norm());
        self.position.add(apart * apart);
        self.farthest = Some(self.farthest.map_or(apart, |farthest| if apart <= farthest { farthest } else { apart }));
    }

    /// Takes a velocity and what it should have been.
    pub fn velocity(&mut self, estimate: &Vec3, truth: &Vec3) {
        self.velocity.add(f64::from((estimate - truth).norm_squared()));
    }

    /// Whole attitude error, degrees RMS.
    #[must_use]
    pub fn total(&self) -> Option<f64> {
        self.total.get().map(f64::to_degrees)
    }

    /// Heading error, degrees RMS.
    #[must_use]
    pub fn heading(&self) -> Option<f64> {
        self.heading.get().map(f64::to_degrees)
    }

    /// Tilt error, degrees RMS.
    #[must_use]
    pub fn tilt(&self) -> Option<f64> {
        self.tilt.get().map(f64::to_degrees)
    }

    /// Tilt error without one constant rotation of the body, degrees RMS.
    #[must_use]
    pub fn tilt_aligned(&self) -> Option<f64> {
        let together =
            self.verticals.iter().map(|[estimate, truth]| truth * estimate.transpose()).sum::<Matrix3<f64>>();
        if self.verticals.is_empty() || !together.iter().all(|cell| cell.is_finite()) {
            return None;
        }
        let parts = together.svd(true, true);
        let (left, right) = (parts.u?, parts.v_t?);
        // A reflection is no rotation: turn over the axis that the data say least about.
        let mut kept = Matrix3::identity();
        kept[(2, 2)] = (left * right).determinant().signum();
        let rotation = left * kept * right;
        let mut tilt = Rms::default();
        for [estimate, truth] in &self.verticals {
            let turned = rotation * estimate;
            tilt.add(turned.cross(truth).norm().atan2(turned.dot(truth)).powi(2));
        }
        tilt.get().map(f64::to_degrees)
    }

    /// Distance from the true position, metres RMS.
    #[must_use]
    pub fn position_rms(&self) -> Option<f64> {
        self.position.get()
    }

    /// Largest distance from the true position, metres.
    #[must_use]
    pub fn position_max(&self) -> Option<f64> {
        self.farthest
    }

    /// Distance from the true velocity, m/s RMS.
    #[must_use]
    pub fn velocity_rms(&self) -> Option<f64> {
        self.velocity.get()
    }

    /// How many attitudes were compared.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.tilt.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use stampfly_types::math;

    fn tumbling(step: usize) -> Quat {
        let phase = step as f32 * 0.11;
        Quat::from_euler_angles(0.5 * math::sin(phase), 0.4 * math::cos(1.3 * phase), 0.2 * phase)
    }

    #[test]
    fn heading_and_tilt_are_told_apart() {
        let mut accuracy = Accuracy::default();
        for step in 0..100 {
            let world = Quat::from_euler_angles(0.0, 0.0, 0.3);
            accuracy.attitude(&(world * tumbling(step)), &tumbling(step));
        }
        assert!(accuracy.tilt().unwrap() < 1e-4);
        assert!((accuracy.heading().unwrap() - 0.3f64.to_degrees()).abs() < 1e-4);
        assert!((accuracy.total().unwrap() - 0.3f64.to_degrees()).abs() < 1e-4);
        assert_eq!(accuracy.samples(), 100);
    }

    proptest! {
        #[test]
        fn a_constant_mounting_error_is_removed(roll in -0.3f32..0.3, pitch in -0.3f32..0.3, yaw in -0.3f32..0.3) {
            let mounting = Quat::from_euler_angles(roll, pitch, yaw);
            let mut accuracy = Accuracy::default();
            for step in 0..200 {
                accuracy.attitude(&(tumbling(step) * mounting), &tumbling(step));
            }
            prop_assert!(accuracy.tilt_aligned().unwrap() < 1e-3, "{:?}", accuracy.tilt_aligned());
            let plain = accuracy.tilt().unwrap();
            prop_assert!(plain > 0.3 * f64::from(roll).hypot(f64::from(pitch)).to_degrees() - 1e-3, "{plain}");
        }

        #[test]
        fn an_error_that_changes_is_not(size in 0.01f32..0.1) {
            let mut accuracy = Accuracy::default();
            for step in 0..200 {
                let wrong = Quat::from_euler_angles(if step % 2 == 0 { size } else { -size }, 0.0, 0.0);
                accuracy.attitude(&(wrong * tumbling(step)), &tumbling(step));
            }
            let (plain, aligned) = (accuracy.tilt().unwrap(), accuracy.tilt_aligned().unwrap());
            prop_assert!((plain - f64::from(size).to_degrees()).abs() < 1e-3);
            prop_assert!(aligned > 0.9 * plain && aligned < plain + 1e-3, "{aligned} of {plain}");
        }
    }

    #[test]
    fn no_sample_no_figure() {
        let accuracy = Accuracy::default();
        let all = [accuracy.total(), accuracy.heading(), accuracy.tilt(), accuracy.tilt_aligned()];
        assert_eq!(all, [None; 4]);
        assert_eq!([accuracy.position_rms(), accuracy.position_max(), accuracy.velocity_rms()], [None; 3]);
    }

    #[test]
    fn distances() {
        let mut accuracy = Accuracy::default();
        accuracy.position(&Vec3::new(3.0, 4.0, 0.0), &Vec3::zeros());
        accuracy.position(&Vec3::zeros(), &Vec3::zeros());
        accuracy.velocity(&Vec3::x(), &-Vec3::x());
        assert_eq!(accuracy.position_max(), Some(5.0));
        assert!((accuracy.position_rms().unwrap() - 12.5f64.sqrt()).abs() < 1e-9);
        assert_eq!(accuracy.velocity_rms(), Some(2.0));
    }
}
