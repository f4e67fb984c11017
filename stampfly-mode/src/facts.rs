//! What is true in one step, as plain data: all that [`decide`](crate::decision::decide) looks at beside its state.

use crate::config::ModeConfig;
use crate::input::ModeInput;
use crate::pilot::Heard;
use stampfly_types::messages::{Alerts, ButtonGesture, CommandSource, GroundContact, GuidedKind, Validity};
use stampfly_types::{Instant, frame};

/// What programs ask for in one step, as a set: the order of the commands does not matter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Asked {
    /// Motors off now.
    pub kill: bool,
    /// Land if flying, then stop the motors.
    pub disarm: bool,
    /// Land.
    pub land: bool,
    /// Take off.
    pub take_off: bool,
    /// Allow the motors.
    pub arm: bool,
    /// Go somewhere, or stay.
    pub route: bool,
    /// Turn over.
    pub flip: bool,
    /// Any command, a sign of life included.
    pub any: bool,
}

/// Less than this, rad/s and m/s, is rest after turning over.
const REST_RATE: f32 = 2.0;
const REST_CLIMB: f32 = 0.5;

impl Asked {
    /// Reads the commands of a step.
    #[must_use]
    pub fn read(commands: &[GuidedKind]) -> Self {
        let has = |kind: GuidedKind| commands.contains(&kind);
        Self {
            kill: has(GuidedKind::Kill),
            disarm: has(GuidedKind::Disarm),
            land: has(GuidedKind::Land),
            take_off: has(GuidedKind::TakeOff),
            arm: has(GuidedKind::Arm),
            route: has(GuidedKind::WayPoint) || has(GuidedKind::Hold),
            flip: commands.iter().any(|kind| kind.flip().is_some()),
            any: !commands.is_empty(),
        }
    }

    /// Does a program want to fly? Commands that only end a flight need no authority.
    #[must_use]
    pub const fn flies(&self) -> bool {
        self.arm || self.take_off || self.route || self.flip
    }
}

/// What is true in one step. The default is a vehicle that has just been switched on: nothing is known, and nothing was asked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Facts {
    /// The instant of the step.
    pub now: Instant,
    /// The failsafe's findings.
    pub alerts: Alerts,
    /// What of the estimate may be used.
    pub valid: Validity,
    /// Height above the surface, m. A number only with [`Validity::HEIGHT`].
    pub height: f32,
    /// Height over the place of take-off, m.
    pub climbed: f32,
    /// Tilt, rad.
    pub tilt: f32,
    /// The still-calibration is complete.
    pub calibrated: bool,
    /// How far the still-calibration is, 0 to 1.
    pub calibration: f32,
    /// Contact with the ground.
    pub contact: GroundContact,
    /// Take-off has reached its height.
    pub takeoff_complete: bool,
    /// Touchdown is sure.
    pub landed: bool,
    /// What programs ask for.
    pub asked: Asked,
    /// What the pilot's transmitter says.
    pub pilot: Heard,
    /// Whose sticks the controllers follow.
    pub sticks: CommandSource,
    /// A press of the button stops the motors.
    pub stop_button: bool,
    /// A gesture on the button that stopped nothing.
    pub button: Option<ButtonGesture>,
    /// A click does not arm: something blocked that when the button was pressed.
    pub click_is_void: bool,
    /// The cut-off has stopped the motors.
    pub cut_off: bool,
    /// Cosine of the tilt; less than zero is upside down.
    pub upright: f32,
    /// It hardly turns, climbs and sinks.
    pub at_rest: bool,
}

impl Facts {
    pub(crate) fn read(
        now: Instant,
        input: &ModeInput<'_>,
        pilot: Heard,
        armed: bool,
        stop_button: bool,
        button: Option<ButtonGesture>,
    ) -> Self {
        Self {
            now,
            alerts: input.alerts,
            valid: input.estimate.valid,
            height: input.estimate.height,
            climbed: -input.estimate.position.z,
            // Only the checks before arming ask for it, and an arc cosine is a tenth of a step.
            tilt: if armed { 0.0 } else { frame::tilt(&input.estimate.attitude) },
            calibrated: input.calibration.complete,
            calibration: input.calibration.progress,
            contact: input.land_detected.contact,
            takeoff_complete: input.land_detected.takeoff_complete,
            landed: input.land_detected.landed,
            asked: Asked::read(input.commands),
            pilot,
            sticks: input.sticks,
            stop_button,
            button,
            click_is_void: false,
            cut_off: input.cut_off,
            upright: frame::cos_tilt(&input.estimate.attitude),
            at_rest: input.estimate.angular_rate.norm_squared() < REST_RATE * REST_RATE
                && input.estimate.velocity.z.abs() < REST_CLIMB,
        }
    }

    /// The height, if it is known.
    #[must_use]
    pub fn known_height(&self) -> Option<f32> {
        (self.valid.contains(Validity::HEIGHT) && self.height.is_finite()).then_some(self.height)
    }

    /// Is the pilot's throttle where thrust would be none? Not when no pilot is heard.
    #[must_use]
    pub fn throttle_rests(&self, config: &ModeConfig) -> bool {
        self.pilot.frame.as_ref().is_some_and(|(_, input)| input.throttle <= config.throttle_rest)
    }

    /// Does a click ask for arming?
    #[must_use]
    pub fn click_arms(&self) -> bool {
        self.button == Some(ButtonGesture::Click) && !self.click_is_void
    }

    /// Has the button just been pressed, by a person at the vehicle?
    #[must_use]
    pub fn pressed(&self) -> bool {
        self.stop_button || self.button == Some(ButtonGesture::Press)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::Vec3;
    use stampfly_types::messages::{CalibrationResult, LandDetected, StateEstimate};

    #[test]
    fn a_program_that_only_ends_a_flight_needs_no_authority() {
        use GuidedKind::{Arm, Disarm, Hold, Kill, Land, TakeOff, WayPoint};
        for kind in [Arm, TakeOff, WayPoint, Hold] {
            assert!(Asked::read(&[kind]).flies(), "{kind:?}");
        }
        let flip = GuidedKind::ALL.iter().find(|kind| kind.flip().is_some()).expect("a flip");
        assert!(Asked::read(&[*flip]).flies());
        for kind in [Kill, Disarm, Land, GuidedKind::None] {
            assert!(!Asked::read(&[kind]).flies(), "{kind:?}");
        }
    }

    #[test]
    fn rest_is_to_turn_climb_and_sink_slowly() {
        let rests = |rate: f32, sink_rate: f32| {
            let estimate = StateEstimate {
                angular_rate: Vec3::new(0.6 * rate, 0.0, -0.8 * rate),
                velocity: Vec3::new(9.0, 0.0, sink_rate),
                ..Default::default()
            };
            let input = ModeInput {
                alerts: Alerts::NONE,
                estimate: &estimate,
                calibration: &CalibrationResult::default(),
                land_detected: &LandDetected::default(),
                pilot: None,
                sticks: CommandSource::None,
                commands: &[],
                button: None,
                cut_off: false,
            };
            Facts::read(Instant::ZERO, &input, Heard::default(), true, false, None).at_rest
        };
        assert!(rests(0.0, 0.0) && rests(1.9, 0.45) && rests(1.9, -0.45));
        assert!(!rests(2.1, 0.0) && !rests(0.0, 0.55) && !rests(0.0, -0.55));
    }
}
