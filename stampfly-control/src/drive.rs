//! Vehicles on wheels: speed and turn to wheels that push apart ([`Differential`]) or to a wheel that steers ([`Ackermann`]).
//!
//! Use them for a rover, whose two motors no [`MultirotorMixer`](crate::MultirotorMixer) takes. What comes out is a share of what a wheel
//! can do, −1 to 1, and an angle: feed the shares to motors that can reverse. They know no slip; a vehicle on tracks that skids turns
//! less than asked, and a loop on the measured turn makes up for it.
//!
//! Body frame FRD: forward and right are positive, so a positive turn goes right, clockwise seen from above.

use stampfly_types::math;

use crate::bound::symmetric;

/// A share or an angle that was wanted, without what is no number.
fn number(value: f32) -> f32 {
    if value.is_finite() { value } else { 0.0 }
}

/// Two sides that push apart: wheels, tracks, or two screws of a boat.
///
/// ```
/// use stampfly_control::drive::Differential;
/// let rover = Differential { track: 0.4, speed_max: 2.0 };
/// assert_eq!(rover.mix(1.0, 0.0), [0.5, 0.5]);
/// // On the spot to the right: the left side forward, the right side back.
/// assert_eq!(rover.mix(0.0, 2.0), [0.2, -0.2]);
/// // Too fast to turn so: it slows down rather than go straight on.
/// assert_eq!(rover.mix(2.0, 2.0), [1.0, 0.6]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Differential {
    /// Distance of the sides from each other, m.
    pub track: f32,
    /// Speed of a side at full power, m/s.
    pub speed_max: f32,
}

impl Differential {
    /// Shares of full power, −1 to 1, left and right, for a speed forward, m/s, and a turn, rad/s. When both do not fit, speed is given up
    /// first: a vehicle that turns too late hits what it turns away from. What is no number is zero.
    #[must_use]
    pub fn mix(&self, speed: f32, turn: f32) -> [f32; 2] {
        let share = |speed: f32| symmetric(number(speed / self.speed_max), 1.0);
        let turn = share(number(turn) * 0.5 * self.track);
        let room = 1.0 - turn.abs();
        let ahead = symmetric(share(number(speed)), room);
        [ahead + turn, ahead - turn]
    }
}

/// A car: it turns by steering its front wheels, and only while it moves.
///
/// ```
/// use stampfly_control::drive::Ackermann;
/// let car = Ackermann { wheelbase: 0.3, speed_max: 4.0, angle_max: 0.5 };
/// // 0.3 m between the axles and a circle of 3 m: the angle's tangent is a tenth.
/// let [power, angle] = car.mix(2.0, 2.0 / 3.0);
/// assert!((power - 0.5).abs() < 1e-6 && (stampfly_types::math::tan(angle) - 0.1).abs() < 1e-6);
/// // Backwards the wheels point the other way for the same turn.
/// assert!(car.mix(-2.0, 2.0 / 3.0)[1] < 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ackermann {
    /// Distance of the axles from each other, m.
    pub wheelbase: f32,
    /// Speed at full power, m/s.
    pub speed_max: f32,
    /// Largest angle of the wheels, rad.
    pub angle_max: f32,
}

impl Ackermann {
    /// Share of full power, −1 to 1, and angle of the steered wheels, rad, for a speed forward, m/s, and a turn, rad/s. A vehicle that
    /// stands steers fully towards a turn it is asked for. The angle is that of the bicycle model, atan(wheelbase · turn / speed); a
    /// linkage makes the inner wheel's larger. What is no number is zero.
    #[must_use]
    pub fn mix(&self, speed: f32, turn: f32) -> [f32; 2] {
        let (speed, turn) = (number(speed), number(turn));
        let across = number(self.wheelbase * turn);
        let angle = if across == 0.0 {
            0.0
        } else if speed < 0.0 {
            math::atan2(-across, -speed)
        } else {
            math::atan2(across, speed)
        };
        [symmetric(number(speed / self.speed_max), 1.0), symmetric(number(angle), self.angle_max)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ROVER: Differential = Differential { track: 0.4, speed_max: 2.0 };
    const CAR: Ackermann = Ackermann { wheelbase: 0.3, speed_max: 4.0, angle_max: 0.5 };

    proptest! {
        #[test]
        fn two_sides_make_the_turn_that_is_asked_and_as_much_of_the_speed_as_fits(
            speed in -4f32..4.0, turn in -20f32..20.0,
        ) {
            let [left, right] = ROVER.mix(speed, turn);
            prop_assert!(left.abs() <= 1.0 + 1e-6 && right.abs() <= 1.0 + 1e-6);
            // What the wheels make: the definition, not the inverse.
            let (ahead, turns) =
                (0.5 * (left + right) * ROVER.speed_max, (left - right) * ROVER.speed_max / ROVER.track);
            let turn_max = 2.0 * ROVER.speed_max / ROVER.track;
            prop_assert!((turns - turn.clamp(-turn_max, turn_max)).abs() < 1e-4, "{turns} of {turn}");
            let room = ROVER.speed_max - 0.5 * turns.abs() * ROVER.track;
            prop_assert!((ahead - speed.clamp(-room.max(0.0), room.max(0.0))).abs() < 1e-4, "{ahead} of {speed}");
        }

        #[test]
        fn a_car_turns_as_asked_forwards_and_backwards(speed in 0.5f32..4.0, turn in -0.9f32..0.9, back: bool) {
            let speed = if back { -speed } else { speed };
            let [power, angle] = CAR.mix(speed, turn);
            prop_assert!((power * CAR.speed_max - speed).abs() < 1e-5);
            let turns = power * CAR.speed_max * math::tan(angle) / CAR.wheelbase;
            prop_assert!((turns - turn).abs() < 1e-4 || angle.abs() == CAR.angle_max, "{turns} of {turn}");
        }

        #[test]
        fn no_bits_make_what_is_no_number(
            a: f32, b: f32, c: f32, speed: f32, turn: f32,
        ) {
            let sides = Differential { track: a, speed_max: b }.mix(speed, turn);
            let car = Ackermann { wheelbase: a, speed_max: b, angle_max: c }.mix(speed, turn);
            prop_assert!(sides.into_iter().chain(car).all(f32::is_finite), "{sides:?} {car:?}");
            prop_assert!(sides.into_iter().chain([car[0]]).all(|share| share.abs() <= 1.0 + 1e-6));
        }
    }
}
