//! The machine: its table explored completely, its steps at random.

use std::collections::BTreeSet;

use proptest::prelude::*;
use stampfly_mode::machine::{Decision, Event, Facts, armed, next};
use stampfly_mode::{ModeInput, ModeMachine, ModeOutput};
use stampfly_types::messages::{
    Alerts, ArmBlocks, ButtonGesture, CalibrationResult, CommandSetpoint, CommandSource, FlightMode, FlightState,
    GroundContact, GuidedCommand, GuidedKind, PilotInput, StateEstimate, SystemAlert, Validity, VehicleStatus,
};
use stampfly_types::{Micros, Quat};

use FlightState::{Armed, Flying, IdleGround, IdleHeld, Init, Landing, TakeOff};

/// All transitions there are. A change of the table must be a change of this list.
const TRANSITIONS: [(FlightState, FlightState); 12] = [
    (Init, IdleGround),
    (IdleGround, IdleHeld),
    (IdleHeld, IdleGround),
    (IdleGround, Armed),
    (Armed, IdleGround),
    (Armed, TakeOff),
    (TakeOff, IdleGround),
    (TakeOff, Flying),
    (TakeOff, Landing),
    (Flying, IdleGround),
    (Flying, Landing),
    (Landing, IdleGround),
];

fn every_case() -> impl Iterator<Item = (FlightState, Event, Facts)> {
    FlightState::ALL.iter().flat_map(|state| {
        Event::ALL.iter().flat_map(move |event| {
            [ArmBlocks::NONE, ArmBlocks::TILTED]
                .into_iter()
                .flat_map(move |blocks| [false, true].map(move |manual| (*state, *event, Facts { blocks, manual })))
        })
    })
}

#[test]
fn the_table_makes_exactly_the_listed_transitions() {
    let expected: BTreeSet<_> = TRANSITIONS.into_iter().collect();
    let found: BTreeSet<_> = every_case()
        .filter_map(|(state, event, facts)| match next(state, event, &facts) {
            Decision::Go(to) => Some((state, to)),
            Decision::Stay | Decision::Refuse(_) => None,
        })
        .collect();
    assert_eq!(found, expected);
}

#[test]
fn the_table_keeps_its_invariants() {
    for (state, event, facts) in every_case() {
        let decision = next(state, event, &facts);
        let case = format!("{state:?} {event:?} {facts:?} -> {decision:?}");
        let to = match decision {
            Decision::Go(to) => to,
            Decision::Stay | Decision::Refuse(_) => state,
        };
        if matches!(event, Event::Kill | Event::Crash) {
            assert!(!armed(to), "motors stop in one step: {case}");
        }
        if armed(to) && !armed(state) {
            assert_eq!((state, event, to), (IdleGround, Event::Arm, Armed), "the only way to arm: {case}");
            assert!(facts.blocks.is_empty(), "with nothing against it: {case}");
        }
        if let Decision::Refuse(blocks) = decision {
            assert!(!blocks.is_empty(), "a refusal has a reason: {case}");
        }
        if state == Landing {
            assert!(to == Landing || to == IdleGround, "a landing is not taken back: {case}");
        }
        let must_come_down = matches!(event, Event::EstimateLost | Event::BatteryCritical | Event::LinkLost);
        if must_come_down && matches!(state, TakeOff | Flying) {
            assert_eq!(to, Landing, "{case}");
        }
    }
}

#[test]
fn every_airborne_state_is_two_steps_from_the_ground() {
    for state in [TakeOff, Flying, Landing] {
        for manual in [false, true] {
            let facts = Facts { manual, ..Facts::default() };
            let step = |state, event| match next(state, event, &facts) {
                Decision::Go(to) => to,
                Decision::Stay | Decision::Refuse(_) => state,
            };
            assert_eq!(step(step(state, Event::Land), Event::Landed), IdleGround, "{state:?}");
        }
    }
}

/// A machine with everything in order around it.
struct Bench {
    machine: ModeMachine,
    now: Micros,
    output: ModeOutput,
    alerts: Alerts,
    estimate: StateEstimate,
    calibration: CalibrationResult,
    status: VehicleStatus,
    command: CommandSetpoint,
    pilot: Option<PilotInput>,
    guided: Vec<GuidedCommand>,
    button: ButtonGesture,
    paired: bool,
}

