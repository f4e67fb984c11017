//! Does the vehicle turn as it is asked to?
//!
//! One that a hand or the ground holds does not, and whatever an integral learns meanwhile is wrong once it is let go. What a stick
//! asks for comes at once, or never. The attitude loop is another matter: it asks for a rate that does not come wherever
//! a constant torque leans the vehicle, and the integral has to find that torque; but for no more than the integral can hold,
//! except in a take-off with its sticks at rest.
//!
//! For a loop with an integral or an estimate of what disturbs it. Not a detector of faults: a propeller that is lost turns the vehicle.

use crate::intent::{Heading, Horizontal, Intent};
use stampfly_types::Vec3;
use stampfly_types::math::smaller;

/// A rate that a stick asks for, rad/s; below this it is as well noise.
const ASKED: f32 = 0.3;
/// An axis that turns at less than this share of what is asked stands. One that a weak propeller turns the wrong way does not.
const STANDS: f32 = 0.25;
/// Propellers shake the rate by as much as is asked for; over this time, s, little is left of it.
const SMOOTHING: f32 = 0.05;

/// How the vehicle turned lately.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Answer {
    /// The body rate without its noise, rad/s.
    rate: Vec3,
}

impl Answer {
    /// The axes about which something keeps the vehicle from turning. `target` and `rate` in body axes, rad/s, `dt` seconds after the
    /// last; `trim`: the largest rate, rad/s, for which a tilt integral need not wait where no stick asks for rates.
    #[inline]
    pub(crate) fn step(&mut self, intent: &Intent, target: &Vec3, rate: &Vec3, trim: f32, dt: f32) -> [bool; 3] {
        // A division for each step would be dearer than the rest.
        self.rate += (rate - self.rate) * smaller(dt * (1.0 / SMOOTHING), 1.0);
        let tilt = if matches!(intent.horizontal, Horizontal::Rates { .. }) { ASKED } else { trim };
        let yaw = if matches!(intent.heading, Heading::Stick(_)) { ASKED } else { f32::MAX };
        [(target.x, self.rate.x, tilt), (target.y, self.rate.y, tilt), (target.z, self.rate.z, yaw)]
            .map(|(asked, rate, limit)| intent.grounded || (asked.abs() > limit && rate.abs() < STANDS * asked.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intent::Vertical;

    const DT: f32 = 0.0025;
    const STICKS: Horizontal = Horizontal::Rates { forward: 0.0, right: 1.0 };
    const LEVEL: Horizontal = Horizontal::Lean { forward: 0.0, right: 0.0 };

    /// Which axes are held after a tenth of a second.
    fn held(horizontal: Horizontal, grounded: bool, target: [f32; 3], rate: [f32; 3]) -> [bool; 3] {
        let (vertical, heading) = (Vertical::Throttle(0.5), Heading::Stick(0.0));
        let intent = Intent { horizontal, vertical, heading, grounded, tan_tilt_max: 1.0 };
        let mut answer = Answer::default();
        (0..40).map(|_| answer.step(&intent, &target.into(), &rate.into(), 1.8, DT)).last().unwrap_or_default()
    }

    #[test]
    fn an_axis_that_does_not_answer_is_held() {
        assert_eq!(held(STICKS, false, [2.0, 0.0, -2.0], [0.1, 0.0, 0.1]), [true, false, true]);
        assert_eq!(held(STICKS, false, [2.0, 0.2, 0.0], [1.0, 0.0, 0.0]), [false; 3], "it answers, or is hardly asked");
        assert_eq!(held(STICKS, false, [2.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), [false; 3], "a weak propeller turns it");
        assert_eq!(held(LEVEL, false, [1.5, 2.0, 0.0], [0.0; 3]), [false, true, false], "what an integral may find");
        assert_eq!(held(LEVEL, true, [0.0; 3], [0.0; 3]), [true; 3]);
    }

    #[test]
    fn noise_is_no_answer() {
        let intent = Intent {
            horizontal: STICKS,
            vertical: Vertical::Throttle(0.5),
            heading: Heading::Rate(0.0),
            grounded: false,
            tan_tilt_max: 1.0,
        };
        let mut answer = Answer::default();
        for step in 0..400 {
            let noise = if step % 2 == 0 { 3.0 } else { -3.0 };
            assert!(answer.step(&intent, &Vec3::x(), &Vec3::new(noise, 0.0, 0.0), 1.8, DT)[0], "step {step}");
        }
    }
}
