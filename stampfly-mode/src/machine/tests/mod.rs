//! The machine from outside, step by step, in a world that tells it what it wants to hear.

mod arming;
mod authority;
mod degraded;
mod exhaustive;
mod phases;
mod stopping;

use super::*;
use stampfly_types::Duration;
use stampfly_types::messages::{
    Alerts, CalibrationResult, FlightMode, GroundContact, GuidedKind, LandDetected, PilotInput, StateEstimate, Validity,
};

/// Range, flow and barometer.
const SENSORS_LOST: Alerts = Alerts::TOF_LOST.with(Alerts::FLOW_LOST).with(Alerts::BARO_LOST);
const STEP: Duration = Duration::from_micros(2_500);

/// A situation the machine can be put into.
#[derive(Clone)]
pub(crate) struct World {
    pub estimate: StateEstimate,
    pub calibration: CalibrationResult,
    pub land_detected: LandDetected,
    pub alerts: Alerts,
    /// Sends a frame every 20 ms.
    pub pilot: Option<PilotInput>,
    /// What the controllers follow; `None` for the commander's sticks, at once.
    pub sticks: Option<CommandSource>,
    /// Happens in the next step, and not again.
    pub button: Option<ButtonGesture>,
    pub cut_off: bool,
    pub now: Instant,
}

impl World {
    pub fn ready() -> Self {
        Self {
            estimate: StateEstimate { height: 0.03, valid: Validity::ALL, ..Default::default() },
            calibration: CalibrationResult { complete: true, ..Default::default() },
            land_detected: LandDetected::default(),
            alerts: Alerts::NONE,
            pilot: None,
            sticks: None,
            button: None,
            cut_off: false,
            now: Instant::ZERO,
        }
    }

    pub fn step(&mut self, machine: &mut ModeMachine, commands: &[Command]) -> ModeOutput {
        self.now += STEP;
        let frame_at = Instant::from_micros(self.now.as_micros() / 20_000 * 20_000);
        let input = ModeInput {
            alerts: self.alerts,
            estimate: &self.estimate,
            calibration: &self.calibration,
            land_detected: &self.land_detected,
            pilot: self.pilot.as_ref().map(|pilot| (frame_at, pilot)),
            sticks: self.sticks.unwrap_or(machine.state.commander),
            commands,
            button: self.button.take(),
            cut_off: self.cut_off,
        };
        machine.step(self.now, &input)
    }

    /// Lets this time pass, and returns the last decision.
    pub fn pass(&mut self, machine: &mut ModeMachine, millis: u64) -> FlightStatus {
        let end = self.now + Duration::from_millis(millis);
        let mut status = self.step(machine, &[]).flight_status;
        while self.now < end {
            status = self.step(machine, &[]).flight_status;
        }
        status
    }

    /// The pilot sends this for long enough to be believed.
    pub fn sends(&mut self, machine: &mut ModeMachine, pilot: PilotInput) -> FlightStatus {
        self.pilot = Some(pilot);
        self.pass(machine, 120)
    }

    /// The vehicle is in the air, so high.
    pub fn fly_at(&mut self, height: f32) {
        self.estimate.height = height;
        self.land_detected.contact = GroundContact::Air;
    }
}

/// A phase reached by program, in a vehicle that flies at 1.5 m.
pub(crate) fn in_phase(phase: FlightPhase) -> (ModeMachine, World) {
    let (mut machine, mut world) = (ModeMachine::default(), World::ready());
    for command in [Command::None, Command::Arm, Command::TakeOff, Command::None, Command::Land] {
        if machine.state.phase == phase {
            break;
        }
        if machine.state.phase == FlightPhase::TakeOff {
            world.fly_at(1.5);
            world.land_detected.takeoff_complete = true;
        }
        world.step(&mut machine, &[command]);
    }
    world.land_detected.takeoff_complete = false;
    if phase == FlightPhase::IdleHeld {
        (machine, world) = in_phase(FlightPhase::IdleGround);
        world.estimate.height = 0.5;
        world.step(&mut machine, &[]);
    }
    assert_eq!(machine.state.phase, phase);
    (machine, world)
}

#[test]
fn a_new_machine_is_one_that_has_just_been_switched_on() {
    let machine = ModeMachine::new(ModeConfig::default());
    assert_eq!(machine.state(), ModeMachine::default().state());
    assert_eq!((machine.state().phase, machine.refusals().count()), (FlightPhase::Init, 0));
}

fn frame(mode: FlightMode, arm: bool, throttle: f32) -> PilotInput {
    PilotInput { mode, arm, throttle, ..Default::default() }
}

/// The pilot has armed by switch and flies at 1.5 m in this mode.
fn piloted(mode: FlightMode) -> (ModeMachine, World) {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.sends(&mut machine, frame(mode, false, 0.0));
    assert!(world.sends(&mut machine, frame(mode, true, 0.0)).armed);
    world.sends(&mut machine, frame(mode, true, 0.3));
    world.pass(&mut machine, 300);
    world.fly_at(1.5);
    world.land_detected.takeoff_complete = true;
    let status = world.pass(&mut machine, 10);
    assert_eq!((status.phase, status.mode, status.commander), (FlightPhase::Flying, mode, CommandSource::Pilot));
    world.land_detected.takeoff_complete = false;
    (machine, world)
}

/// Lets time pass without a gesture, then one.
fn press(world: &mut World, machine: &mut ModeMachine, after: Duration, gesture: ButtonGesture) -> FlightStatus {
    world.now += after;
    world.button = Some(gesture);
    world.step(machine, &[]).flight_status
}
