//! Where the rotors of the usual frames are: constructors of [`Rotor`] lists for an [`Airframe`](crate::Airframe).
//!
//! Use them instead of a table of one's own where the frame is regular. Motors are numbered and turn as in PX4's airframe reference, as
//! each constructor spells out: compare it with the frame before the propellers go on. [`Rotor::quadrotor_x`] has the order of the
//! StampFly, clockwise from the front right, and Y6 goes arm by arm.
//! All of them are `const`. `arm` is a rotor's distance from the centre of mass, m; `kappa` its drag torque per thrust, m.
//!
//! A tricopter is not here: it yaws by a rotor that tilts, which is no fixed rotor.

use crate::airframe::{Rotor, Spin};

const CCW: Spin = Spin::CounterClockwise;
const CW: Spin = Spin::Clockwise;
/// Sine of 22.5°, 30°, 45°, 60° and 67.5°.
const SIN_22: f32 = 0.382_683_43;
const SIN_30: f32 = 0.5;
const SIN_45: f32 = core::f32::consts::FRAC_1_SQRT_2;
const SIN_60: f32 = 0.866_025_4;
const SIN_67: f32 = 0.923_879_5;

/// Places in units of the arm, and senses.
const fn rotors<const N: usize>(places: [(f32, f32, Spin); N], arm: f32, kappa: f32) -> [Rotor; N] {
    let mut rotors = [Rotor { x: 0.0, y: 0.0, spin: CCW, kappa }; N];
    let mut n = 0;
    while n < N {
        let (x, y, spin) = places[n];
        rotors[n] = Rotor { x: x * arm, y: y * arm, spin, kappa };
        n += 1;
    }
    rotors
}

/// Regular frames.
///
/// ```
/// use stampfly_control::{Mixer, MultirotorMixer, Rotor};
/// use stampfly_types::{Vec3, messages::ControlOutput};
/// const ROTORS: [Rotor; 6] = Rotor::hexarotor_x(0.28, 0.016);
/// let mixer = MultirotorMixer::from_rotors(&ROTORS, 7.0)?;
/// let right = mixer.mix(&ControlOutput { thrust: 17.0, torque: Vec3::new(0.5, 0.0, 0.0) });
/// assert!(right.thrust[1] > right.thrust[0], "motor 2 is on the left");
/// # Ok::<(), stampfly_control::GeometryError>(())
/// ```
impl Rotor {
    /// Quadrotor X as in PX4: front right, rear left, front left, rear right; the first two counter-clockwise.
    #[must_use]
    pub const fn quadrotor_x_px4(arm: f32, kappa: f32) -> [Self; 4] {
        let s = SIN_45;
        rotors([(s, s, CCW), (-s, -s, CCW), (s, -s, CW), (-s, s, CW)], arm, kappa)
    }

    /// Quadrotor H: the places of [`Self::quadrotor_x_px4`], every rotor turning the other way, as frames in H usually have it.
    #[must_use]
    pub const fn quadrotor_h(arm: f32, kappa: f32) -> [Self; 4] {
        let s = SIN_45;
        rotors([(s, s, CW), (-s, -s, CW), (s, -s, CCW), (-s, s, CCW)], arm, kappa)
    }

    /// Quadrotor plus: right, left, front, rear; the first two counter-clockwise.
    #[must_use]
    pub const fn quadrotor_plus(arm: f32, kappa: f32) -> [Self; 4] {
        rotors([(0.0, 1.0, CCW), (0.0, -1.0, CCW), (1.0, 0.0, CW), (-1.0, 0.0, CW)], arm, kappa)
    }

    /// Hexarotor X, two arms to the sides: right, left, front left, rear right, front right, rear left.
    #[must_use]
    pub const fn hexarotor_x(arm: f32, kappa: f32) -> [Self; 6] {
        let (c, s) = (SIN_60, SIN_30);
        rotors([(0.0, 1.0, CW), (0.0, -1.0, CCW), (c, -s, CW), (-c, s, CCW), (c, s, CCW), (-c, -s, CW)], arm, kappa)
    }

    /// Hexarotor plus, one arm ahead: front, rear, rear left, front right, front left, rear right.
    #[must_use]
    pub const fn hexarotor_plus(arm: f32, kappa: f32) -> [Self; 6] {
        let (c, s) = (SIN_30, SIN_60);
        rotors([(1.0, 0.0, CW), (-1.0, 0.0, CCW), (-c, -s, CW), (c, s, CCW), (c, -s, CCW), (-c, s, CW)], arm, kappa)
    }

    /// Octorotor X: arms at 22.5°, 202.5°, 67.5°, 157.5°, 337.5°, 247.5°, 292.5° and 112.5° to the right of straight ahead.
    #[must_use]
    pub const fn octorotor_x(arm: f32, kappa: f32) -> [Self; 8] {
        let (c, s) = (SIN_67, SIN_22);
        let places = [
            (c, s, CW),
            (-c, -s, CW),
            (s, c, CCW),
            (-c, s, CCW),
            (c, -s, CCW),
            (-s, -c, CCW),
            (s, -c, CW),
            (-s, c, CW),
        ];
        rotors(places, arm, kappa)
    }