impl Bench {
    fn new() -> Self {
        Self {
            machine: ModeMachine::default(),
            now: Micros::from_secs(4),
            output: ModeOutput::default(),
            alerts: Alerts::NONE,
            estimate: StateEstimate { valid: Validity::ALL, ..StateEstimate::default() },
            calibration: CalibrationResult { complete: true, ..CalibrationResult::default() },
            status: VehicleStatus::default(),
            command: CommandSetpoint::default(),
            pilot: None,
            guided: Vec::new(),
            button: ButtonGesture::None,
            paired: false,
        }
    }

    /// One period; commands and gestures are taken away afterwards, levels stay.
    fn step(&mut self) -> FlightState {
        self.now += Micros(2_500);
        let alert = SystemAlert { active: self.alerts, seen: self.alerts };
        self.output = self.machine.step(
            self.now,
            &ModeInput {
                alert: &alert,
                estimate: &self.estimate,
                calibration: &self.calibration,
                status: &self.status,
                command: &self.command,
                pilot: self.pilot.as_ref(),
                guided: &self.guided,
                button: self.button,
                paired: self.paired,
            },
        );
        self.guided.clear();
        (self.button, self.paired) = (ButtonGesture::None, false);
        self.output.mode.state
    }

    fn run(&mut self, seconds: f32) -> FlightState {
        for _ in 0..(seconds / 0.0025) as u32 {
            self.step();
        }
        self.output.mode.state
    }

    fn command(&mut self, kinds: &[GuidedKind]) -> FlightState {
        self.guided = kinds.iter().map(|kind| GuidedCommand { kind: *kind, ..GuidedCommand::default() }).collect();
        self.step()
    }

    fn switch(&mut self, arm: bool) -> FlightState {
        let pilot = self.pilot.unwrap_or(PilotInput { mode: FlightMode::PosHold, ..PilotInput::default() });
        self.pilot = Some(PilotInput { arm, ..pilot });
        self.command.source = CommandSource::Pilot;
        self.step()
    }

    fn air(&mut self) -> &mut Self {
        self.status.contact = GroundContact::Air;
        self
    }

    /// In the air by program.
    fn guided_flight() -> Self {
        let mut bench = Self::new();
        bench.command.source = CommandSource::Guided;
        bench.step();
        bench.command(&[GuidedKind::Arm, GuidedKind::TakeOff]);
        assert_eq!(bench.run(0.31), TakeOff);
        bench.air().status.takeoff_complete = true;
        assert_eq!(bench.step(), Flying);
        bench.status.takeoff_complete = false;
        bench
    }

    /// In the air by switch, in this mode.
    fn piloted_flight(mode: FlightMode) -> Self {
        let mut bench = Self::new();
        bench.pilot = Some(PilotInput { mode, ..PilotInput::default() });
        bench.switch(false);
        assert_eq!(bench.switch(true), Armed);
        bench.command.throttle = 0.6;
        assert_eq!(bench.run(0.31), TakeOff);
        bench.air().status.takeoff_complete = true;
        assert_eq!(bench.step(), Flying);
        bench.status.takeoff_complete = false;
        assert_eq!(bench.output.mode.mode, mode);
        bench
    }
}

#[test]
fn starts_when_calibrated_and_upright() {
    let mut bench = Bench::new();
    bench.calibration.complete = false;
    assert_eq!(bench.run(1.0), Init);
    bench.calibration.complete = true;
    bench.estimate.valid = Validity::NONE;
    assert_eq!(bench.run(1.0), Init);
    bench.estimate.valid = Validity::TILT;
    assert_eq!(bench.step(), IdleGround);
}

#[test]
fn a_switch_that_was_on_at_power_on_does_not_arm() {
    let mut bench = Bench::new();
    bench.pilot = Some(PilotInput { arm: true, mode: FlightMode::PosHold, ..PilotInput::default() });
    assert_eq!(bench.run(2.0), IdleGround);
    assert_eq!(bench.output.mode.blocks, ArmBlocks::ARM_SWITCH);
    bench.switch(false);
    assert_eq!(bench.output.mode.blocks, ArmBlocks::NONE);
    assert_eq!(bench.switch(true), Armed);
}

