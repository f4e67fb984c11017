//! What the vehicle is asked to do right now, and which of it can be done.
//!
//! Flight phase, flight mode, commanded axes and validity of the estimate are discrete; the control laws are not.
//! This file turns the first into a small [`Intent`] so that the laws need not look at them. It is also where
//! the stack degrades:
//!
//! | missing | horizontally | vertically |
//! |---|---|---|
//! | position | velocity only | velocity only |
//! | velocity | level | hover thrust, a little less |
//! | tilt | damp the rotation | hover thrust, a little less |
//! | angular rate | no torque | hover thrust, a little less |
//!
//! Write a control law against [`Intent`] and it behaves like the others in every mode and every failure. Write a flight mode that makes
//! one, and every law flies it: [`Controller`](crate::Controller) has an example.

use stampfly_types::Vec3;
use stampfly_types::messages::{
    FlightMode, FlightPhase, GroundContact, Setpoint, SetpointAxes, StateEstimate, Validity, stick,
};

use crate::input::ControlInput;

/// What is asked, as far as it can be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intent {
    /// Roll and pitch.
    pub horizontal: Horizontal,
    /// Thrust.
    pub vertical: Vertical,
    /// Yaw.
    pub heading: Heading,
    /// The vehicle touches the ground: integrators would learn the ground's push, so they must not move.
    pub grounded: bool,
    /// Tangent of the largest tilt for a place or a velocity: 0.1 while thrust is taken away to find the ground. A
    /// vehicle that stands on one leg leans on, whatever is asked, and falls over it; steady wind needs less.
    pub tan_tilt_max: f32,
}

/// Tangent of the largest tilt of a vehicle that settles on the ground: 6°.
const SETTLING: f32 = 0.1;

/// What roll and pitch are for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Horizontal {
    /// Follow the set-point's path: position, velocity and acceleration.
    Path,
    /// Follow the set-point's velocity and acceleration; the position is unknown or not commanded.
    Velocity,
    /// Lean by the sticks: forward and right, −1 to 1 of the largest angle. Zero is level.
    Lean {
        /// Forward, nose down.
        forward: f32,
        /// To the right.
        right: f32,
    },
    /// Turn by the sticks: roll and pitch rate, −1 to 1 of the largest rate; forward pitches the nose down.
    Rates {
        /// Pitch rate, nose down positive.
        forward: f32,
        /// Roll rate, right wing down positive.
        right: f32,
    },
    /// Tilt is unknown: stop turning.
    Damp,
    /// Not even the angular rate is known: no torque.
    Nothing,
}

/// What thrust is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Vertical {
    /// Follow the set-point's path: position, velocity and acceleration.
    Path,
    /// Follow the set-point's velocity and acceleration; the position is unknown or not commanded.
    Velocity,
    /// Thrust as a share of the largest, 0 to 1.
    Throttle(f32),
    /// The vertical state is unknown: come down slowly on hover thrust.
    Descend,
}

/// What yaw is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heading {
    /// Keep a heading, radians, while turning at a rate, rad/s.
    Hold {
        /// Heading.
        yaw: f32,
        /// Its rate of change.
        rate: f32,
    },
    /// Turn at a rate about the vertical, rad/s.
    Rate(f32),
    /// Turn by the stick about the body's z axis, −1 to 1 of the largest rate.
    Stick(f32),
}

