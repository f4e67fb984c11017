//! What a flip needs and may do, and how that follows from the airframe.

use stampfly_types::{Duration, GRAVITY, math};

use crate::airframe::Airframe;
use crate::attitude::AttitudeConfig;

/// Share of the largest torque that speeds the turn up and brakes it; the rest corrects.
const TORQUE_SHARE: f32 = 0.7;
/// Fastest turn, rad/s: 1150 °/s, of which a gyro of ±2000 °/s leaves three quarters of its range to what goes wrong.
const RATE_MAX: f32 = 20.0;
/// Share of what gravity takes during the turn that is climbed with before it: as much comes out downwards, less what thrust gives
/// while the vehicle is nearly upright.
const CLIMB_SHARE: f32 = 0.28;
/// Thrust while it is far from upright, share of hover: enough for the mixer to turn with.
const TURN_SHARE: f32 = 0.2;
/// Share of the thrust above the weight that is there in a climb: the air takes some of it, and the battery sags.
const SPARE_SHARE: f32 = 0.6;

/// Rates, thrusts, conditions and time-outs of a [`FlipSequencer`](super::FlipSequencer).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FlipConfig {
    /// Fastest turn, rad/s.
    pub rate: f32,
    /// Angular acceleration about roll and about pitch, rad/s².
    pub acceleration: [f32; 2],
    /// Time constant of the motors, s: the turn is braked so much earlier.
    pub motor_lag: f32,
    /// Thrust of the climb before the turn and of the recovery after it, N.
    pub thrust_max: f32,
    /// Thrust while far from upright, N.
    pub thrust_turn: f32,
    /// Thrust that carries the vehicle, N.
    pub hover_thrust: f32,
    /// Climb rate with which the turn begins, m/s.
    pub climb: f32,
    /// The climb is given up after this long.
    pub climb_limit: Duration,
    /// The turn is given up after this long.
    pub turn_limit: Duration,
    /// The recovery is over after this long, level or not.
    pub recover_limit: Duration,
    /// A turn faster than this is given up, rad/s.
    pub rate_limit: f32,
    /// Angle before level at which the attitude loop takes over, rad.
    pub hand_over: f32,
    /// Vertical acceleration per climb rate in the recovery, 1/s.
    pub climb_gain: f32,
    /// Attitude loop of climb and recovery.
    pub attitude: AttitudeConfig,
    /// Least height above the surface, m.
    pub height_min: f32,
    /// How far it rises at most, m: the climb, and as far as it would climb on during the turn.
    pub room: f32,
    /// Largest tilt, rad, rate, rad/s, horizontal and vertical speed, m/s, to begin with.
    pub steady: [f32; 4],
    /// Time between two flips.
    pub pause: Duration,
}

impl FlipConfig {
    /// The rule for an airframe. The turn takes 2π/rate + rate/acceleration; before it the vehicle climbs with 0.28 of what
    /// gravity takes in that time, and at the height asked for the rest of it can be braked.
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        let (limit, inertia) = (airframe.torque_limit(), airframe.inertia);
        let acceleration = [TORQUE_SHARE * limit.x / inertia.x, TORQUE_SHARE * limit.y / inertia.y];
        let slower = acceleration[0].min(acceleration[1]);
        // Not so fast that it would be braked before it is reached: a third of the turn to speed up, a third to brake.
        let rate = math::sqrt(2.0 / 3.0 * math::TAU * slower).min(RATE_MAX);
        let turn = math::TAU / rate + rate / slower;
        let thrust_max = airframe.thrust_limit();
        // What is left above the weight; little or nothing of it refuses every flip.
        let spare = SPARE_SHARE * (thrust_max / airframe.mass - GRAVITY);
        let climb = CLIMB_SHARE * GRAVITY * turn;
        let fall = (1.0 - CLIMB_SHARE) * GRAVITY * turn;
        let attitude = AttitudeConfig::for_airframe(airframe);
        Self {
            rate,
            acceleration,
            motor_lag: airframe.motor_lag,
            thrust_max,
            thrust_turn: TURN_SHARE * airframe.hover_thrust(),
            hover_thrust: airframe.hover_thrust(),
            climb,
            // Twice what it takes.
            climb_limit: Duration::from_seconds(2.0 * climb / spare.max(1.0)),
            turn_limit: Duration::from_seconds(1.6 * turn),
            recover_limit: Duration::from_millis(2_000),
            rate_limit: 1.5 * rate,
            // From here the attitude loop asks for no more than it may, and no less than the brake has left.
            hand_over: attitude.tilt_rate_max / attitude.tilt_gain,
            climb_gain: 5.0,
            attitude,
            height_min: if spare > 0.18 * GRAVITY { fall * fall / (2.0 * spare) } else { f32::INFINITY },
            room: climb * climb / (2.0 * spare.max(1.0)) + climb * turn,
            steady: [0.26, 1.05, 0.3, 0.2],
            pause: Duration::from_secs(2),
        }
    }
}