#[test]
fn a_refused_edge_is_used_up() {
    let mut bench = Bench::new();
    bench.switch(false);
    bench.alerts = Alerts::LOW_BATTERY;
    assert_eq!(bench.switch(true), IdleGround);
    assert_eq!(bench.output.mode.blocks, ArmBlocks::LOW_BATTERY, "the reason is there when it is refused");
    bench.alerts = Alerts::NONE;
    assert_eq!(bench.run(1.0), IdleGround, "and it does not arm by itself later");
}

#[test]
fn only_the_switch_takes_off_by_itself() {
    let mut bench = Bench::new();
    bench.switch(false);
    bench.switch(true);
    assert_eq!(bench.run(0.29), Armed, "spooling up");
    assert_eq!(bench.run(0.02), TakeOff);

    let mut bench = Bench::new();
    bench.step();
    bench.button = ButtonGesture::Click;
    assert_eq!(bench.step(), Armed);
    assert_eq!(bench.run(5.0), Armed, "a finger is close to the propellers");
    assert_eq!(bench.command(&[GuidedKind::TakeOff]), TakeOff);

    let mut bench = Bench::new();
    bench.step();
    bench.command(&[GuidedKind::Arm]);
    assert_eq!(bench.run(5.0), Armed);
    assert_eq!(bench.run(30.0), IdleGround, "standing armed for too long");

    let mut bench = Bench::new();
    bench.pilot = Some(PilotInput { mode: FlightMode::Stabilize, ..PilotInput::default() });
    bench.switch(false);
    bench.switch(true);
    assert_eq!(bench.run(2.0), Armed, "direct thrust waits for the throttle");
    bench.command.throttle = 0.6;
    assert_eq!(bench.step(), TakeOff);
}

#[test]
fn a_take_off_sent_before_arming_is_forgotten() {
    let mut bench = Bench::new();
    bench.step();
    bench.command(&[GuidedKind::TakeOff]);
    bench.command(&[GuidedKind::Arm]);
    assert_eq!(bench.run(2.0), Armed);
}

#[test]
fn without_a_link_the_button_does_not_arm() {
    let mut bench = Bench::new();
    bench.step();
    bench.alerts = Alerts::COMM_LOST;
    bench.button = ButtonGesture::Click;
    assert_eq!(bench.step(), IdleGround);
}

#[test]
fn emergencies_stop_the_motors_in_one_step_in_every_armed_state() {
    let emergencies: [fn(&mut Bench); 6] = [
        |b| b.alerts = Alerts::IMPACT,
        |b| b.alerts = Alerts::GYRO_ANOMALY,
        |b| b.alerts = Alerts::TUMBLED,
        |b| b.alerts = Alerts::IMU_LOST,
        |b| b.pilot = Some(PilotInput { kill: true, ..PilotInput::default() }),
        |b| b.guided = vec![GuidedCommand { kind: GuidedKind::Kill, ..GuidedCommand::default() }],
    ];
    for emergency in emergencies {
        for state in [Armed, TakeOff, Flying, Landing] {
            let mut bench = Bench::guided_flight();
            match state {
                Flying => {}
                Landing => assert_eq!(bench.command(&[GuidedKind::Land]), Landing),
                _ => {
                    bench = Bench::new();
                    bench.step();
                    bench.command(&[GuidedKind::Arm]);
                    if state == TakeOff {
                        bench.command(&[GuidedKind::TakeOff]);
                        assert_eq!(bench.run(0.31), TakeOff);
                    }
                }
            }
            assert_eq!(bench.output.mode.state, state);
            emergency(&mut bench);
            assert_eq!(bench.step(), IdleGround, "{state:?}");
            assert!(!bench.output.mode.armed);
        }
    }
}

