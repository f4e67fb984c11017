//! Force and torque to thrust per motor, for any airframe of fixed rotors.
//!
//! A rotor at (x, y) that pushes with thrust T along −z adds −y·T of roll, x·T of pitch and ±κ·T of yaw torque (κ:
//! drag torque per thrust; positive for a rotor that turns counter-clockwise seen from above). Stacked, that is a 4×N
//! matrix; the mixer is its Moore–Penrose inverse, for four rotors the plain inverse.
//!
//! The inverse is computed when the mixer is made, in constants if need be: a vehicle's mixer can be a `const`, and an
//! airframe that cannot be flown then does not compile.
//!
//! Motors can neither pull nor push without end. When a demand does not fit, it is given up in this order: yaw
//! first, then thrust, roll and pitch last, because they decide about up and down. What was given up is reported, so
//! that integrators can stop.

use stampfly_types::messages::{ControlOutput, MAX_MOTORS};

use crate::airframe::{Airframe, Rotor};
use crate::bound::{symmetric, within};

/// Thrust per motor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mixed {
    /// Thrust per motor, N; zero beyond `count`.
    pub thrust: [f32; MAX_MOTORS],
    /// How many motors there are.
    pub count: u8,
    /// Shares of the demand that were given up: roll, pitch, yaw (0 to 1) and thrust. The last is negative when more
    /// thrust than asked was needed for roll and pitch.
    pub unmet: [f32; 4],
}

/// Anything that distributes force and torque over motors.
///
/// # Contract
/// * Every thrust is finite and within the motors' limits, whatever the demand.
/// * A demand that fits is met exactly; otherwise `unmet` says what is missing.
pub trait Mixer {
    /// Distributes the demand.
    fn mix(&self, demand: &ControlOutput) -> Mixed;
}

/// Why an airframe cannot be flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GeometryError {
    /// Fewer than four rotors, or more than [`MAX_MOTORS`].
    Count,
    /// Some combination of thrust, roll, pitch and yaw cannot be produced, or a number is not finite.
    Uncontrollable,
    /// Equal thrust on all rotors would tip it over: some rotor has no positive share in collective thrust.
    Unbalanced,
}

impl core::fmt::Display for GeometryError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Count => "between four and eight rotors are needed",
            Self::Uncontrollable => "the rotors cannot produce every torque",
            Self::Unbalanced => "every rotor must share in collective thrust",
        })
    }
}

impl core::error::Error for GeometryError {}

/// One rotor's share of each demand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Shares {
    thrust: f32,
    /// One over `thrust`.
    collective: f32,
    roll: f32,
    pitch: f32,
    yaw: f32,
}

/// The mixer of a multirotor with fixed, parallel rotors.
///
/// ```
/// use stampfly_control::{Airframe, Mixer, MultirotorMixer};
/// use stampfly_types::{Vec3, messages::ControlOutput};
/// let mixer = MultirotorMixer::for_airframe(&Airframe::EXAMPLE)?;
/// let right = mixer.mix(&ControlOutput { thrust: 4.9, torque: Vec3::new(0.05, 0.0, 0.0) });
/// let [front_right, rear_right, rear_left, front_left, ..] = right.thrust;
/// assert!(front_left > front_right && rear_left > rear_right, "more on the left rolls to the right");
/// assert_eq!(right.unmet, [0.0; 4]);
/// # Ok::<(), stampfly_control::GeometryError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MultirotorMixer {
    thrust_min: f32,
    shares: [Shares; MAX_MOTORS],
    #[cfg_attr(feature = "serde", serde(deserialize_with = "up_to_max_motors"))]
    count: usize,
    thrust_max: f32,
}

/// Refuses more rotors than there are shares.
#[cfg(feature = "serde")]
fn up_to_max_motors<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
    let count = serde::Deserialize::deserialize(deserializer)?;
    if count <= MAX_MOTORS { Ok(count) } else { Err(serde::de::Error::custom("too many rotors")) }
}

impl MultirotorMixer {
    /// The mixer of an airframe.
    ///
    /// # Errors
    /// When there are too few or too many rotors or they cannot control the vehicle.
    pub const fn for_airframe(airframe: &Airframe) -> Result<Self, GeometryError> {
        Self::from_rotors(airframe.rotors, airframe.motor_thrust_max)
    }

