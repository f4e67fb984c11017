//! Horizontal position to acceleration: proportional on position, PID on velocity, the path as feed-forward.
//!
//! A jerk-limited path says where to be, how fast and with which acceleration. Velocity and acceleration are fed
//! forward, so the feedback only handles what the path does not know: wind, model error, the estimator's noise.
//! Without a usable position the velocity loop works alone.

use stampfly_types::{GRAVITY, Vec3, math};

use crate::airframe::Airframe;
use crate::attitude::AttitudeConfig;
use crate::pid::{Integration, Pid, PidGains};

/// Gains and limits of the horizontal loops.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PositionConfig {
    /// Velocity per position error, 1/s.
    pub position_gain: f32,
    /// Largest velocity correction for a position error, m/s.
    pub correction_max: f32,
    /// Acceleration per velocity error, 1/s.
    pub velocity: PidGains,
    /// Largest tilt, rad.
    pub tilt_max: f32,
}

/// Largest gain of the velocity loop over that of the attitude loop, which has to lean the vehicle for it: 0.28 in PX4's defaults
/// (`MPC_XY_VEL_P_ACC` 1.8 over `MC_ROLL_P` 6.5).
const ATTITUDE_SHARE: f32 = 0.3;

impl PositionConfig {
    /// The default gains; all of them slower where the airframe's motors, and so its attitude loop, are too slow for them.
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        let full = Self::default();
        let reach = ATTITUDE_SHARE * AttitudeConfig::for_airframe(airframe).tilt_gain;
        let share = (reach / full.velocity.kp).min(1.0);
        Self {
            position_gain: share * full.position_gain,
            velocity: PidGains { kp: share * full.velocity.kp, ti: full.velocity.ti / share, ..full.velocity },
            ..full
        }
    }
}

impl Default for PositionConfig {
    /// For an attitude loop of 13 1/s or more, whatever the vehicle weighs: the velocity loop has three
    /// tenths of that gain, the most that leaves the attitude time to follow, and the position loop
    /// half of the velocity loop's, which damps the two together by 0.7. The integral takes 3.6 time
    /// constants of the velocity loop.
    fn default() -> Self {
        Self {
            position_gain: 1.95,
            correction_max: 1.0,
            velocity: PidGains { kp: 3.9, ti: 0.92, td: 0.0, eta: 0.125 },
            tilt_max: 0.35,
        }
    }
}

/// The horizontal loops, world frame.
///
/// ```
/// use stampfly_control::position::{PositionConfig, PositionController};
/// use stampfly_types::Vec3;
/// let mut position = PositionController::new(&PositionConfig::default());
/// let (error, velocity) = (Vec3::new(0.5, 0.0, 0.0), Vec3::zeros());
/// let acceleration = position.step(&error, &Vec3::zeros(), &Vec3::zeros(), &velocity, 0.0025, false);
/// assert!(acceleration.x > 0.0 && acceleration.y == 0.0 && acceleration.z == 0.0);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PositionController {
    position_gain: f32,
    correction_max: f32,
    acceleration_max: f32,
    north: Pid,
    east: Pid,
    /// How far the last demand went beyond the largest acceleration, per axis and with its sign.
    excess: [f32; 2],
}

impl PositionController {
    /// Loops at rest.
    #[must_use]
    pub fn new(config: &PositionConfig) -> Self {
        let acceleration_max = GRAVITY * math::tan(config.tilt_max);
        let pid = Pid::new(config.velocity, acceleration_max);
        Self {
            position_gain: config.position_gain,
            correction_max: config.correction_max,
            acceleration_max,
            north: pid,
            east: pid,
            excess: [0.0; 2],
        }
    }

    /// Changes the gains in flight. Integrals and limits stay.
    pub fn set_gains(&mut self, config: &PositionConfig) {
        self.position_gain = config.position_gain;
        [&mut self.north, &mut self.east].into_iter().for_each(|axis| axis.set_gains(config.velocity));
    }

    /// Acceleration asked for, north and east, m/s²; z is zero.
    ///
    /// `error` is where to be minus where we are (zero when the position is unknown), `target` and
    /// `acceleration` the path's velocity and acceleration, `velocity` the measured one. Only x and y are read.
    #[inline]
    pub fn step(
        &mut self,
        error: &Vec3,
        target: &Vec3,
        acceleration: &Vec3,
        velocity: &Vec3,
        dt: f32,
        grounded: bool,
    ) -> Vec3 {
        let correction = limit(self.position_gain * error.x, self.position_gain * error.y, self.correction_max);
        let [excess_north, excess_east] = self.excess;
        let north = acceleration.x
            + self.north.step(target.x + correction[0], velocity.x, dt, integration(excess_north, grounded));
        let east = acceleration.y
            + self.east.step(target.y + correction[1], velocity.y, dt, integration(excess_east, grounded));
        let [limited_north, limited_east] = limit(north, east, self.acceleration_max);
        self.excess = [north - limited_north, east - limited_east];
        Vec3::new(limited_north, limited_east, 0.0)
    }

    /// Forgets the integrals.
    pub fn reset(&mut self) {
        self.north.reset();
        self.east.reset();
        self.excess = [0.0; 2];
    }
}

fn integration(excess: f32, hold: bool) -> Integration {
    if hold {
        Integration::Hold
    } else if excess > 0.0 {
        Integration::NotUp
    } else if excess < 0.0 {
        Integration::NotDown
    } else {
        Integration::Free
    }
}

/// The vector, shortened to `max`.
fn limit(x: f32, y: f32, max: f32) -> [f32; 2] {
    let squared = x * x + y * y;
    if squared <= max * max {
        return [x, y];
    }
    let scale = max / math::sqrt(squared);
    [x * scale, y * scale]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn never_asks_for_more_than_the_largest_tilt(
            error in prop::array::uniform2(-100f32..100.0),
            velocity in prop::array::uniform2(-10f32..10.0),
            ahead in prop::array::uniform2(-20f32..20.0),
        ) {
            let config = PositionConfig::default();
            let mut position = PositionController::new(&config);
            let flat = |[x, y]: [f32; 2]| Vec3::new(x, y, f32::NAN);
            for _ in 0..100 {
                let out = position.step(&flat(error), &Vec3::zeros(), &flat(ahead), &flat(velocity), 0.0025, false);
                prop_assert!(math::atan2(out.norm(), GRAVITY) <= config.tilt_max + 1e-5);
                prop_assert_eq!(out.z, 0.0);
            }
        }
    }
}