    /// Octorotor plus: front, rear, front right, rear right, front left, rear left, left, right.
    #[must_use]
    pub const fn octorotor_plus(arm: f32, kappa: f32) -> [Self; 8] {
        let s = SIN_45;
        let places = [
            (1.0, 0.0, CW),
            (-1.0, 0.0, CW),
            (s, s, CCW),
            (-s, s, CCW),
            (s, -s, CCW),
            (-s, -s, CCW),
            (0.0, -1.0, CW),
            (0.0, 1.0, CW),
        ];
        rotors(places, arm, kappa)
    }

    /// Coaxial octorotor X8: upper front right, front left, rear left, rear right, then lower front left, front right, rear right,
    /// rear left. The lower rotor of a pair turns against the upper one. It works in the upper one's wake; here both push alike.
    #[must_use]
    pub const fn coaxial_x8(arm: f32, kappa: f32) -> [Self; 8] {
        let s = SIN_45;
        let places = [
            (s, s, CCW),
            (s, -s, CW),
            (-s, -s, CCW),
            (-s, s, CW),
            (s, -s, CCW),
            (s, s, CW),
            (-s, s, CCW),
            (-s, -s, CW),
        ];
        rotors(places, arm, kappa)
    }

    /// Coaxial Y6, one arm to the rear: upper and lower rotor of the front right, the rear and the front left arm, every upper one clockwise.
    #[must_use]
    pub const fn coaxial_y6(arm: f32, kappa: f32) -> [Self; 6] {
        let (c, s) = (SIN_30, SIN_60);
        rotors([(c, s, CW), (c, s, CCW), (-1.0, 0.0, CW), (-1.0, 0.0, CCW), (c, -s, CW), (c, -s, CCW)], arm, kappa)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mixer::{Mixer, MultirotorMixer};
    use proptest::prelude::*;
    use stampfly_types::messages::ControlOutput;
    use stampfly_types::{Vec3, math};
    use std::vec::Vec;

    const ARM: f32 = 0.25;
    const KAPPA: f32 = 0.016;

    fn frames() -> [(&'static str, Vec<Rotor>); 9] {
        [
            ("quad X", Rotor::quadrotor_x_px4(ARM, KAPPA).to_vec()),
            ("quad H", Rotor::quadrotor_h(ARM, KAPPA).to_vec()),
            ("quad +", Rotor::quadrotor_plus(ARM, KAPPA).to_vec()),
            ("hexa X", Rotor::hexarotor_x(ARM, KAPPA).to_vec()),
            ("hexa +", Rotor::hexarotor_plus(ARM, KAPPA).to_vec()),
            ("octo X", Rotor::octorotor_x(ARM, KAPPA).to_vec()),
            ("octo +", Rotor::octorotor_plus(ARM, KAPPA).to_vec()),
            ("X8", Rotor::coaxial_x8(ARM, KAPPA).to_vec()),
            ("Y6", Rotor::coaxial_y6(ARM, KAPPA).to_vec()),
        ]
    }

    #[test]
    fn every_frame_is_balanced_and_as_wide_as_it_says() {
        for (name, rotors) in frames() {
            let sum = rotors.iter().fold([0.0; 3], |[x, y, turn], r| [x + r.x, y + r.y, turn + r.yaw_arm()]);
            assert!(sum.iter().all(|part| part.abs() < 1e-6), "{name}: {sum:?}");
            assert!(rotors.iter().all(|r| (math::sqrt(r.x * r.x + r.y * r.y) - ARM).abs() < 1e-6), "{name}");
        }
    }

    #[test]
    fn neighbours_on_a_ring_turn_against_each_other() {
        for (name, mut rotors) in frames().into_iter().take(7) {
            rotors.sort_by(|a, b| math::atan2(a.y, a.x).total_cmp(&math::atan2(b.y, b.x)));
            let against = |n: usize| rotors[n].spin != rotors[(n + 1) % rotors.len()].spin;
            assert!((0..rotors.len()).all(against), "{name}");
        }
    }

    proptest! {
        #[test]
        fn what_is_asked_is_what_the_rotors_make_and_yaw_goes_first(
            roll in -1f32..1.0, pitch in -1f32..1.0, yaw in -40f32..40.0, share in 0.3f32..0.7,
        ) {
            for (name, rotors) in frames() {
                let count = rotors.len() as f32;
                let torque = Vec3::new(0.05 * roll, 0.05 * pitch, 0.01 * yaw) * (ARM * count);
                let demand = ControlOutput { thrust: share * count * 4.0, torque };
                let mixed = MultirotorMixer::from_rotors(&rotors, 4.0).expect("it flies").mix(&demand);
                let made = rotors.iter().zip(mixed.thrust).fold(Vec3::zeros(), |sum, (rotor, thrust)| {
                    sum + Vec3::new(-rotor.y, rotor.x, rotor.yaw_arm()) * thrust
                });
                prop_assert_eq!((mixed.unmet[0], mixed.unmet[1]), (0.0, 0.0), "{}", name);
                prop_assert!((made.x - torque.x).abs() < 1e-4 && (made.y - torque.y).abs() < 1e-4, "{}", name);
                prop_assert!((made.z - (1.0 - mixed.unmet[2]) * torque.z).abs() < 1e-4, "{}", name);
                prop_assert!((mixed.thrust.iter().sum::<f32>() - demand.thrust).abs() < 1e-3, "{}", name);
            }
        }
    }
}