    /// The mixer of any rotors whose motors can push with 0 to `thrust_max` N each.
    ///
    /// # Errors
    /// When there are too few or too many rotors or they cannot control the vehicle.
    pub const fn from_rotors(rotors: &[Rotor], thrust_max: f32) -> Result<Self, GeometryError> {
        if rotors.len() < 4 || rotors.len() > MAX_MOTORS {
            return Err(GeometryError::Count);
        }
        if !(thrust_max > 0.0 && thrust_max.is_finite()) {
            return Err(GeometryError::Uncontrollable);
        }
        // Torque in units of the airframe's own size, or the inverse of a small vehicle drowns in rounding.
        let (mut arm, mut drag) = (0.0f32, 0.0f32);
        let mut n = 0;
        while n < rotors.len() {
            arm = arm.max(rotors[n].x.abs()).max(rotors[n].y.abs());
            drag = drag.max(rotors[n].kappa.abs());
            n += 1;
        }
        // Without an arm or drag, or with one that is not finite, a column holds no numbers, and has no inverse.
        let Some(inverse) = inverse(gram(rotors, arm, drag)) else { return Err(GeometryError::Uncontrollable) };
        let none = Shares { thrust: 0.0, collective: 0.0, roll: 0.0, pitch: 0.0, yaw: 0.0 };
        let mut shares = [none; MAX_MOTORS];
        let mut n = 0;
        while n < rotors.len() {
            let column = column(&rotors[n], arm, drag);
            let thrust = product(&inverse[0], &column);
            if thrust < 1e-3 {
                return Err(GeometryError::Unbalanced);
            }
            shares[n] = Shares {
                thrust,
                collective: 1.0 / thrust,
                roll: product(&inverse[1], &column) / arm,
                pitch: product(&inverse[2], &column) / arm,
                yaw: product(&inverse[3], &column) / drag,
            };
            n += 1;
        }
        Ok(Self { thrust_min: 0.0, shares, count: rotors.len(), thrust_max })
    }

    /// The same for motors that push with at least `thrust_min` N, in place of zero. Above zero are motors that must not stop in the air:
    /// [`MotorConfig::idle_thrust`](crate::MotorConfig::idle_thrust) says what idling pushes. Below zero are motors that reverse, for
    /// flight on the back.
    ///
    /// ```
    /// use stampfly_control::{Mixer, MultirotorMixer, Rotor};
    /// use stampfly_types::{Vec3, messages::ControlOutput};
    /// let rotors = Rotor::quadrotor_plus(0.2, 0.015);
    /// let mixer = MultirotorMixer::from_rotors(&rotors, 5.0)?.with_thrust_min(0.2)?;
    /// let demand = ControlOutput { thrust: 0.0, torque: Vec3::new(0.1, 0.0, 0.0) };
    /// let mixed = mixer.mix(&demand);
    /// assert!(mixed.thrust[..4].iter().all(|thrust| *thrust >= 0.2), "none stops, and it still rolls");
    /// assert!((0.2 * (mixed.thrust[1] - mixed.thrust[0]) - 0.1).abs() < 1e-6);
    /// # Ok::<(), stampfly_control::GeometryError>(())
    /// ```
    ///
    /// # Errors
    /// [`GeometryError::Uncontrollable`] when no collective thrust is left between the least and the largest, or the number is none.
    pub const fn with_thrust_min(self, thrust_min: f32) -> Result<Self, GeometryError> {
        if !(thrust_min > -1e6 && thrust_min < self.thrust_max) {
            return Err(GeometryError::Uncontrollable);
        }
        // Where some rotors carry more than others, one may be at its largest before another is at its least.
        let (mut low, mut high) = (f32::MIN, f32::MAX);
        let mut n = 0;
        while n < self.count && n < MAX_MOTORS {
            low = low.max(thrust_min * self.shares[n].collective);
            high = high.min(self.thrust_max * self.shares[n].collective);
            n += 1;
        }
        if low < high { Ok(Self { thrust_min, ..self }) } else { Err(GeometryError::Uncontrollable) }
    }

