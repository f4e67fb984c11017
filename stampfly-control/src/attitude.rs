//! Attitude to body rate: proportional on the quaternion error, tilt before heading.
//!
//! The error qₑ = q⁻¹ q_target is split into a rotation about a horizontal body axis (tilt) and one about the body's
//! z axis (heading), qₑ = q_tilt q_heading; each gets its own gain. A large heading error then never bends the tilt,
//! which is what keeps the vehicle in the air. The split is the one of D. Brescianini and R. D'Andrea,
//! *Tilt-prioritized quadrocopter attitude control*, IEEE Transactions on Control Systems Technology 28 (2020),
//! section III. There is no trigonometry and no singularity short of upside down, and the result is an even
//! function of q: q and −q, the same attitude, give the same bits.

use stampfly_types::{Quat, Vec3, math};

use crate::airframe::Airframe;
use crate::bound::symmetric;

/// Gains and limits of the attitude loop.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AttitudeConfig {
    /// Rate per tilt error, 1/s.
    pub tilt_gain: f32,
    /// Rate per heading error, 1/s.
    pub heading_gain: f32,
    /// Largest roll and pitch rate asked for, rad/s.
    pub tilt_rate_max: f32,
    /// Largest yaw rate asked for, rad/s.
    pub heading_rate_max: f32,
}

impl AttitudeConfig {
    /// The default gains, lowered with the rate loop's bandwidth when the airframe's motors are slow.
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        let (quickness, quick) = (airframe.quickness(), Self::default());
        Self { tilt_gain: quickness * quick.tilt_gain, heading_gain: quickness * quick.heading_gain, ..quick }
    }
}

impl Default for AttitudeConfig {
    /// About a third of the rate loop's bandwidth, for motors quick enough for it.
    fn default() -> Self {
        Self { tilt_gain: 13.0, heading_gain: 5.0, tilt_rate_max: 5.0, heading_rate_max: 2.0 }
    }
}

/// The body rate that turns `attitude` into `target`, rad/s in body axes.
///
/// ```
/// use stampfly_control::attitude::{AttitudeConfig, rate_towards};
/// use stampfly_types::Quat;
/// let config = AttitudeConfig::default();
/// let rate = rate_towards(&config, &Quat::identity(), &Quat::from_euler_angles(0.1, 0.0, 0.0));
/// assert!((rate.x - 0.1 * config.tilt_gain).abs() < 1e-3 && rate.y == 0.0 && rate.z == 0.0);
/// ```
#[must_use]
#[inline]
pub fn rate_towards(config: &AttitudeConfig, attitude: &Quat, target: &Quat) -> Vec3 {
    let [w, x, y, z] = (attitude.inverse() * *target).wxyz();
    let upright = math::sqrt(w * w + z * z);
    if upright < 1e-3 {
        // Upside down: every horizontal axis is as short as the other; take the roll axis. The heading has no
        // meaning here and its rate waits.
        return Vec3::new(config.tilt_rate_max, 0.0, 0.0);
    }
    // Twice the vector part is the angle for small errors, and grows slower than it for large ones.
    let twice = 2.0 / upright;
    let tilt = config.tilt_gain * twice;
    let heading = config.heading_gain * twice * shortest(w, z);
    let mut rate = Vec3::new(tilt * (w * x - y * z), tilt * (w * y + x * z), 0.0);
    let squared = rate.x * rate.x + rate.y * rate.y;
    if squared > config.tilt_rate_max * config.tilt_rate_max {
        rate *= config.tilt_rate_max / math::sqrt(squared);
    }
    rate.z = symmetric(heading, config.heading_rate_max);
    rate
}

/// `z` for the quaternion of the pair ±(w, z) that turns by less than half a turn; at exactly half a turn, clockwise.
fn shortest(w: f32, z: f32) -> f32 {
    if w > 0.0 {
        z
    } else if w < 0.0 {
        -z
    } else {
        z.abs()
    }
}

