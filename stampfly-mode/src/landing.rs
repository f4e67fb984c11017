//! Ground and air, take-off and touchdown: judged from the estimate and the thrust, never from one sensor.
//!
//! | question | evidence |
//! |---|---|
//! | held by a hand (disarmed)? | risen by 15 cm; back below 5 cm for 100 ms |
//! | left the ground? | risen by 5 cm; without a height: flying thrust for half a second |
//! | take-off complete? | the path has come to rest and the vehicle is with it, or three seconds in the air |
//! | touched down? | the motors push clearly less than the weight, and yet the vehicle does not fall: for 300 ms |
//!
//! The last one is physics and needs no range finder: in the air, thrust below the weight means falling. "Does not fall"
//! is seen by the accelerometer (standing, it reads 1 g whatever the motors do) or by the vertical velocity. A hung range
//! finder therefore cannot stop a landing. Should the descent itself stall, because the height estimate is stuck, the
//! thrust ceiling comes down and takes the vehicle along.

use stampfly_types::messages::{
    FlightState, GroundContact, Setpoint, StateEstimate, SystemMode, Validity, VehicleStatus,
};
use stampfly_types::{GRAVITY, Micros};

use crate::arming::holds_height;
use crate::persist::Persist;

/// Thresholds of the [`LandingManager`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandingConfig {
    /// Disarmed and risen this much: held, m.
    pub held: f32,
    /// Disarmed and lower than this again: set down, m.
    pub set_down: f32,
    /// Armed and risen this much: in the air, m.
    pub lift_off: f32,
    /// Take-off is complete when the vehicle is this close to the end of its path, m, and this slow, m/s.
    pub settled: (f32, f32),
    /// Time in the air after which take-off is complete in any case.
    pub take_off_timeout: Micros,
    /// Descent speed at the ground, m/s, its growth per height, 1/s, and the most, m/s.
    pub descent: (f32, f32, f32),
    /// Below this rise the thrust ceiling may come down, m.
    pub ceiling_height: f32,
    /// Lowest thrust ceiling, share of hover thrust.
    pub ceiling_min: f32,
    /// How fast the ceiling comes down, 1/s.
    pub ceiling_rate: f32,
    /// A landing that takes longer than this, and the time its height needs, is stalled.
    pub stalled: Micros,
    /// Thrust ceiling of a stalled landing to begin with, share of hover thrust, and how fast it comes down, 1/s.
    pub stalled_ceiling: (f32, f32),
    /// Thrust below this share of hover thrust does not carry the vehicle.
    pub touchdown_thrust: f32,
    /// For how long the evidence for a touchdown must hold.
    pub touchdown_time: Micros,
}

impl Default for LandingConfig {
    fn default() -> Self {
        Self {
            held: 0.15,
            set_down: 0.05,
            lift_off: 0.05,
            settled: (0.08, 0.1),
            take_off_timeout: Micros::from_secs(3),
            descent: (0.2, 0.5, 0.35),
            ceiling_height: 0.15,
            ceiling_min: 0.7,
            ceiling_rate: 0.3,
            stalled: Micros::from_secs(4),
            stalled_ceiling: (0.96, 0.03),
            touchdown_thrust: 0.8,
            touchdown_time: Micros::from_millis(300),
        }
    }
}

/// All the manager looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandingInput<'a> {
    /// State and mode.
    pub mode: &'a SystemMode,
    /// The state estimate.
    pub estimate: &'a StateEstimate,
    /// The set-point of the previous period.
    pub setpoint: &'a Setpoint,
    /// Collective thrust of the previous period, share of hover thrust.
    pub thrust: f32,
}

/// The take-off and landing manager.
///
/// ```
/// use stampfly_mode::{LandingInput, LandingManager};
/// use stampfly_types::{Micros, messages::*};
///
/// let mut manager = LandingManager::default();
/// let step = |manager: &mut LandingManager, millis, state, height, thrust| {
///     let mode = SystemMode { state, armed: state != FlightState::IdleGround, ..Default::default() };
///     let mut estimate = StateEstimate { height, valid: Validity::ALL, ..Default::default() };
///     estimate.position.z = -height;
///     estimate.specific_force.z = -9.81;
///     let input = LandingInput { mode: &mode, estimate: &estimate, setpoint: &Default::default(), thrust };
///     manager.step(Micros::from_millis(millis), &input)
/// };
/// assert_eq!(step(&mut manager, 0, FlightState::IdleGround, 0.03, 0.0).contact, GroundContact::Ground);
/// assert_eq!(step(&mut manager, 10, FlightState::TakeOff, 0.10, 1.1).contact, GroundContact::Air);
/// assert!(step(&mut manager, 20, FlightState::Landing, 1.0, 1.0).descent_rate > 0.3);
/// assert!(step(&mut manager, 30, FlightState::Landing, 0.1, 1.0).descent_rate < 0.3, "slower near the ground");
/// // It stands on the ground and the motors hardly push any more.
/// step(&mut manager, 3_000, FlightState::Landing, 0.03, 0.5);
/// assert!(step(&mut manager, 3_300, FlightState::Landing, 0.03, 0.5).landed);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LandingManager {
    config: LandingConfig,
    state: FlightState,
    contact: GroundContact,
    /// Height above the surface and vertical position while last standing.
    standing: Standing,
    down: Persist,
    carried: Persist,
    thrusting: Persist,
    settled: Persist,
    airborne_since: Option<Micros>,
    takeoff_complete: bool,
    landing_since: Option<Micros>,
    /// How high the landing began, m.
    landing_from: f32,
    ceiling: f32,
    landed: bool,
    /// Low-passed specific force along the body's z axis, m/s².
    support: f32,
    last: Option<Micros>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Standing {
    height: f32,
    position: f32,
}

