//! The mixer of rotors that stand fixed and parallel.
//!
//! Nearly every step asks for what fits. Whether it does takes a comparison for each motor, all of them side by side; the
//! search for what to give up is apart, and runs when it does not.

use stampfly_types::messages::{ControlOutput, MAX_MOTORS};

use super::geometry::{GeometryError, Shares};
use super::{Mixed, Mixer};
use crate::airframe::{Airframe, Rotor};
use crate::bound::{symmetric, within};

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
    pub(super) shares: Shares,
    #[cfg_attr(feature = "serde", serde(deserialize_with = "up_to_max_motors"))]
    pub(super) count: usize,
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
        let shares = match Shares::of(rotors) {
            Ok(shares) => shares,
            Err(error) => return Err(error),
        };
        if !(thrust_max > 0.0 && thrust_max.is_finite()) {
            return Err(GeometryError::Uncontrollable);
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
            low = low.max(thrust_min * self.shares.collective[n]);
            high = high.min(self.thrust_max * self.shares.collective[n]);
            n += 1;
        }
        if low < high { Ok(Self { thrust_min, ..self }) } else { Err(GeometryError::Uncontrollable) }
    }

    /// Distributes the demand over motors that push with at most `available` N each in this step, as a battery under load
    /// lets them: [`MotorStage::thrust_max`](crate::MotorStage::thrust_max). More than the airframe's own limit counts as that.
    ///
    /// A limit that only the output stage knows cuts the motors that push hardest, all to the same duty, and with them
    /// roll and pitch.
    ///
    /// ```
    /// use stampfly_control::{Airframe, MultirotorMixer};
    /// use stampfly_types::{Vec3, messages::ControlOutput};
    /// let mixer = MultirotorMixer::for_airframe(&Airframe::EXAMPLE)?;
    /// let demand = ControlOutput { thrust: 9.0, torque: Vec3::new(0.05, 0.0, 0.0) };
    /// let mixed = mixer.mix_within(&demand, 1.5);
    /// let [front_right, rear_right, rear_left, front_left, ..] = mixed.thrust;
    /// assert!(front_left <= 1.5 && rear_left <= 1.5);
    /// assert!(front_right < front_left && rear_right < rear_left, "it still rolls to the right");
    /// assert_eq!(mixed.unmet[0], 0.0);
    /// assert!(mixed.unmet[3] > 0.3, "a third of the thrust is missing");
    /// # Ok::<(), stampfly_control::GeometryError>(())
    /// ```
    #[inline]
    #[must_use]
    pub fn mix_within(&self, demand: &ControlOutput, available: f32) -> Mixed {
        let most = if available < self.thrust_max { available } else { self.thrust_max };
        // Motors that idle push, however empty the battery is.
        let limits =
            Limits { least: self.thrust_min, most: if most > self.thrust_min { most } else { self.thrust_min } };
        // The usual number of motors as a constant: no loop is left of it.
        if self.count == 4 { self.spread(4, demand, limits) } else { self.spread(self.count, demand, limits) }
    }

    /// Distributes the demand over `count` motors.
    #[inline(always)]
    fn spread(&self, count: usize, demand: &ControlOutput, limits: Limits) -> Mixed {
        // Far beyond any airframe, and small enough that no product below overflows.
        let number = |value: f32| if value.is_finite() { symmetric(value, 1e6) } else { 0.0 };
        let wanted = number(demand.thrust);
        let (roll, pitch, yaw) = (number(demand.torque.x), number(demand.torque.y), number(demand.torque.z));
        let (shares, Limits { least, most }) = (&self.shares, limits);

        let mut tilt = [0.0; MAX_MOTORS];
        // Roll and pitch add nothing to the sum of all thrusts.
        let mut fits = wanted >= least * count as f32;
        let each = tilt.iter_mut().zip(&shares.roll).zip(&shares.pitch).zip(&shares.collective).take(count);
        for (((part, share_roll), share_pitch), collective) in each {
            *part = share_roll * roll + share_pitch * pitch;
            fits &= (least - *part) * collective <= wanted;
            fits &= wanted <= (most - *part) * collective;
        }
        let (mut collective, mut tilt_scale, mut unmet_thrust) = (wanted, 1.0, 0.0);
        if !fits {
            (collective, tilt_scale) = self.compromise(tilt, wanted, limits);
            tilt.iter_mut().for_each(|part| *part *= tilt_scale);
            unmet_thrust = symmetric((wanted - collective) / wanted.abs().max(1e-3), 1.0);
        }

        let (mut thrust, mut twist) = ([0.0; MAX_MOTORS], [0.0; MAX_MOTORS]);
        let mut fits = true;
        let each = thrust.iter_mut().zip(&mut twist).zip(&shares.thrust).zip(&tilt).zip(&shares.yaw).take(count);
        for ((((thrust, twist), share), part), share_yaw) in each {
            *thrust = within(share * collective + part, least, most);
            *twist = share_yaw * yaw;
            let room = if *twist > 0.0 { most - *thrust } else { *thrust - least };
            fits &= twist.abs() <= room;
        }
        let mut yaw_scale = 1.0;
        if !fits {
            yaw_scale = self.yaw_scale(thrust, twist, limits);
            twist.iter_mut().zip(&shares.yaw).for_each(|(twist, share)| *twist = yaw_scale * share * yaw);
        }
        for (thrust, twist) in thrust.iter_mut().zip(twist).take(count) {
            *thrust = within(*thrust + twist, least, most);
        }
        let unmet = [1.0 - tilt_scale, 1.0 - tilt_scale, 1.0 - yaw_scale, unmet_thrust];
        Mixed { thrust, count: count as u8, unmet }
    }

    /// The collective thrust nearest to what is wanted for which every motor can deliver roll and pitch, and the share of these that
    /// leaves such a thrust. `tilt` is each rotor's part of them.
    ///
    /// It goes on with slices: of an array of eight, compilers make eight copies of a loop that hardly ever runs.
    #[cold]
    #[inline(never)]
    pub(super) fn compromise(&self, tilt: [f32; MAX_MOTORS], wanted: f32, limits: Limits) -> (f32, f32) {
        let (collectives, tilt) = (of(&self.shares.collective, self.count), of(&tilt, self.count));
        let mut tilt_scale = 1.0;
        let (mut low, mut high) = limits.collective_range(collectives, tilt, tilt_scale);
        if low > high {
            tilt_scale = limits.tilt_scale(collectives, tilt);
            (low, high) = limits.collective_range(collectives, tilt, tilt_scale);
        }
        // Rounding may leave the range inside out by one bit.
        (wanted.min(high).max(low), tilt_scale)
    }

    /// Largest share of `twist` (each rotor's part of yaw) for which every motor stays within its limits.
    #[cold]
    #[inline(never)]
    fn yaw_scale(&self, thrust: [f32; MAX_MOTORS], twist: [f32; MAX_MOTORS], limits: Limits) -> f32 {
        let mut scale = 1.0f32;
        for (thrust, twist) in of(&thrust, self.count).iter().zip(twist) {
            let room = if twist > 0.0 { limits.most - thrust } else { thrust - limits.least };
            if scale * twist.abs() > room {
                scale = room / twist.abs();
            }
        }
        scale
    }
}