#[test]
fn after_a_crash_nothing_arms_until_somebody_has_seen_it() {
    let acknowledge: [fn(&mut Bench); 3] = [
        |b| b.button = ButtonGesture::Click,
        |b| b.guided = vec![GuidedCommand { kind: GuidedKind::Disarm, ..GuidedCommand::default() }],
        |b| {
            b.switch(true);
            b.pilot = Some(PilotInput { arm: false, ..b.pilot.unwrap_or_default() });
        },
    ];
    for acknowledge in acknowledge {
        let mut bench = Bench::guided_flight();
        bench.alerts = Alerts::IMPACT;
        let resets = bench.output.estimator.full_resets;
        bench.step();
        assert_eq!(bench.output.estimator.full_resets, resets + 1, "the estimate may be anything after a crash");
        bench.alerts = Alerts::NONE;
        bench.status.contact = GroundContact::Ground;
        // A parked transmitter whose switch is off is no acknowledgement.
        bench.switch(false);
        assert_eq!(bench.command(&[GuidedKind::Arm]), IdleGround);
        assert!(bench.output.mode.blocks.contains(ArmBlocks::CRASHED));
        acknowledge(&mut bench);
        bench.step();
        assert!(!bench.output.mode.blocks.contains(ArmBlocks::CRASHED));
        assert_eq!(bench.command(&[GuidedKind::Arm]), Armed);
    }
}

#[test]
fn a_lost_link_hovers_then_lands_and_does_not_come_back() {
    let mut bench = Bench::piloted_flight(FlightMode::PosHold);
    bench.alerts = Alerts::COMM_LOST;
    assert_eq!(bench.run(2.9), Flying, "hovering");
    bench.alerts = Alerts::NONE;
    bench.run(1.0);
    bench.alerts = Alerts::COMM_LOST;
    assert_eq!(bench.run(2.9), Flying, "it was back in time: the grace starts anew");
    assert_eq!(bench.run(0.2), Landing);
    bench.alerts = Alerts::NONE;
    assert_eq!(bench.run(1.0), Landing);
    bench.status.landed = true;
    assert_eq!(bench.step(), IdleGround);

    let mut manual = Bench::piloted_flight(FlightMode::Stabilize);
    manual.alerts = Alerts::COMM_LOST;
    assert_eq!(manual.step(), Landing, "with direct thrust there is nothing to hover with");
}

#[test]
fn disarming_lands_where_height_is_held_and_stops_where_it_is_not() {
    let mut bench = Bench::piloted_flight(FlightMode::AltHold);
    assert_eq!(bench.switch(false), Landing);
    bench.switch(true);
    assert_eq!(bench.output.mode.state, Landing, "arming does not take a landing back");
    assert_eq!(bench.switch(false), IdleGround, "the second time means now");
    assert_eq!(Bench::piloted_flight(FlightMode::Acro).switch(false), IdleGround);
}

#[test]
fn levels_that_must_land_do() {
    for alerts in [Alerts::CRITICAL_BATTERY, Alerts::ESTIMATE_DIVERGED] {
        let mut bench = Bench::guided_flight();
        bench.alerts = alerts;
        assert_eq!(bench.step(), Landing, "{alerts:?}");
    }
    let mut bench = Bench::guided_flight();
    bench.estimate.valid = Validity::TILT;
    assert_eq!(bench.run(0.4), Flying, "the controller bridges a short gap");
    assert_eq!(bench.run(0.2), Landing, "height is gone");
}

#[test]
fn modes_fall_back_and_come_back() {
    let flowless = Validity::ALL.without(Validity::VELOCITY_XY | Validity::POSITION_XY);
    let mut bench = Bench::piloted_flight(FlightMode::PosHold);
    bench.estimate.valid = flowless;
    bench.run(0.9);
    assert_eq!(bench.output.mode.mode, FlightMode::PosHold);
    bench.run(0.2);
    assert_eq!(bench.output.mode.mode, FlightMode::AltHold);
    assert_eq!(bench.run(10.0), Flying, "a pilot flies on without");
    bench.estimate.valid = Validity::ALL;
    bench.run(1.1);
    assert_eq!(bench.output.mode.mode, FlightMode::PosHold);

    let mut bench = Bench::guided_flight();
    bench.estimate.valid = flowless;
    assert_eq!(bench.run(3.9), Flying);
    assert_eq!(bench.run(0.2), Landing, "a program cannot");

    let mut bench = Bench::new();
    bench.estimate.valid = Validity::TILT;
    bench.run(0.1);
    assert_eq!(bench.output.mode.mode, FlightMode::Stabilize, "on the ground the fall goes all the way");
}