impl Default for LandingManager {
    fn default() -> Self {
        Self::new(&LandingConfig::default())
    }
}

impl LandingManager {
    /// A thrust ceiling that limits nothing.
    pub const UNLIMITED: f32 = 2.0;

    /// A vehicle that stands.
    #[must_use]
    pub fn new(config: &LandingConfig) -> Self {
        Self {
            config: *config,
            state: FlightState::Init,
            contact: GroundContact::Ground,
            standing: Standing::default(),
            down: Persist::default(),
            carried: Persist::default(),
            thrusting: Persist::default(),
            settled: Persist::default(),
            airborne_since: None,
            takeoff_complete: false,
            landing_since: None,
            landing_from: 0.0,
            ceiling: Self::UNLIMITED,
            landed: false,
            support: -GRAVITY,
            last: None,
        }
    }

    /// One control period.
    pub fn step(&mut self, now: Micros, input: &LandingInput<'_>) -> VehicleStatus {
        let entered = input.mode.state != self.state;
        self.state = input.mode.state;
        let span = self.last.map_or(Micros::ZERO, |last| now.since(last)).seconds().min(0.02);
        self.last = Some(now);
        let seen = Seen::read(input, &self.standing);
        self.feel(seen.force, span);

        match input.mode.state {
            FlightState::Init | FlightState::IdleGround | FlightState::IdleHeld => self.disarmed(now, entered, &seen),
            FlightState::Armed => self.stand(&seen),
            FlightState::TakeOff => self.take_off(now, entered, input, &seen),
            FlightState::Flying => self.fly(now, input, &seen),
            FlightState::Landing => self.land(now, entered, &seen, span),
        }
        let landing = input.mode.state == FlightState::Landing;
        VehicleStatus {
            contact: self.contact,
            takeoff_complete: self.takeoff_complete && input.mode.state == FlightState::TakeOff,
            landed: self.landed && landing,
            thrust_ceiling: if landing { self.ceiling } else { Self::UNLIMITED },
            descent_rate: if landing { self.descent_rate(&seen) } else { 0.0 },
        }
    }

    fn disarmed(&mut self, now: Micros, entered: bool, seen: &Seen) {
        if entered {
            self.rest();
        }
        let rise = seen.rise.unwrap_or(0.0);
        if rise > self.config.held {
            self.contact = GroundContact::Air;
            self.down.reset();
        } else if self.contact == GroundContact::Air
            && self.down.holds(now, rise < self.config.set_down, Micros::from_millis(100))
        {
            self.contact = GroundContact::Ground;
        }
        if self.contact == GroundContact::Ground {
            self.learn_standing(seen);
        }
    }

    fn stand(&mut self, seen: &Seen) {
        self.contact = match seen.rise {
            Some(rise) if rise > self.config.held => GroundContact::Air,
            Some(_) | None => GroundContact::Ground,
        };
        // Arming moves the origin to where the vehicle stands.
        if self.contact == GroundContact::Ground {
            self.learn_standing(seen);
        }
        self.landed = false;
    }

    fn take_off(&mut self, now: Micros, entered: bool, input: &LandingInput<'_>, seen: &Seen) {
        if entered {
            self.rest();
        }
        self.leave_ground(now, seen);
        let Some(since) = self.airborne_since else { return };
        let (band, slow) = self.config.settled;
        let path = input.setpoint;
        let at_rest = path.velocity.z == 0.0 && path.acceleration.z == 0.0;
        let there = (path.position.z - input.estimate.position.z).abs() < band;
        let settled = at_rest && there && seen.sink.is_some_and(|sink| sink.abs() < slow);
        let manual = !holds_height(input.mode.mode);
        if manual
            || self.settled.holds(now, settled, Micros::from_millis(100))
            || now.since(since) >= self.config.take_off_timeout
        {
            self.takeoff_complete = true;
        }
    }

    /// Low hover is never a landing: only motors that all but stand still are.
    fn fly(&mut self, now: Micros, input: &LandingInput<'_>, seen: &Seen) {
        /// Nothing flies on this share of its hover thrust.
        const IDLE: f32 = 0.3;
        self.leave_ground(now, seen);
        let grounded = !holds_height(input.mode.mode) && seen.thrust < IDLE && self.supported();
        if self.carried.holds(now, grounded, self.config.touchdown_time) {
            self.contact = GroundContact::Ground;
            self.airborne_since = None;
        }
    }