impl Intent {
    /// Reads the intent; `None` when the motors have nothing to do: on the ground, held, or not armed.
    #[must_use]
    pub fn read(input: &ControlInput<'_>) -> Option<Self> {
        let in_motion = match input.flight_status.phase {
            FlightPhase::Init | FlightPhase::IdleGround | FlightPhase::IdleHeld | FlightPhase::Armed => false,
            // A flip has a controller of its own, which is asked first.
            FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Landing | FlightPhase::Flip => true,
        };
        if !(in_motion && input.flight_status.armed) {
            return None;
        }
        let known = Known::read(input.estimate);
        let path = &input.setpoint;
        let axes = usable_axes(path);
        let manual = throttle_commands_thrust(input);

        let horizontal = if !known.rate {
            Horizontal::Nothing
        } else if !known.tilt {
            Horizontal::Damp
        } else if axes.contains(SetpointAxes::POSITION_XY) && known.position_xy {
            Horizontal::Path
        } else if path.axes.intersects(HORIZONTAL) {
            let follow = axes.intersects(HORIZONTAL) && known.velocity_xy;
            if follow { Horizontal::Velocity } else { Horizontal::LEVEL }
        } else {
            let (forward, right) = (stick(input.command.pitch), stick(input.command.roll));
            match input.flight_status.mode {
                // What has one leg on the ground turns about it, however still the sticks are.
                FlightMode::Acro if manual && input.flight_status.phase != FlightPhase::TakeOff => {
                    Horizontal::Rates { forward, right }
                }
                FlightMode::Acro | FlightMode::Stabilize | FlightMode::AltHold => Horizontal::Lean { forward, right },
                // The sticks of this mode mean velocities; without a commanded axis they mean nothing.
                FlightMode::PosHold => Horizontal::LEVEL,
            }
        };
        let vertical = if manual {
            Vertical::Throttle(stick(input.command.throttle).max(0.0))
        } else if !(known.velocity_z && axes.intersects(VERTICAL)) {
            Vertical::Descend
        } else if axes.contains(SetpointAxes::POSITION_Z) && known.position_z {
            Vertical::Path
        } else {
            Vertical::Velocity
        };
        let heading = if axes.contains(SetpointAxes::YAW) && known.tilt && known.heading {
            Heading::Hold { yaw: path.yaw, rate: path.yaw_rate }
        } else if axes.intersects(SetpointAxes::YAW | SetpointAxes::YAW_RATE) {
            Heading::Rate(path.yaw_rate)
        } else {
            Heading::Stick(stick(input.command.yaw))
        };
        let settles = input.flight_status.phase == FlightPhase::Landing && input.land_detected.thrust_ceiling < 1.0;
        Some(Self {
            horizontal,
            vertical,
            heading,
            grounded: input.land_detected.contact == GroundContact::Ground,
            tan_tilt_max: if settles { SETTLING } else { f32::INFINITY },
        })
    }
}

impl Intent {
    /// What of an intent can be done with this estimate and this set-point, by the table of the [module](self): for a mode that makes
    /// its own. Numbers that are none are taken for zero. The set-point's `axes` are not looked at: the intent says what to follow.
    #[must_use]
    pub fn possible(self, input: &ControlInput<'_>) -> Self {
        let known = Known::read(input.estimate);
        let every = HORIZONTAL.with(VERTICAL).with(SetpointAxes::YAW).with(SetpointAxes::YAW_RATE);
        let axes = usable_axes(&Setpoint { axes: every, ..*input.setpoint });
        let horizontal = match self.horizontal {
            _ if !known.rate => Horizontal::Nothing,
            Horizontal::Nothing => Horizontal::Nothing,
            // Rates need no attitude.
            Horizontal::Rates { forward, right } => Horizontal::Rates { forward: stick(forward), right: stick(right) },
            _ if !known.tilt => Horizontal::Damp,
            Horizontal::Path if known.position_xy && axes.contains(SetpointAxes::POSITION_XY) => Horizontal::Path,
            Horizontal::Path | Horizontal::Velocity => {
                let follow = known.velocity_xy && axes.intersects(HORIZONTAL);
                if follow { Horizontal::Velocity } else { Horizontal::LEVEL }
            }
            Horizontal::Lean { forward, right } => Horizontal::Lean { forward: stick(forward), right: stick(right) },
            Horizontal::Damp => Horizontal::Damp,
        };
        let vertical = match self.vertical {
            Vertical::Throttle(throttle) => Vertical::Throttle(stick(throttle).max(0.0)),
            Vertical::Descend => Vertical::Descend,
            Vertical::Path if known.position_z && axes.contains(SetpointAxes::POSITION_Z) => Vertical::Path,
            Vertical::Path | Vertical::Velocity => {
                let follow = known.velocity_z && axes.intersects(VERTICAL);
                if follow { Vertical::Velocity } else { Vertical::Descend }
            }
        };
        let finite = |rate: f32| if rate.is_finite() { rate } else { 0.0 };
        let heading = match self.heading {
            Heading::Hold { yaw, rate } if known.tilt && known.heading && yaw.is_finite() => {
                Heading::Hold { yaw, rate: finite(rate) }
            }
            Heading::Hold { rate, .. } | Heading::Rate(rate) => Heading::Rate(finite(rate)),
            Heading::Stick(deflection) => Heading::Stick(stick(deflection)),
        };
        // No number is level.
        Self { horizontal, vertical, heading, tan_tilt_max: self.tan_tilt_max.max(0.0), ..self }
    }
}