/// Least and largest thrust of each motor in this step, N.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub least: f32,
    pub most: f32,
}

impl Limits {
    /// Largest share of `tilt` for which some collective thrust keeps every motor within its limits.
    #[inline(never)]
    fn tilt_scale(self, collectives: &[f32], tilt: &[f32]) -> f32 {
        let mut scale = 1.0f32;
        let rotors = || collectives.iter().zip(tilt);
        // Collective u must satisfy min − s·p_i ≤ a_i·u and a_j·u ≤ max − s·p_j for all pairs.
        for (lower, p_lower) in rotors() {
            for (upper, p_upper) in rotors() {
                let spread = p_upper * upper - p_lower * lower;
                let room = self.most * upper - self.least * lower;
                if scale * spread > room {
                    scale = room / spread;
                }
            }
        }
        scale
    }

    /// The collective thrusts for which every motor can deliver this share of roll and pitch.
    #[inline(never)]
    fn collective_range(self, collectives: &[f32], tilt: &[f32], tilt_scale: f32) -> (f32, f32) {
        // Roll and pitch add nothing to the sum of all thrusts.
        let (mut low, mut high) = (self.least * tilt.len() as f32, f32::MAX);
        for (collective, part) in collectives.iter().zip(tilt) {
            let part = part * tilt_scale;
            // Compared by hand: `min` and `max` are calls on cores whose FPU has neither.
            let (least, most) = ((self.least - part) * collective, (self.most - part) * collective);
            low = if least > low { least } else { low };
            high = if most < high { most } else { high };
        }
        (low, high)
    }
}

/// As many as there are motors.
#[inline(always)]
fn of(values: &[f32; MAX_MOTORS], count: usize) -> &[f32] {
    values.get(..count).unwrap_or_default()
}

impl Mixer for MultirotorMixer {
    #[inline]
    fn mix(&self, demand: &ControlOutput) -> Mixed {
        self.mix_within(demand, self.thrust_max)
    }
}