/// The attitude whose body z axis is `down` (unit vector, world frame) and whose heading is given as the cosine and
/// sine of half its angle.
///
/// Heading first, then the shortest rotation from vertical to `down`: the decomposition that stays regular up to
/// upside down, where it falls back to level.
#[must_use]
#[inline]
pub fn from_down_axis(down: &Vec3, (cos_half_yaw, sin_half_yaw): (f32, f32)) -> Quat {
    let w = 1.0 + down.z;
    let norm_squared = w * w + down.x * down.x + down.y * down.y;
    if norm_squared < 1e-6 {
        return Quat::new_unchecked(cos_half_yaw, 0.0, 0.0, sin_half_yaw);
    }
    let scale = 1.0 / math::sqrt(norm_squared);
    let (w, x, y) = (w * scale, -down.y * scale, down.x * scale);
    Quat::new_unchecked(
        w * cos_half_yaw,
        x * cos_half_yaw + y * sin_half_yaw,
        y * cos_half_yaw - x * sin_half_yaw,
        w * sin_half_yaw,
    )
}

/// Cosine and sine of half the heading of an attitude, in the sense of [`from_down_axis`].
#[must_use]
#[inline]
pub fn half_heading(attitude: &Quat) -> (f32, f32) {
    let [w, _, _, z] = attitude.wxyz();
    let norm = math::sqrt(w * w + z * z);
    if norm < 1e-3 { (1.0, 0.0) } else { (w / norm, z / norm) }
}

/// The world's down axis in the body frame: the bottom row of the rotation matrix. Its z is the cosine of the tilt.
#[must_use]
#[inline]
pub fn down_in_body(attitude: &Quat) -> Vec3 {
    let [w, x, y, z] = attitude.wxyz();
    Vec3::new(2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use stampfly_types::frame;

    prop_compose! {
        fn attitudes()(w in -1f32..1.0, x in -1f32..1.0, y in -1f32..1.0, z in -1f32..1.0) -> Quat {
            Quat::new_unchecked(w + 1e-3, x, y, z).normalize()
        }
    }

    proptest! {
        #[test]
        fn both_quaternions_of_an_attitude_give_the_same_bits(q in attitudes(), target in attitudes()) {
            let config = AttitudeConfig::default();
            let rate = rate_towards(&config, &q, &target);
            prop_assert_eq!(rate, rate_towards(&config, &-q, &target));
            prop_assert_eq!(rate, rate_towards(&config, &q, &-target));
        }

        #[test]
        fn following_the_rate_arrives_the_short_way(q in attitudes(), target in attitudes()) {
            let config = AttitudeConfig { tilt_rate_max: 1e3, heading_rate_max: 1e3, ..AttitudeConfig::default() };
            let (mut q, mut angle) = (q, q.angle_to(&target));
            let first = angle;
            let mut path = 0.0;
            for _ in 0..2000 {
                let rate = rate_towards(&config, &q, &target);
                path += rate.norm() * 0.002;
                q *= Quat::from_scaled_axis(rate * 0.002);
                angle = q.angle_to(&target);
            }
            prop_assert!(angle < 0.01, "still {angle} away");
            // Tilt first makes a detour, but never a turn too many.
            prop_assert!(path < first + 2.0, "{path} for {first}");
        }

        #[test]
        fn an_attitude_is_its_down_axis_and_its_heading(q in attitudes()) {
            prop_assume!(frame::tilt(&q) < 3.0);
            let down = q * Vec3::z();
            let again = from_down_axis(&down, half_heading(&q));
            prop_assert!(q.angle_to(&again) < 2e-3);
            prop_assert!((down_in_body(&q) - q.inverse() * Vec3::z()).norm() < 1e-5);
        }

        #[test]
        fn rates_stay_within_their_limits(q in attitudes(), target in attitudes()) {
            let config = AttitudeConfig::default();
            let rate = rate_towards(&config, &q, &target);
            prop_assert!(rate.horizontal().norm() <= config.tilt_rate_max * 1.001);
            prop_assert!(rate.z.abs() <= config.heading_rate_max);
        }
    }

    #[test]
    fn half_a_turn_has_one_direction() {
        let config = AttitudeConfig::default();
        let (here, there) = (Quat::identity(), Quat::new_unchecked(0.0, 0.0, 0.0, 1.0));
        let minus = Quat::new_unchecked(-0.0, -0.0, -0.0, -1.0);
        assert_eq!(rate_towards(&config, &here, &there), rate_towards(&config, &here, &minus));
        assert!(rate_towards(&config, &here, &there).z > 0.0);
    }

    #[test]
    fn upside_down_rights_itself() {
        let config = AttitudeConfig::default();
        let rate = rate_towards(&config, &Quat::from_euler_angles(math::PI, 0.0, 0.0), &Quat::identity());
        assert_eq!(rate.horizontal().norm(), config.tilt_rate_max);
    }
}
