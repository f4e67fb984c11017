//! Conversions from and to nalgebra's types, for matrix algebra.

use super::{NotUnit, Quat, Vec3};
use core::ops::Mul;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

impl From<Vector3<f32>> for Vec3 {
    #[inline]
    fn from(vector: Vector3<f32>) -> Self {
        Self::new(vector.x, vector.y, vector.z)
    }
}

impl From<Vec3> for Vector3<f32> {
    #[inline]
    fn from(vector: Vec3) -> Self {
        Self::new(vector.x, vector.y, vector.z)
    }
}

impl From<UnitQuaternion<f32>> for Quat {
    #[inline]
    fn from(quaternion: UnitQuaternion<f32>) -> Self {
        Self::new_unchecked(quaternion.w, quaternion.i, quaternion.j, quaternion.k)
    }
}

impl From<Quat> for UnitQuaternion<f32> {
    #[inline]
    fn from(quaternion: Quat) -> Self {
        let [w, x, y, z] = quaternion.wxyz();
        Self::new_unchecked(Quaternion::new(w, x, y, z))
    }
}

impl TryFrom<Quaternion<f32>> for Quat {
    type Error = NotUnit;

    #[inline]
    fn try_from(quaternion: Quaternion<f32>) -> Result<Self, NotUnit> {
        Self::try_from([quaternion.w, quaternion.i, quaternion.j, quaternion.k])
    }
}

/// The rotation matrix. Its columns are the body's axes in the world frame.
impl From<Quat> for Matrix3<f32> {
    #[inline]
    fn from(quaternion: Quat) -> Self {
        let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = quaternion.to_matrix();
        Self::new(xx, xy, xz, yx, yy, yz, zx, zy, zz)
    }
}

operator!(Mul, mul, Matrix3<f32>, Vec3, Vec3, |matrix, vector| (matrix * Vector3::from(vector)).into());

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vectors() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-1e3f32..1e3).prop_map(Vec3::from)
    }

    fn attitudes() -> impl Strategy<Value = Quat> {
        prop::array::uniform4(-1.0f32..1.0)
            .prop_filter("an axis", |q| q.iter().map(|v| v * v).sum::<f32>() > 0.01)
            .prop_map(|[w, x, y, z]| UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)).into())
    }

    // Equal to the last bit: a log recorded with one type must replay with the other.
    proptest! {
        #[test]
        fn vectors_count_as_nalgebras_do(a in vectors(), b in vectors(), k in -10.0f32..10.0) {
            let (na, nb) = (Vector3::from(a), Vector3::from(b));
            prop_assert_eq!(a + b, (na + nb).into());
            prop_assert_eq!(a - b, (na - nb).into());
            prop_assert_eq!(a * k, (na * k).into());
            prop_assert_eq!(a / k, (na / k).into());
            prop_assert_eq!(-a, (-na).into());
            prop_assert_eq!(a.cross(&b), na.cross(&nb).into());
            prop_assert_eq!(a.dot(&b), na.dot(&nb));
            prop_assert_eq!(a.norm_squared(), na.norm_squared());
            prop_assert_eq!(a.norm(), na.norm());
            prop_assert_eq!(a.normalize(), na.normalize().into());
            prop_assert_eq!(a.component_mul(&b), na.component_mul(&nb).into());
            prop_assert_eq!(a.component_div(&b), na.component_div(&nb).into());
            prop_assert_eq!(a.sup(&b), na.sup(&nb).into());
            prop_assert_eq!(a.inf(&b), na.inf(&nb).into());
            prop_assert_eq!(a.abs(), na.abs().into());
            prop_assert_eq!([a.amax(), a.max(), a.min(), a.sum()], [na.amax(), na.max(), na.min(), na.sum()]);
            prop_assert_eq!([a[0], a[1], a[2]], a.to_array());
        }

        #[test]
        fn attitudes_turn_as_nalgebras_do(p in attitudes(), q in attitudes(), v in vectors()) {
            let (np, nq) = (UnitQuaternion::from(p), UnitQuaternion::from(q));
            let nv = Vector3::from(v);
            prop_assert_eq!(p * q, (np * nq).into());
            prop_assert_eq!(p.inverse(), np.inverse().into());
            prop_assert_eq!(p * v, (np * nv).into());
            prop_assert_eq!(p.inverse_transform_vector(&v), np.inverse_transform_vector(&nv).into());
            prop_assert_eq!(p.norm_squared(), np.quaternion().norm_squared());
            prop_assert_eq!(Matrix3::from(p), *np.to_rotation_matrix().matrix());
            prop_assert_eq!(p.angle(), np.angle());
            prop_assert_eq!(p.angle_to(&q), np.angle_to(&nq));
            prop_assert_eq!(p.scaled_axis(), np.scaled_axis().into());
            prop_assert_eq!(p.normalize(), UnitQuaternion::new_normalize(*np.quaternion()).into());
        }

        #[test]
        fn attitudes_come_from_angles_as_nalgebras_do(turn in vectors().prop_map(|v| v / 300.0), axis in vectors()) {
            let axis = axis.normalize();
            prop_assert_eq!(Quat::from_scaled_axis(turn), UnitQuaternion::from_scaled_axis(Vector3::from(turn)).into());
            prop_assert_eq!(
                Quat::from_euler_angles(turn.x, turn.y, turn.z),
                UnitQuaternion::from_euler_angles(turn.x, turn.y, turn.z).into()
            );
            let unit = nalgebra::Unit::new_unchecked(Vector3::from(axis));
            prop_assert_eq!(Quat::from_axis_angle(&axis, turn.x), UnitQuaternion::from_axis_angle(&unit, turn.x).into());
        }
    }

    #[test]
    fn no_turn_is_no_turn() {
        assert_eq!(Quat::from_scaled_axis(Vec3::zeros()), Quat::identity());
        assert_eq!(Quat::from_scaled_axis(Vec3::repeat(1e-9)), Quat::identity());
        assert_eq!(Quat::identity().scaled_axis(), Vec3::zeros());
        assert_eq!(Quat::try_from([0.0; 4]), Err(NotUnit));
        assert_eq!(Quat::try_from([f32::NAN, 0.0, 0.0, 0.0]), Err(NotUnit));
    }
}