    /// Largest share of `tilt` (each rotor's part of roll and pitch) for which some collective thrust keeps every
    /// motor within its limits.
    fn tilt_scale(&self, tilt: &[f32; MAX_MOTORS]) -> f32 {
        let mut scale = 1.0f32;
        let rotors = || self.shares.iter().zip(tilt).take(self.count);
        // Collective u must satisfy min − s·p_i ≤ a_i·u and a_j·u ≤ max − s·p_j for all pairs.
        for (lower, p_lower) in rotors() {
            for (upper, p_upper) in rotors() {
                let spread = p_upper * upper.collective - p_lower * lower.collective;
                let room = self.thrust_max * upper.collective - self.thrust_min * lower.collective;
                if scale * spread > room {
                    scale = room / spread;
                }
            }
        }
        scale
    }

    /// The collective thrusts for which every motor can deliver this much roll and pitch.
    fn collective_range(&self, tilt: &[f32; MAX_MOTORS]) -> (f32, f32) {
        // Roll and pitch add nothing to the sum of all thrusts.
        let (mut low, mut high) = (self.thrust_min * self.count as f32, f32::MAX);
        for (share, part) in self.shares.iter().zip(tilt).take(self.count) {
            // Compared by hand: `min` and `max` are calls on cores whose FPU has neither.
            let (least, most) =
                ((self.thrust_min - part) * share.collective, (self.thrust_max - part) * share.collective);
            low = if least > low { least } else { low };
            high = if most < high { most } else { high };
        }
        (low, high)
    }
}

impl Mixer for MultirotorMixer {
    #[inline]
    fn mix(&self, demand: &ControlOutput) -> Mixed {
        // Far beyond any airframe, and small enough that no product below overflows.
        let number = |value: f32| if value.is_finite() { symmetric(value, 1e6) } else { 0.0 };
        let wanted = number(demand.thrust);
        let (roll, pitch, yaw) = (number(demand.torque.x), number(demand.torque.y), number(demand.torque.z));

        let mut tilt = [0.0; MAX_MOTORS];
        for (part, share) in tilt.iter_mut().zip(&self.shares).take(self.count) {
            *part = share.roll * roll + share.pitch * pitch;
        }
        let (mut low, mut high) = self.collective_range(&tilt);
        let mut tilt_scale = 1.0;
        if low > high {
            tilt_scale = self.tilt_scale(&tilt);
            tilt.iter_mut().for_each(|part| *part *= tilt_scale);
            (low, high) = self.collective_range(&tilt);
        }
        // Rounding may leave the range inside out by one bit.
        let collective = wanted.min(high).max(low);

        let mut mixed = Mixed { count: self.count as u8, ..Mixed::default() };
        let mut yaw_scale = 1.0f32;
        for ((thrust, share), part) in mixed.thrust.iter_mut().zip(&self.shares).zip(&tilt).take(self.count) {
            *thrust = within(share.thrust * collective + part, self.thrust_min, self.thrust_max);
            let twist = share.yaw * yaw;
            let room = if twist > 0.0 { self.thrust_max - *thrust } else { *thrust - self.thrust_min };
            if yaw_scale * twist.abs() > room {
                yaw_scale = room / twist.abs();
            }
        }
        for (thrust, share) in mixed.thrust.iter_mut().zip(&self.shares).take(self.count) {
            *thrust = within(*thrust + yaw_scale * share.yaw * yaw, self.thrust_min, self.thrust_max);
        }
        let missing = wanted - collective;
        let unmet_thrust = if missing == 0.0 { 0.0 } else { symmetric(missing / wanted.abs().max(1e-3), 1.0) };
        mixed.unmet = [1.0 - tilt_scale, 1.0 - tilt_scale, 1.0 - yaw_scale, unmet_thrust];
        mixed
    }
}

type Matrix = [[f32; 4]; 4];

/// What one rotor adds to thrust, roll, pitch and yaw, torque in units of `arm` and `drag`.
const fn column(rotor: &Rotor, arm: f32, drag: f32) -> [f32; 4] {
    [1.0, -rotor.y / arm, rotor.x / arm, rotor.yaw_arm() / drag]
}