impl Horizontal {
    /// Neither forward nor right.
    pub const LEVEL: Self = Self::Lean { forward: 0.0, right: 0.0 };
}

const HORIZONTAL: SetpointAxes = SetpointAxes::POSITION_XY.with(SetpointAxes::VELOCITY_XY);
const VERTICAL: SetpointAxes = SetpointAxes::POSITION_Z.with(SetpointAxes::VELOCITY_Z);

/// Is the throttle stick a thrust? Never while landing and never in a mode that holds height: there a vertical
/// set-point that is missing or broken must not turn into "stick at rest, motors off".
fn throttle_commands_thrust(input: &ControlInput<'_>) -> bool {
    let status = input.flight_status;
    status.mode.is_manual() && status.phase != FlightPhase::Landing && !input.setpoint.axes.intersects(VERTICAL)
}

/// Which parts of the estimate may be used: declared valid, and numbers.
struct Known {
    rate: bool,
    tilt: bool,
    heading: bool,
    velocity_xy: bool,
    velocity_z: bool,
    position_xy: bool,
    position_z: bool,
}

impl Known {
    fn read(estimate: &StateEstimate) -> Self {
        let valid = |bits| estimate.valid.contains(bits);
        let rate = is_finite(&estimate.angular_rate);
        let tilt = rate && valid(Validity::TILT) && estimate.attitude.is_unit();
        let (velocity, position) = (&estimate.velocity, &estimate.position);
        let velocity_xy = tilt && valid(Validity::VELOCITY_XY) && (velocity.x + velocity.y).is_finite();
        let velocity_z = tilt && valid(Validity::VELOCITY_Z) && velocity.z.is_finite();
        Self {
            rate,
            tilt,
            heading: valid(Validity::HEADING),
            velocity_xy,
            velocity_z,
            position_xy: velocity_xy && valid(Validity::POSITION_XY) && (position.x + position.y).is_finite(),
            position_z: velocity_z && valid(Validity::POSITION_Z) && position.z.is_finite(),
        }
    }
}

/// The commanded axes whose numbers are numbers. A position that is none leaves its velocity to follow.
fn usable_axes(path: &Setpoint) -> SetpointAxes {
    let (position, velocity, acceleration) = (&path.position, &path.velocity, &path.acceleration);
    let mut axes = path.axes;
    if axes.contains(SetpointAxes::POSITION_XY) && !(position.x + position.y).is_finite() {
        axes = axes.without(SetpointAxes::POSITION_XY).with(SetpointAxes::VELOCITY_XY);
    }
    if axes.contains(SetpointAxes::POSITION_Z) && !position.z.is_finite() {
        axes = axes.without(SetpointAxes::POSITION_Z).with(SetpointAxes::VELOCITY_Z);
    }
    if !(velocity.x + velocity.y + acceleration.x + acceleration.y).is_finite() {
        axes = axes.without(HORIZONTAL);
    }
    if !(velocity.z + acceleration.z).is_finite() {
        axes = axes.without(VERTICAL);
    }
    if !(path.yaw + path.yaw_rate).is_finite() {
        axes = axes.without(SetpointAxes::YAW | SetpointAxes::YAW_RATE);
    }
    axes
}