#[test]
fn a_parked_transmitter_does_not_override_a_program() {
    let mut bench = Bench::new();
    bench.pilot = Some(PilotInput { mode: FlightMode::Stabilize, ..PilotInput::default() });
    bench.step();
    bench.command.source = CommandSource::Guided;
    bench.command(&[GuidedKind::Arm, GuidedKind::TakeOff]);
    assert_eq!(bench.run(0.4), TakeOff);
    assert_eq!(bench.output.mode.mode, FlightMode::PosHold);
    // A switch that is moved is another matter.
    bench.air().status.takeoff_complete = true;
    bench.step();
    bench.pilot = Some(PilotInput { mode: FlightMode::AltHold, ..PilotInput::default() });
    bench.step();
    assert_eq!(bench.output.mode.mode, FlightMode::AltHold);
}

#[test]
fn held_in_a_hand_it_does_not_arm_and_starts_anew_when_set_down() {
    let mut bench = Bench::new();
    bench.step();
    bench.air();
    assert_eq!(bench.step(), IdleHeld);
    assert!(!bench.output.estimator.on_ground);
    assert_eq!(bench.command(&[GuidedKind::Arm]), IdleHeld);
    assert!(bench.output.mode.blocks.contains(ArmBlocks::NOT_ON_GROUND));
    let resets = bench.output.estimator.full_resets;
    bench.status.contact = GroundContact::Ground;
    assert_eq!(bench.step(), IdleGround);
    assert_eq!(bench.output.estimator.full_resets, resets + 1);
    bench.command(&[GuidedKind::Arm]);
    bench.air();
    assert_eq!(bench.step(), IdleGround, "lifted while armed: off");
}

#[test]
fn a_take_off_that_does_not_leave_the_ground_is_given_up() {
    let mut bench = Bench::new();
    bench.step();
    bench.command(&[GuidedKind::Arm, GuidedKind::TakeOff]);
    assert_eq!(bench.run(5.0), TakeOff);
    assert_eq!(bench.run(0.5), IdleGround);
    assert_eq!(bench.machine.last_transition().map(|t| t.event), Some(Event::Unsafe));
}

#[test]
fn pairing_blocks_arming_and_arming_blocks_pairing() {
    let mut bench = Bench::new();
    bench.step();
    bench.button = ButtonGesture::HoldPair;
    bench.step();
    assert!(bench.output.mode.pairing);
    assert_eq!(bench.command(&[GuidedKind::Arm]), IdleGround);
    assert_eq!(bench.output.mode.blocks, ArmBlocks::PAIRING);
    bench.paired = true;
    bench.step();
    assert!(!bench.output.mode.pairing);
    bench.command(&[GuidedKind::Arm]);
    bench.button = ButtonGesture::HoldPair;
    bench.step();
    assert!(!bench.output.mode.pairing);
}

#[test]
fn entering_resets_what_must_start_anew() {
    let mut bench = Bench::new();
    bench.step();
    let before = bench.output;
    bench.command(&[GuidedKind::Arm]);
    assert_eq!(bench.output.estimator.origin_resets, before.estimator.origin_resets + 1);
    assert_eq!(bench.output.mode.control_resets, before.mode.control_resets + 1);
    assert!(bench.output.estimator.on_ground);
    bench.command(&[GuidedKind::TakeOff]);
    bench.run(0.31);
    assert!(!bench.output.estimator.on_ground);
}

#[derive(Clone, Debug)]
struct Inputs {
    alerts: u32,
    valid: bool,
    contact: bool,
    landed: bool,
    complete: bool,
    pilot: Option<(bool, bool, usize)>,
    guided: Option<usize>,
    click: bool,
    source: usize,
    steps: u32,
}

