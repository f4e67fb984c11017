//! Roll and pitch from a measured specific force; heading zero.

use stampfly_types::{Vec3, math};

/// Quaternion (w, x, y, z; body → world) whose up axis is the measured specific force. Returns the
/// level attitude for a force of at most 0.1 m/s² or NaN.
///
/// ```
/// use stampfly_eskf::attitude_from_specific_force;
/// use stampfly_types::Vec3;
/// // Rolled right by 30°: gravity pulls towards the right wing, so the force there is negative.
/// let q = attitude_from_specific_force(&Vec3::new(0.0, -9.81 * 0.5, -9.81 * 0.866_025));
/// assert!((2.0 * q[1].atan2(q[0])).to_degrees() - 30.0 < 1e-3);
/// ```
#[must_use]
pub fn attitude_from_specific_force(force: &Vec3) -> [f32; 4] {
    let norm = force.norm();
    if norm.is_nan() || norm <= 0.1 {
        return [1.0, 0.0, 0.0, 0.0];
    }
    let roll = math::atan2(-force.y, -force.z);
    let pitch = math::atan2(force.x, math::sqrt(force.y * force.y + force.z * force.z));
    let (sr, cr) = math::sin_cos(0.5 * roll);
    let (sp, cp) = math::sin_cos(0.5 * pitch);
    [cr * cp, sr * cp, cr * sp, -sr * sp]
}