    fn land(&mut self, now: Micros, entered: bool, seen: &Seen, span: f32) {
        if entered {
            self.ceiling = Self::UNLIMITED;
            self.landed = false;
            self.landing_since = Some(now);
            self.landing_from = seen.rise.unwrap_or(0.0).max(0.0);
            self.carried.reset();
        }
        self.lower_ceiling(now, seen, span);
        let slow = seen.sink.is_some_and(|sink| sink.abs() < 0.1);
        // High above the ground it takes the accelerometer's word as well.
        let low = seen.rise.is_none_or(|rise| rise < 0.3);
        let stands = seen.thrust < self.config.touchdown_thrust && (self.supported() || (slow && low));
        if self.carried.holds(now, stands, self.config.touchdown_time) {
            self.contact = GroundContact::Ground;
            self.airborne_since = None;
            self.landed = true;
        }
    }

    /// The ceiling comes down when the vehicle no longer sinks close to the ground (the cushion of air, or the ground
    /// itself), and much more slowly when nobody knows how high it is, or when the whole landing takes too long, which
    /// means the same: thrust that falls by 3 % a second sinks at less than 1 m/s for the first metre and a half.
    fn lower_ceiling(&mut self, now: Micros, seen: &Seen, span: f32) {
        let close = seen.rise.is_some_and(|rise| rise < self.config.ceiling_height);
        let sinks = seen.sink.is_none_or(|sink| sink >= 0.1);
        let (slowest, ..) = self.config.descent;
        let expected = self.config.stalled + Micros::from_seconds(self.landing_from / slowest);
        let late = self.landing_since.is_some_and(|since| now.since(since) > expected);
        let blind = seen.rise.is_none() && seen.sink.is_none();
        let (from, rate) = if close && !sinks {
            (1.0, self.config.ceiling_rate)
        } else if late || blind {
            self.config.stalled_ceiling
        } else {
            // Near the ground a ceiling that has come down stays; it belongs to a landing that is nearly over.
            if !close {
                self.ceiling = Self::UNLIMITED;
            }
            return;
        };
        self.ceiling = (self.ceiling.min(from) - rate * span).max(self.config.ceiling_min);
    }

    fn descent_rate(&self, seen: &Seen) -> f32 {
        let (slowest, growth, most) = self.config.descent;
        seen.rise.map_or(slowest, |rise| (slowest + growth * rise).max(slowest).min(most))
    }

    fn leave_ground(&mut self, now: Micros, seen: &Seen) {
        let risen = match seen.rise {
            Some(rise) => rise > self.config.lift_off,
            None => self.thrusting.holds(now, seen.thrust > 0.9, Micros::from_millis(500)),
        };
        if risen {
            self.contact = GroundContact::Air;
            self.airborne_since.get_or_insert(now);
        }
    }

    /// Does something other than the motors carry the vehicle? In the air the accelerometer reads the thrust.
    fn supported(&self) -> bool {
        -self.support > 0.9 * GRAVITY
    }

    /// Low-passes the specific force with 50 ms: longer than a period of vibration, shorter than the evidence.
    fn feel(&mut self, force: f32, span: f32) {
        if force.is_finite() {
            self.support += (force - self.support) * (span / (0.05 + span));
        }
    }

    fn learn_standing(&mut self, seen: &Seen) {
        // Slowly, so that being lifted is not learned as standing.
        const SHARE: f32 = 0.002;
        if let Some(height) = seen.height {
            self.standing.height += (height.clamp(0.0, 0.1) - self.standing.height) * SHARE;
        }
        if let Some(position) = seen.position {
            self.standing.position = position;
        }
    }

    fn rest(&mut self) {
        self.airborne_since = None;
        self.takeoff_complete = false;
        self.landing_since = None;
        self.landed = false;
        self.settled.reset();
        self.thrusting.reset();
        self.carried.reset();
    }
}

/// The evidence of one period; `None` where the estimate does not know.
struct Seen {
    /// Height above the surface, m.
    height: Option<f32>,
    /// Vertical position, down, m.
    position: Option<f32>,
    /// Rise above where it last stood, m.
    rise: Option<f32>,
    /// Vertical velocity, down, m/s.
    sink: Option<f32>,
    /// Share of hover thrust.
    thrust: f32,
    /// Specific force along body z, m/s².
    force: f32,
}

impl Seen {
    fn read(input: &LandingInput<'_>, standing: &Standing) -> Self {
        let estimate = input.estimate;
        let known = |bit, value: f32| (estimate.valid.contains(bit) && value.is_finite()).then_some(value);
        let height = known(Validity::HEIGHT, estimate.height);
        let position = known(Validity::POSITION_Z, estimate.position.z);
        let by_height = height.map(|height| height - standing.height);
        let by_position = position.map(|position| standing.position - position);
        Self {
            height,
            position,
            rise: by_height.or(by_position),
            sink: known(Validity::VELOCITY_Z, estimate.velocity.z),
            thrust: if input.thrust.is_finite() { input.thrust } else { 0.0 },
            force: estimate.specific_force.z,
        }
    }
}