prop_compose! {
    fn inputs()(
        alerts in prop_oneof![4 => Just(0u32), 1 => any::<u32>()], valid in prop::bool::weighted(0.9),
        contact: bool, landed: bool, complete: bool,
        pilot in prop::option::of((any::<bool>(), prop::bool::weighted(0.05), 0usize..4)),
        guided in prop::option::of(0usize..8), click in prop::bool::weighted(0.1), source in 0usize..4, steps in 1u32..200,
    ) -> Inputs {
        Inputs { alerts, valid, contact, landed, complete, pilot, guided, click, source, steps }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn random_lives_keep_the_invariants(life in prop::collection::vec(inputs(), 1..30)) {
        let mut bench = Bench::new();
        for inputs in life {
            let set: Alerts = Alerts::NAMES
                .iter()
                .enumerate()
                .filter(|(n, _)| inputs.alerts >> n & 7 == 7)
                .fold(Alerts::NONE, |set, (n, _)| set | flag(n));
            bench.alerts = set;
            bench.estimate.valid = if inputs.valid { Validity::ALL } else { Validity::TILT };
            bench.status.contact = if inputs.contact { GroundContact::Air } else { GroundContact::Ground };
            (bench.status.landed, bench.status.takeoff_complete) = (inputs.landed, inputs.complete);
            bench.pilot = inputs.pilot.map(|(arm, kill, mode)| PilotInput {
                arm, kill, mode: FlightMode::ALL[mode], ..PilotInput::default()
            });
            bench.command.source = CommandSource::ALL[inputs.source];
            if let Some(kind) = inputs.guided {
                bench.guided.push(GuidedCommand { kind: GuidedKind::ALL[kind], ..GuidedCommand::default() });
            }
            bench.button = if inputs.click { ButtonGesture::Click } else { ButtonGesture::None };
            for _ in 0..inputs.steps {
                let before = bench.output.mode;
                let killed = bench.pilot.is_some_and(|pilot| pilot.kill)
                    || bench.guided.iter().any(|command| command.kind == GuidedKind::Kill);
                let crash = Alerts::IMPACT | Alerts::GYRO_ANOMALY | Alerts::TUMBLED | Alerts::IMU_LOST;
                bench.step();
                let mode = bench.output.mode;
                prop_assert_eq!(mode.armed, armed(mode.state), "armed says what the state says");
                if killed || bench.alerts.intersects(crash) {
                    prop_assert!(!mode.armed, "stopped in this very step");
                }
                if mode.state == before.state {
                    prop_assert_eq!(mode.transitions, before.transitions);
                } else {
                    prop_assert_eq!(mode.transitions, before.transitions + 1, "one at a time");
                    prop_assert!(TRANSITIONS.contains(&(before.state, mode.state)), "{before:?} {mode:?}");
                }
                if mode.armed && !before.armed {
                    prop_assert!(before.state == IdleGround && mode.state == Armed);
                    prop_assert!(mode.blocks.is_empty());
                }
                prop_assert!(!(mode.armed && mode.pairing));
            }
        }
        // Whatever happened: lost for good, it comes down and stops.
        bench.alerts = Alerts::COMM_LOST;
        (bench.pilot, bench.command.source) = (None, CommandSource::Failsafe);
        bench.status = VehicleStatus { contact: GroundContact::Air, ..VehicleStatus::default() };
        bench.run(4.0);
        bench.status.landed = true;
        bench.step();
        prop_assert!(!bench.output.mode.armed, "{:?}", bench.output.mode);
    }
}

fn flag(index: usize) -> Alerts {
    [
        Alerts::COMM_LOST,
        Alerts::IMPACT,
        Alerts::LOW_BATTERY,
        Alerts::CRITICAL_BATTERY,
        Alerts::USB_POWER,
        Alerts::ESTIMATE_DIVERGED,
        Alerts::GYRO_ANOMALY,
        Alerts::IMU_DEGRADED,
        Alerts::IMU_LOST,
        Alerts::TUMBLED,
        Alerts::TOF_LOST,
        Alerts::FLOW_LOST,
        Alerts::TILT_MISMATCH,
    ][index]
}

#[test]
fn a_tilted_vehicle_does_not_arm() {
    let mut bench = Bench::new();
    bench.step();
    bench.estimate.attitude = Quat::from_euler_angles(0.5, 0.0, 0.0);
    assert_eq!(bench.command(&[GuidedKind::Arm]), IdleGround);
    assert_eq!(bench.output.mode.blocks, ArmBlocks::TILTED);
}