fn is_finite(vector: &Vec3) -> bool {
    (vector.x + vector.y + vector.z).is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::messages::{CommandSetpoint, FlightStatus, LandDetected};

    /// A vehicle in position hold with everything known and commanded, for tests to take something away.
    struct Case {
        estimate: StateEstimate,
        command: CommandSetpoint,
        setpoint: Setpoint,
        mode: FlightStatus,
    }

    fn flying(mode: FlightMode, axes: SetpointAxes) -> Case {
        Case {
            estimate: StateEstimate { valid: Validity::ALL, ..StateEstimate::default() },
            command: CommandSetpoint { roll: 0.5, pitch: -0.25, throttle: 0.6, yaw: 0.1, ..CommandSetpoint::default() },
            setpoint: Setpoint { axes, ..Setpoint::default() },
            mode: FlightStatus { phase: FlightPhase::Flying, mode, armed: true, ..FlightStatus::default() },
        }
    }

    fn everything() -> Case {
        flying(FlightMode::PosHold, SetpointAxes::POSITION_XY | SetpointAxes::POSITION_Z | SetpointAxes::YAW)
    }

    fn read(case: &Case) -> Option<Intent> {
        let land_detected = LandDetected { contact: GroundContact::Air, ..LandDetected::default() };
        Intent::read(&ControlInput {
            estimate: &case.estimate,
            command: &case.command,
            setpoint: &case.setpoint,
            flight_status: &case.mode,
            land_detected: &land_detected,
            unmet: [0.0; 4],
        })
    }

    fn axes(case: &Case) -> (Horizontal, Vertical) {
        let intent = read(case).expect("in flight");
        (intent.horizontal, intent.vertical)
    }

    #[test]
    fn motors_have_work_only_when_armed_and_in_motion() {
        for phase in FlightPhase::ALL {
            for armed in [false, true] {
                let mut case = everything();
                (case.mode.phase, case.mode.armed) = (*phase, armed);
                let still = [FlightPhase::Init, FlightPhase::IdleGround, FlightPhase::IdleHeld, FlightPhase::Armed];
                let in_motion = !still.contains(phase);
                assert_eq!(read(&case).is_some(), armed && in_motion, "{phase:?} {armed}");
            }
        }
    }

    #[test]
    fn what_the_estimator_loses_is_given_up_and_no_more() {
        let without = |lost: Validity| {
            let mut case = everything();
            case.estimate.valid = Validity::ALL.without(lost);
            axes(&case)
        };
        let (place, level) = (Horizontal::Path, Horizontal::LEVEL);
        for (lost, expected) in [
            (Validity::NONE, (place, Vertical::Path)),
            (Validity::HEADING, (place, Vertical::Path)),
            (Validity::POSITION_XY, (Horizontal::Velocity, Vertical::Path)),
            (Validity::VELOCITY_XY, (level, Vertical::Path)),
            (Validity::POSITION_Z, (place, Vertical::Velocity)),
            (Validity::VELOCITY_Z, (place, Vertical::Descend)),
            (Validity::TILT, (Horizontal::Damp, Vertical::Descend)),
            (Validity::ALL, (Horizontal::Damp, Vertical::Descend)),
        ] {
            assert_eq!(without(lost), expected, "without {:?}", lost.names().collect::<std::vec::Vec<_>>());
        }
        let mut case = everything();
        case.estimate.angular_rate.z = f32::NAN;
        assert_eq!(axes(&case), (Horizontal::Nothing, Vertical::Descend));
    }

    #[test]
    fn a_broken_set_point_never_turns_into_a_throttle() {
        let mut case = everything();
        case.setpoint.velocity.z = f32::NAN;
        assert_eq!(axes(&case), (Horizontal::Path, Vertical::Descend));
        let mut case = everything();
        case.setpoint.position.z = f32::INFINITY;
        assert_eq!(axes(&case), (Horizontal::Path, Vertical::Velocity));
        let mut case = everything();
        case.setpoint.acceleration.x = f32::NAN;
        assert_eq!(axes(&case), (Horizontal::LEVEL, Vertical::Path));
        // Nor does a set-point that is not there.
        assert_eq!(axes(&flying(FlightMode::AltHold, SetpointAxes::NONE)).1, Vertical::Descend);
        let mut case = flying(FlightMode::Stabilize, SetpointAxes::NONE);
        case.mode.phase = FlightPhase::Landing;
        assert_eq!(axes(&case).1, Vertical::Descend);
    }

    #[test]
    fn sticks_mean_what_the_mode_says() {
        let lean = Horizontal::Lean { forward: -0.25, right: 0.5 };
        let rates = Horizontal::Rates { forward: -0.25, right: 0.5 };
        let throttle = Vertical::Throttle(0.6);
        assert_eq!(axes(&flying(FlightMode::Acro, SetpointAxes::NONE)), (rates, throttle));
        let mut leaves = flying(FlightMode::Acro, SetpointAxes::NONE);
        leaves.mode.phase = FlightPhase::TakeOff;
        assert_eq!(axes(&leaves), (lean, throttle), "one leg may still stand");
        assert_eq!(axes(&flying(FlightMode::Stabilize, SetpointAxes::YAW)), (lean, throttle));
        let alt_hold = flying(FlightMode::AltHold, SetpointAxes::POSITION_Z | SetpointAxes::YAW);
        assert_eq!(axes(&alt_hold), (lean, Vertical::Path));
        // A landing out of Acro is flown level, by the set-point.
        let mut landing = flying(FlightMode::Acro, SetpointAxes::POSITION_Z);
        landing.mode.phase = FlightPhase::Landing;
        assert_eq!(axes(&landing), (lean, Vertical::Path));
        let mut down = flying(FlightMode::Stabilize, SetpointAxes::NONE);
        (down.command.throttle, down.command.roll) = (-1.0, f32::NAN);
        assert_eq!(axes(&down), (Horizontal::Lean { forward: -0.25, right: 0.0 }, Vertical::Throttle(0.0)));
    }

    #[test]
    fn only_a_vehicle_that_settles_leans_little() {
        let tan_tilt_max = |phase, thrust_ceiling| {
            let mut case = everything();
            case.mode.phase = phase;
            let land_detected = LandDetected { contact: GroundContact::Air, thrust_ceiling, ..LandDetected::default() };
            let input = ControlInput {
                estimate: &case.estimate,
                command: &case.command,
                setpoint: &case.setpoint,
                flight_status: &case.mode,
                land_detected: &land_detected,
                unmet: [0.0; 4],
            };
            Intent::read(&input).expect("in flight").tan_tilt_max
        };
        // Six degrees.
        assert!((tan_tilt_max(FlightPhase::Landing, 0.9) - 0.105).abs() < 0.01);
        for (phase, ceiling) in
            [(FlightPhase::Landing, f32::MAX), (FlightPhase::TakeOff, 0.9), (FlightPhase::Flying, 0.9)]
        {
            assert_eq!(tan_tilt_max(phase, ceiling), f32::INFINITY, "{phase:?} {ceiling}");
        }
    }

    use crate::{Airframe, CascadeConfig, CascadeController, Controller, GeometricConfig, GeometricController};
    use proptest::prelude::*;
    use stampfly_types::{Instant, Quat};

    fn any_intent() -> impl Strategy<Value = Intent> {
        (0u8..6, 0u8..4, 0u8..3, any::<[f32; 6]>(), any::<bool>()).prop_map(
            |(h, v, y, [a, b, c, d, e, f], grounded)| Intent {
                horizontal: match h {
                    0 => Horizontal::Path,
                    1 => Horizontal::Velocity,
                    2 => Horizontal::Lean { forward: a, right: b },
                    3 => Horizontal::Rates { forward: a, right: b },
                    4 => Horizontal::Damp,
                    _ => Horizontal::Nothing,
                },
                vertical: match v {
                    0 => Vertical::Path,
                    1 => Vertical::Velocity,
                    2 => Vertical::Throttle(c),
                    _ => Vertical::Descend,
                },
                heading: match y {
                    0 => Heading::Hold { yaw: d, rate: e },
                    1 => Heading::Rate(d),
                    _ => Heading::Stick(d),
                },
                grounded,
                tan_tilt_max: f,
            },
        )
    }

    fn strange() -> impl Strategy<Value = f32> {
        prop_oneof![Just(0.0), Just(f32::NAN), Just(f32::INFINITY), -100f32..100.0, any::<f32>()]
    }

    proptest! {
        #[test]
        fn no_intent_makes_what_is_no_number(
            intents in prop::collection::vec(any_intent(), 1..6), n in prop::array::uniform16(strange()), bits: u32,
        ) {
            let mut estimate = StateEstimate { valid: Validity::ALL, ..StateEstimate::default() };
            if bits & 1 == 1 { estimate.attitude = Quat::new_unchecked(n[0], n[1], n[2], n[3]) }
            if bits & 2 == 2 { estimate.angular_rate = Vec3::new(n[4], n[5], n[6]) }
            if bits & 4 == 4 { estimate.valid = Validity::NONE }
            estimate.velocity = Vec3::new(n[7], n[8], n[9]);
            let setpoint = Setpoint {
                position: Vec3::new(n[10], n[11], n[12]), velocity: Vec3::new(n[13], 0.0, n[14]),
                acceleration: Vec3::new(n[15], n[0], n[1]), ..Setpoint::default()
            };
            let (command, flight_status) = (CommandSetpoint::default(), FlightStatus::default());
            let land_detected = LandDetected { thrust_ceiling: f32::MAX, ..LandDetected::default() };
            let input = ControlInput {
                estimate: &estimate, command: &command, setpoint: &setpoint, flight_status: &flight_status,
                land_detected: &land_detected, unmet: [0.0; 4],
            };
            let airframe = Airframe::EXAMPLE;
            let mut cascade = CascadeController::new(&CascadeConfig::for_airframe(&airframe));
            let mut geometric = GeometricController::new(&GeometricConfig::for_airframe(&airframe));
            for (n, intent) in intents.iter().enumerate() {
                let (now, intent) = (Instant::from_micros(2_500 * n as u64), Some(intent.possible(&input)));
                for output in [cascade.follow(now, intent, &input), geometric.follow(now, intent, &input)] {
                    prop_assert!((0.0..=airframe.thrust_limit()).contains(&output.thrust), "{:?}: {:?}", intent, output);
                    let limit = airframe.torque_limit();
                    prop_assert!(output.torque.iter().zip(limit.iter()).all(|(t, max)| t.abs() <= max * 1.0001), "{:?}: {:?}", intent, output);
                }
            }
        }
    }

    #[test]
    fn an_intent_of_ones_own_degrades_as_the_familys_do() {
        let setpoint = Setpoint::default();
        let case = |valid: Validity| {
            let estimate = StateEstimate { valid, ..StateEstimate::default() };
            let input = ControlInput {
                estimate: &estimate,
                command: &CommandSetpoint::default(),
                setpoint: &setpoint,
                flight_status: &FlightStatus::default(),
                land_detected: &LandDetected::default(),
                unmet: [0.0; 4],
            };
            let heading = Heading::Hold { yaw: 1.0, rate: 0.5 };
            let (horizontal, vertical) = (Horizontal::Path, Vertical::Path);
            let asked = Intent { horizontal, vertical, heading, grounded: false, tan_tilt_max: f32::NAN };
            let possible = asked.possible(&input);
            assert_eq!(possible.tan_tilt_max, 0.0);
            (possible.horizontal, possible.vertical, possible.heading)
        };
        let hold = Heading::Hold { yaw: 1.0, rate: 0.5 };
        let all = Validity::ALL;
        assert_eq!(case(all), (Horizontal::Path, Vertical::Path, hold));
        let lost = all.without(Validity::POSITION_XY | Validity::POSITION_Z);
        assert_eq!(case(lost), (Horizontal::Velocity, Vertical::Velocity, hold));
        let lost = lost.without(Validity::VELOCITY_XY | Validity::VELOCITY_Z);
        assert_eq!(case(lost), (Horizontal::LEVEL, Vertical::Descend, hold));
        assert_eq!(case(Validity::NONE), (Horizontal::Damp, Vertical::Descend, Heading::Rate(0.5)));
    }
}