const fn product(a: &[f32; 4], b: &[f32; 4]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// The sum of each rotor's column times itself.
const fn gram(rotors: &[Rotor], arm: f32, drag: f32) -> Matrix {
    let mut gram = [[0.0; 4]; 4];
    let mut n = 0;
    while n < rotors.len() {
        let column = column(&rotors[n], arm, drag);
        let mut row = 0;
        while row < 4 {
            let mut place = 0;
            while place < 4 {
                gram[row][place] += column[row] * column[place];
                place += 1;
            }
            row += 1;
        }
        n += 1;
    }
    gram
}

/// The inverse by Gauss and Jordan, without exchanging rows: the matrix is symmetric and not negative, so its diagonal
/// holds the pivots. `None` when it is nearly singular or holds no numbers.
const fn inverse(mut matrix: Matrix) -> Option<Matrix> {
    let mut inverse = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let mut determinant = 1.0f32;
    let mut pivot = 0;
    while pivot < 4 {
        let diagonal = matrix[pivot][pivot];
        if diagonal.is_nan() || diagonal <= 0.0 {
            return None;
        }
        determinant *= diagonal;
        let mut place = 0;
        while place < 4 {
            matrix[pivot][place] /= diagonal;
            inverse[pivot][place] /= diagonal;
            place += 1;
        }
        let mut row = 0;
        while row < 4 {
            let factor = matrix[row][pivot];
            let mut place = 0;
            while row != pivot && place < 4 {
                matrix[row][place] -= factor * matrix[pivot][place];
                inverse[row][place] -= factor * inverse[pivot][place];
                place += 1;
            }
            row += 1;
        }
        pivot += 1;
    }
    // The determinant of a well-spread airframe is of the order of N⁴; a singular one leaves only rounding.
    if determinant < 1e-4 { None } else { Some(inverse) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::airframe::Spin;
    use proptest::prelude::*;
    use stampfly_types::Vec3;
    use std::vec::Vec;

    const QUADROTOR: Airframe = Airframe::EXAMPLE;
    const MIXER: MultirotorMixer = match MultirotorMixer::for_airframe(&QUADROTOR) {
        Ok(mixer) => mixer,
        Err(_) => panic!("it flies"),
    };

    /// Thrust and torque that the rotors produce: the definition, not the inverse.
    fn produced(rotors: &[Rotor], mixed: &Mixed) -> ControlOutput {
        rotors.iter().zip(mixed.thrust).fold(ControlOutput::default(), |sum, (rotor, thrust)| ControlOutput {
            thrust: sum.thrust + thrust,
            torque: sum.torque + Vec3::new(-rotor.y, rotor.x, rotor.yaw_arm()) * thrust,
        })
    }

    fn hexacopter() -> Vec<Rotor> {
        ring(6)
    }

    /// So many rotors on a circle.
    fn ring(count: u8) -> Vec<Rotor> {
        (0..count)
            .map(|n| {
                let angle = f64::from(n) * core::f64::consts::TAU / f64::from(count) + 0.3;
                Rotor {
                    x: 0.2 * angle.cos() as f32,
                    y: 0.2 * angle.sin() as f32,
                    spin: if n % 2 == 0 { Spin::Clockwise } else { Spin::CounterClockwise },
                    kappa: 0.016,
                }
            })
            .collect()
    }

    /// Four rotors at four distances, each with a share of its own.
    fn askew() -> Vec<Rotor> {
        let spins = [Spin::CounterClockwise, Spin::Clockwise, Spin::CounterClockwise, Spin::Clockwise];
        let places = [(0.05, 0.06), (-0.04, 0.05), (-0.06, -0.04), (0.045, -0.055)];
        let drags = [0.01, 0.012, 0.009, 0.011];
        places.into_iter().zip(spins).zip(drags).map(|(((x, y), spin), kappa)| Rotor { x, y, spin, kappa }).collect()
    }

    #[test]
    fn rotors_that_stand_nearly_in_line_are_refused() {
        let squeezed = |share: f32| Rotor::quadrotor_x(0.05, 0.01).map(|rotor| Rotor { y: rotor.y * share, ..rotor });
        assert_eq!(MultirotorMixer::from_rotors(&squeezed(3e-4), 0.2), Err(GeometryError::Uncontrollable));
        assert!(MultirotorMixer::from_rotors(&squeezed(0.01), 0.2).is_ok());
    }

    #[test]
    fn a_square_has_the_inverse_that_can_be_written_down() {
        for (share, rotor) in MIXER.shares.iter().zip(QUADROTOR.rotors) {
            let closed = [0.25, -0.25 / rotor.y, 0.25 / rotor.x, 0.25 / rotor.yaw_arm()];
            for (a, b) in [share.thrust, share.roll, share.pitch, share.yaw].into_iter().zip(closed) {
                assert!((a - b).abs() <= 1e-6 * b.abs(), "{a} against {b}");
            }
        }
    }

    #[test]
    fn airframes_that_cannot_fly_are_refused() {
        let rotors = Rotor::quadrotor_x(0.05, 0.01);
        assert_eq!(MultirotorMixer::from_rotors(&rotors[..3], 0.2), Err(GeometryError::Count));
        let one_way = rotors.map(|rotor| Rotor { spin: Spin::Clockwise, ..rotor });
        assert_eq!(MultirotorMixer::from_rotors(&one_way, 0.2), Err(GeometryError::Uncontrollable));
        let in_line = rotors.map(|rotor| Rotor { y: 0.0, ..rotor });
        assert_eq!(MultirotorMixer::from_rotors(&in_line, 0.2), Err(GeometryError::Uncontrollable));
        let broken = rotors.map(|rotor| Rotor { x: f32::NAN, ..rotor });
        assert_eq!(MultirotorMixer::from_rotors(&broken, 0.2), Err(GeometryError::Uncontrollable));
        let beside = rotors.map(|rotor| Rotor { x: rotor.x + 0.2, ..rotor });
        assert_eq!(MultirotorMixer::from_rotors(&beside, 0.2), Err(GeometryError::Unbalanced));
    }

    #[test]
    fn four_to_eight_rotors_fly() {
        for (count, flies) in [(3, false), (4, true), (8, true), (9, false)] {
            let made = MultirotorMixer::from_rotors(&ring(count), 4.0).map(|mixer| mixer.count);
            assert_eq!(made, if flies { Ok(count.into()) } else { Err(GeometryError::Count) }, "{count}");
        }
        assert_eq!(MultirotorMixer::from_rotors(&ring(4), f32::INFINITY), Err(GeometryError::Uncontrollable));
    }

    #[cfg(feature = "serde")]
    #[test]
    fn what_is_read_has_no_more_rotors_than_shares() {
        let mut stored = serde_json::to_value(&MIXER).expect("a value");
        let mut read = |count: usize| {
            stored["count"] = count.into();
            serde_json::from_value::<MultirotorMixer>(stored.clone()).ok()
        };
        assert_eq!(read(MIXER.count), Some(MIXER));
        assert_eq!([MAX_MOTORS, MAX_MOTORS + 1].map(|count| read(count).is_some()), [true, false]);
    }

    #[test]
    fn a_least_thrust_that_leaves_nothing_is_refused() {
        for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, QUADROTOR.motor_thrust_max, 9.0] {
            assert_eq!(MIXER.with_thrust_min(wrong), Err(GeometryError::Uncontrollable), "{wrong}");
        }
        assert_eq!(MIXER.with_thrust_min(0.0), Ok(MIXER));
    }

    #[test]
    fn broken_demands_are_zero() {
        let mixed = MIXER.mix(&ControlOutput { thrust: f32::NAN, torque: Vec3::repeat(f32::INFINITY) });
        assert_eq!(mixed.thrust, [0.0; MAX_MOTORS]);
    }

    prop_compose! {
        /// In shares of what the rotors can do, and beyond.
        fn demands()(thrust in -0.3f32..1.8, x in -2.6f32..2.6, y in -2.6f32..2.6, z in -3.0f32..3.0)
            -> ControlOutput
        {
            ControlOutput { thrust, torque: Vec3::new(x, y, z) }
        }
    }

    /// A demand in N and N·m from its shares.
    fn demand_on(rotors: &[Rotor], thrust_max: f32, shares: &ControlOutput) -> ControlOutput {
        let reach = rotors.iter().fold(Vec3::zeros(), |sum, r| sum + Vec3::new(r.y.abs(), r.x.abs(), r.kappa));
        ControlOutput {
            thrust: shares.thrust * thrust_max * rotors.len() as f32,
            torque: shares.torque.component_mul(&reach) * (0.5 * thrust_max),
        }
    }

    /// Checks all promises for one airframe.
    fn keeps_its_promises(rotors: &[Rotor], thrust_max: f32, shares: &ControlOutput) -> Result<(), TestCaseError> {
        let demand = &demand_on(rotors, thrust_max, shares);
        let mixer = MultirotorMixer::from_rotors(rotors, thrust_max).expect("flies");
        let mixed = mixer.mix(demand);
        let got = produced(rotors, &mixed);
        let arm = rotors.iter().fold(0.0f32, |arm, r| arm.max(r.x.abs()).max(r.y.abs()));
        let fine = 1e-4 * thrust_max;
        for thrust in mixed.thrust {
            prop_assert!((0.0..=thrust_max).contains(&thrust));
        }
        // Roll and pitch keep their direction, and their size unless no collective at all could give it.
        let kept = 1.0 - mixed.unmet[0];
        prop_assert!((got.torque.x - kept * demand.torque.x).abs() < fine * arm);
        prop_assert!((got.torque.y - kept * demand.torque.y).abs() < fine * arm);
        let part: Vec<f32> = mixer
            .shares
            .iter()
            .take(rotors.len())
            .map(|s| s.roll * demand.torque.x + s.pitch * demand.torque.y)
            .collect();
        let feasible = |scale: f32| {
            (0..1000).any(|n| {
                let collective = n as f32 / 999.0 * thrust_max * rotors.len() as f32;
                let fits = |(s, p): (&Shares, &f32)| (0.0..=thrust_max).contains(&(s.thrust * collective + scale * p));
                mixer.shares.iter().zip(&part).all(fits)
            })
        };
        prop_assert!(!feasible(1.0) || mixed.unmet[0] < 1e-4, "roll and pitch were possible and given up");
        prop_assert!(mixed.unmet[0] == 0.0 || !feasible(1.0));
        prop_assert!(mixed.unmet[0] == 0.0 || !feasible(1.01 * kept), "more of roll and pitch was possible: {kept}");
        prop_assert_eq!((mixed.count as usize, mixed.unmet[0]), (rotors.len(), mixed.unmet[1]));
        // Yaw keeps its sign.
        let yaw_kept = 1.0 - mixed.unmet[2];
        prop_assert!((-1e-6..=1.0).contains(&yaw_kept));
        prop_assert!((got.torque.z - yaw_kept * demand.torque.z).abs() < fine * 0.02);
        // Thrust: the report is right.
        let missing = mixed.unmet[3] * demand.thrust.abs().max(1e-3);
        if mixed.unmet[3].abs() < 1.0 {
            prop_assert!((demand.thrust - got.thrust - missing).abs() < 10.0 * fine);
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]
        #[test]
        fn a_quadrotor_keeps_its_promises(demand in demands()) {
            keeps_its_promises(QUADROTOR.rotors, QUADROTOR.motor_thrust_max, &demand)?;
        }

        #[test]
        fn a_hexacopter_keeps_them_too(demand in demands()) {
            keeps_its_promises(&hexacopter(), 4.0, &demand)?;
        }

        #[test]
        fn rotors_that_stand_askew_keep_them_too(demand in demands()) {
            keeps_its_promises(&askew(), 0.3, &demand)?;
        }

        #[test]
        fn a_demand_that_fits_is_met_exactly(
            thrust in 0.38f32..0.65, x in -0.12f32..0.12, y in -0.12f32..0.12, z in -0.12f32..0.12,
        ) {
            let shares = ControlOutput { thrust, torque: Vec3::new(x, y, z) };
            let demand = demand_on(QUADROTOR.rotors, QUADROTOR.motor_thrust_max, &shares);
            let mixed = MIXER.mix(&demand);
            let got = produced(QUADROTOR.rotors, &mixed);
            prop_assert_eq!(mixed.unmet, [0.0; 4]);
            prop_assert!((got.thrust - demand.thrust).abs() < 1.4e-6 * QUADROTOR.full_thrust());
            prop_assert!((got.torque - demand.torque).norm() < 2e-6 * QUADROTOR.torque_limit().x);
        }

        #[test]
        fn motors_that_idle_or_reverse_keep_within_their_limits(
            shares in demands(), low in -1f32..0.2, which in 0usize..3,
        ) {
            let rotors = [QUADROTOR.rotors.to_vec(), hexacopter(), ring(8)][which].clone();
            let (max, min) = (2.3, 2.3 * low);
            let mixer = MultirotorMixer::from_rotors(&rotors, max).and_then(|mixer| mixer.with_thrust_min(min)).expect("flies");
            let demand = demand_on(&rotors, max, &shares);
            let mixed = mixer.mix(&demand);
            let got = produced(&rotors, &mixed);
            for thrust in mixed.thrust.iter().take(rotors.len()) {
                prop_assert!((min..=max).contains(thrust), "{thrust} below {min}");
            }
            // Roll and pitch first: what is reported is what is made, and all of it while any collective thrust gives it.
            let kept = 1.0 - mixed.unmet[0];
            prop_assert!((got.torque.x - kept * demand.torque.x).abs() < 1e-3 * max);
            prop_assert!((got.torque.y - kept * demand.torque.y).abs() < 1e-3 * max);
            prop_assert!((got.torque.z - (1.0 - mixed.unmet[2]) * demand.torque.z).abs() < 1e-4 * max);
            let parts: Vec<f32> = mixer.shares.iter().take(rotors.len())
                .map(|s| s.roll * demand.torque.x + s.pitch * demand.torque.y).collect();
            let spread = parts.iter().fold(f32::MIN, |a, b| a.max(*b)) - parts.iter().fold(f32::MAX, |a, b| a.min(*b));
            prop_assert!(spread > 0.999 * (max - min) || mixed.unmet[0] < 1e-3, "given up without need");
        }

        #[test]
        fn any_bits_give_possible_thrusts(thrust: f32, x: f32, y: f32, z: f32) {
            let mixed = MIXER.mix(&ControlOutput { thrust, torque: Vec3::new(x, y, z) });
            for thrust in mixed.thrust {
                prop_assert!((0.0..=QUADROTOR.motor_thrust_max).contains(&thrust));
            }
            prop_assert!(mixed.unmet.iter().all(|share| share.is_finite()));
        }
    }

    #[test]
    fn rotors_that_cannot_control_are_refused_with_the_reason() {
        let made = |rotors: &[Rotor], thrust| MultirotorMixer::from_rotors(rotors, thrust).map(|_| ());
        let rotors = QUADROTOR.rotors;
        let flat: Vec<_> = rotors.iter().map(|rotor| Rotor { x: 0.0, y: 0.0, ..*rotor }).collect();
        let with_x = |x: f32| rotors.iter().map(|rotor| Rotor { x, ..*rotor }).collect::<Vec<_>>();
        let with_kappa = |kappa: f32| rotors.iter().map(|rotor| Rotor { kappa, ..*rotor }).collect::<Vec<_>>();
        let without_drag: Vec<_> = rotors.iter().map(|rotor| Rotor { kappa: 0.0, ..*rotor }).collect();
        for (case, reason) in [
            (made(&rotors[..3], 0.1), GeometryError::Count),
            (made(rotors, f32::NAN), GeometryError::Uncontrollable),
            (made(rotors, 0.0), GeometryError::Uncontrollable),
            (made(&flat, 0.1), GeometryError::Uncontrollable),
            (made(&without_drag, 0.1), GeometryError::Uncontrollable),
            (made(&with_x(f32::INFINITY), 0.1), GeometryError::Uncontrollable),
            (made(&with_x(f32::NAN), 0.1), GeometryError::Uncontrollable),
            (made(&with_kappa(f32::INFINITY), 0.1), GeometryError::Uncontrollable),
            (made(&with_kappa(f32::NAN), 0.1), GeometryError::Uncontrollable),
        ] {
            assert_eq!(case, Err(reason));
        }
        let words = [GeometryError::Count, GeometryError::Uncontrollable, GeometryError::Unbalanced]
            .map(|e| std::format!("{e}"));
        assert!(
            words[0].contains("four and eight") && words[1].contains("torque") && words[2].contains("share"),
            "{words:?}"
        );
    }
}
