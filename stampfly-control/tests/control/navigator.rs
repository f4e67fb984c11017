//! The navigator with a vehicle that follows perfectly, so that whatever is wrong is the path's fault.

use proptest::prelude::*;
use stampfly_control::guidance::{Navigator, NavigatorInput, Refusal, Route};
use stampfly_types::messages::{
    CommandSetpoint, CommandSource, FlightMode, FlightPhase, FlightStatus, GuidedCommand, GuidedKind, LandDetected,
    Setpoint, SetpointAxes, StateEstimate, Validity,
};
use stampfly_types::{Duration, Instant, Quat, Vec3};

const DT: f32 = 0.0025;

struct Bench {
    navigator: Navigator,
    now: Instant,
    mode: FlightStatus,
    estimate: StateEstimate,
    land_detected: LandDetected,
    command: CommandSetpoint,
    setpoint: Setpoint,
}

impl Bench {
    /// Standing at the origin.
    fn new() -> Self {
        let mut bench = Self {
            navigator: Navigator::default(),
            now: Instant::ZERO,
            mode: FlightStatus { phase: FlightPhase::IdleGround, mode: FlightMode::PosHold, ..FlightStatus::default() },
            estimate: StateEstimate { valid: Validity::ALL, ..StateEstimate::default() },
            land_detected: LandDetected { descent_rate: 0.3, ..LandDetected::default() },
            command: CommandSetpoint { source: CommandSource::Guided, ..CommandSetpoint::default() },
            setpoint: Setpoint::default(),
        };
        bench.run(0.1);
        bench
    }

    /// At the take-off height.
    fn aloft() -> Self {
        let mut bench = Self::new();
        bench.enter(FlightPhase::TakeOff);
        bench.run(5.0);
        assert!((bench.estimate.position.z + 0.5).abs() < 1e-3, "default height: {:?}", bench.setpoint);
        bench.enter(FlightPhase::Flying);
        bench
    }

    fn enter(&mut self, phase: FlightPhase) {
        self.mode.phase = phase;
        self.mode.armed = true;
    }

    fn step(&mut self) -> Setpoint {
        self.now += Duration::from_micros(2_500);
        self.setpoint = self.navigator.step(
            self.now,
            &NavigatorInput {
                flight_status: &self.mode,
                estimate: &self.estimate,
                land_detected: &self.land_detected,
                command: &self.command,
            },
        );
        self.setpoint
    }

    fn follow(&mut self) {
        let setpoint = self.step();
        self.estimate.position = setpoint.position;
        self.estimate.velocity = setpoint.velocity;
        self.estimate.attitude = Quat::from_euler_angles(0.0, 0.0, setpoint.yaw);
    }

    fn run(&mut self, seconds: f32) {
        for _ in 0..(seconds / DT) as u32 {
            self.follow();
        }
    }

    fn send(&mut self, kind: GuidedKind, position: [f32; 3]) -> Result<(), Refusal> {
        let command = GuidedCommand { kind, position: position.into(), ..GuidedCommand::default() };
        self.navigator.accept(&command).map_err(|refused| {
            assert_eq!(refused.command.kind, kind, "given back");
            refused.reason
        })
    }
}

#[test]
fn on_the_ground_the_path_is_where_the_vehicle_is() {
    let mut bench = Bench::new();
    for position in [Vec3::new(3.0, -2.0, 0.1), Vec3::new(-1.0, 0.0, 0.0)] {
        bench.estimate.position = position;
        let setpoint = bench.step();
        assert_eq!((setpoint.position, setpoint.velocity), (position, Vec3::zeros()));
        assert_eq!(setpoint.axes, SetpointAxes::NONE);
    }
}

#[test]
fn takes_off_to_the_height_asked_for_over_the_place_it_stands() {
    for (asked, expected) in [(0.0, 0.5), (-1.2, 1.2), (-50.0, 3.0), (-0.01, 0.2)] {
        let mut bench = Bench::new();
        bench.estimate.position = Vec3::new(2.0, 1.0, -0.3);
        bench.step();
        bench.send(GuidedKind::TakeOff, [9.0, 9.0, asked]).expect("accepted");
        bench.enter(FlightPhase::TakeOff);
        bench.run(12.0);
        assert!((bench.estimate.position - Vec3::new(2.0, 1.0, -0.3 - expected)).norm() < 1e-3, "{:?}", bench.setpoint);
    }
}

#[test]
fn flies_its_route_stays_and_says_so() {
    let mut bench = Bench::aloft();
    bench.send(GuidedKind::WayPoint, [1.0, 0.0, -0.8]).expect("accepted");
    let command = GuidedCommand {
        kind: GuidedKind::WayPoint,
        position: Vec3::new(1.0, 1.0, -0.8),
        yaw: 1.0,
        speed: 0.3,
        dwell: 2.0,
    };
    bench.navigator.accept(&command).expect("accepted");
    bench.step();
    assert_eq!((bench.setpoint.remaining, bench.setpoint.arrived), (2, false));
    let mut there = None;
    while !bench.setpoint.arrived {
        bench.follow();
        if bench.setpoint.remaining == 1 {
            assert!(bench.setpoint.velocity.norm() < 0.31, "no faster than asked");
        }
        if (bench.setpoint.position - command.position).norm() < 1e-3 && there.is_none() {
            there = Some(bench.now);
        }
        assert!(bench.now < Instant::from_secs(60));
    }
    let stayed = bench.now.since(there.expect("was there"));
    assert!((2.0..2.3).contains(&stayed.seconds()), "{stayed}");
    assert!((bench.setpoint.yaw - 1.0).abs() < 2e-3);
    assert_eq!(bench.setpoint.remaining, 0);
}

#[test]
fn a_full_route_gives_the_command_back() {
    let mut bench = Bench::new();
    for _ in 0..Route::CAPACITY {
        assert_eq!(bench.send(GuidedKind::WayPoint, [1.0, 0.0, -0.5]), Ok(()));
    }
    assert_eq!(bench.send(GuidedKind::WayPoint, [1.0, 0.0, -0.5]), Err(Refusal::Full));
    assert_eq!(bench.send(GuidedKind::WayPoint, [f32::NAN, 0.0, -0.5]), Err(Refusal::NotFinite));
    assert_eq!(bench.send(GuidedKind::TakeOff, [0.0, 0.0, f32::INFINITY]), Err(Refusal::NotFinite));
    assert_eq!(bench.navigator.refused(), 3);
    assert_eq!(bench.send(GuidedKind::Hold, [0.0; 3]), Ok(()));
    assert_eq!(bench.send(GuidedKind::WayPoint, [1.0, 0.0, -0.5]), Ok(()), "holding has cleared it");
}

#[test]
fn hold_brakes_on_the_way() {
    let mut bench = Bench::aloft();
    bench.send(GuidedKind::WayPoint, [3.0, 0.0, -0.5]).expect("accepted");
    bench.run(2.0);
    assert!(bench.setpoint.velocity.x > 0.45);
    let from = bench.setpoint.position.x;
    bench.send(GuidedKind::Hold, [0.0; 3]).expect("accepted");
    bench.run(1.5);
    assert_eq!(bench.setpoint.velocity, Vec3::zeros());
    let braking = bench.setpoint.position.x - from;
    assert!((0.05..0.3).contains(&braking), "half a metre per second takes {braking} m to brake");
    assert!(!bench.setpoint.arrived, "it did not arrive anywhere");
}

#[test]
fn sticks_end_the_route() {
    let mut bench = Bench::aloft();
    bench.send(GuidedKind::WayPoint, [3.0, 0.0, -0.5]).expect("accepted");
    bench.run(1.0);
    bench.command = CommandSetpoint { source: CommandSource::Pilot, roll: 1.0, ..CommandSetpoint::default() };
    bench.run(1.0);
    assert!((bench.setpoint.velocity.y - 0.5).abs() < 0.01, "to the right");
    assert_eq!(bench.setpoint.remaining, 0);
    bench.command = CommandSetpoint { source: CommandSource::Guided, ..CommandSetpoint::default() };
    bench.run(3.0);
    assert_eq!(bench.setpoint.velocity, Vec3::zeros(), "nothing left to fly to");
}

#[test]
fn without_a_commander_it_holds() {
    for source in [CommandSource::None, CommandSource::Failsafe] {
        let mut bench = Bench::aloft();
        bench.send(GuidedKind::WayPoint, [3.0, 0.0, -0.5]).expect("accepted");
        bench.run(1.5);
        // Sticks without a source mean nothing.
        bench.command = CommandSetpoint { source, roll: 1.0, pitch: 1.0, throttle: 1.0, yaw: 1.0 };
        bench.run(2.0);
        let held = bench.setpoint;
        bench.run(3.0);
        assert_eq!((bench.setpoint.position, bench.setpoint.yaw), (held.position, held.yaw), "{source:?}");
    }
}

#[test]
fn a_throttle_that_was_up_before_must_come_back_first() {
    let mut bench = Bench::aloft();
    bench.command = CommandSetpoint { source: CommandSource::Pilot, throttle: 0.8, ..CommandSetpoint::default() };
    bench.mode.mode = FlightMode::AltHold;
    let height = bench.setpoint.position.z;
    bench.run(2.0);
    assert_eq!(bench.setpoint.position.z, height);
    bench.command.throttle = 0.0;
    bench.run(0.1);
    bench.command.throttle = 0.8;
    bench.run(1.0);
    assert!(bench.setpoint.position.z < height - 0.2, "now it climbs");
    bench.command.throttle = -1.0;
    bench.run(20.0);
    assert!((bench.setpoint.position.z + 0.2).abs() < 1e-3, "and it descends to the lowest height, not below");
}

#[test]
fn the_path_waits_for_a_vehicle_that_is_held_back() {
    let mut bench = Bench::aloft();
    bench.send(GuidedKind::WayPoint, [3.0, 0.0, -0.5]).expect("accepted");
    let held = bench.estimate.position;
    for _ in 0..4_000 {
        bench.estimate.position = held;
        bench.step();
        assert!((bench.setpoint.position.x - held.x) < 0.8, "runs away");
    }
    assert_eq!(bench.setpoint.velocity, Vec3::zeros());
    bench.run(20.0);
    assert!(bench.setpoint.arrived, "let go, it flies on");
}

#[test]
fn sticks_that_are_centred_hold_a_vehicle_where_it_was_held_back() {
    let mut bench = Bench::aloft();
    bench.command = CommandSetpoint { source: CommandSource::Pilot, roll: 1.0, ..CommandSetpoint::default() };
    let held = bench.estimate.position;
    let keep = |bench: &mut Bench| {
        bench.estimate.position = held;
        bench.estimate.velocity = Default::default();
        bench.step().position.y - held.y
    };
    for _ in 0..4_000 {
        keep(&mut bench);
    }
    assert!(keep(&mut bench) > 0.5, "the path waits at the end of its leash");
    bench.command.roll = 0.0;
    assert!(keep(&mut bench).abs() < 1e-3, "and comes back at once");
    for _ in 0..400 {
        assert!(keep(&mut bench).abs() < 1e-3);
    }
}

#[test]
fn the_path_waits_for_a_vehicle_that_something_keeps_from_climbing() {
    for mode in [FlightMode::AltHold, FlightMode::PosHold] {
        for (throttle, held) in [(1.0, -0.6), (-1.0, -2.5)] {
            let mut bench = Bench::aloft();
            bench.mode.mode = mode;
            bench.command = CommandSetpoint { source: CommandSource::Pilot, ..CommandSetpoint::default() };
            bench.run(0.1);
            if throttle < 0.0 {
                bench.command.throttle = 1.0;
                bench.run(4.2);
            }
            bench.command.throttle = throttle;
            for _ in 0..4_000 {
                bench.estimate.position.z = held;
                let apart = (bench.step().position.z - held).abs();
                assert!(apart < 0.8, "{mode:?}: {apart} m");
            }
            assert_eq!(bench.setpoint.velocity.z, 0.0, "{mode:?}");
            bench.run(0.1);
            let before = bench.setpoint.position.z;
            bench.run(0.5);
            assert!((before - bench.setpoint.position.z) * throttle > 0.1, "{mode:?}: let go, it goes on");
        }
    }
}

#[test]
fn a_vehicle_below_a_ceiling_lands_from_where_it_is() {
    let mut bench = Bench::aloft();
    let held = bench.estimate.position.z + 0.4;
    bench.enter(FlightPhase::Landing);
    for _ in 0..800 {
        bench.estimate.position.z = held;
        bench.step();
    }
    assert!(bench.setpoint.position.z > held + 0.2, "two seconds later it wants to be lower: {:?}", bench.setpoint);
}

#[test]
fn a_landing_that_finds_itself_lower_goes_on_from_there() {
    let mut bench = Bench::aloft();
    bench.enter(FlightPhase::Landing);
    bench.run(0.5);
    // A range comes back, and shows that it is lower by more than a metre.
    bench.estimate.position.z += 1.3;
    let height = bench.estimate.position.z;
    for _ in 0..400 {
        let setpoint = bench.step();
        assert!(setpoint.position.z >= height - 0.25 - 1e-4 && setpoint.velocity.z >= 0.0, "{setpoint:?}");
    }
}

#[test]
fn landing_sinks_as_told_and_does_not_dig() {
    let mut bench = Bench::aloft();
    let place = bench.setpoint.position.horizontal();
    bench.enter(FlightPhase::Landing);
    bench.run(1.0);
    assert!((bench.setpoint.velocity.z - 0.3).abs() < 1e-3);
    // The ground stops the vehicle, not the path.
    bench.estimate.position.z = 0.0;
    for _ in 0..2_000 {
        bench.step();
        assert!(bench.setpoint.position.z <= 0.25 + 1e-5);
        assert_eq!(bench.setpoint.position.horizontal(), place);
    }
    bench.land_detected.descent_rate = f32::NAN;
    bench.step();
    assert!(bench.setpoint.position.z.is_finite() && bench.setpoint.velocity.z.is_finite());
}

#[test]
fn axes_follow_what_is_known() {
    let mut bench = Bench::aloft();
    let horizontal = |setpoint: Setpoint| {
        let axes = setpoint.axes;
        (axes.contains(SetpointAxes::POSITION_XY), axes.contains(SetpointAxes::VELOCITY_XY))
    };
    assert_eq!(horizontal(bench.step()), (true, false));
    bench.estimate.valid = Validity::ALL.without(Validity::POSITION_XY);
    assert_eq!(horizontal(bench.step()), (false, true));
    bench.estimate.valid = bench.estimate.valid.without(Validity::VELOCITY_XY);
    assert_eq!(horizontal(bench.step()), (false, false));
    // A position that comes back is another one: the path starts from there.
    bench.estimate.valid = Validity::ALL;
    bench.estimate.position.x = 7.0;
    assert!((bench.step().position.x - 7.0).abs() < 1e-2);
}

#[derive(Clone, Debug)]
struct Piece {
    mode: FlightMode,
    source: CommandSource,
    sticks: [f32; 4],
    way_point: Option<[f32; 3]>,
    steps: u32,
}

prop_compose! {
    fn pieces()(
        mode in prop::sample::select(FlightMode::ALL), source in prop::sample::select(CommandSource::ALL),
        sticks in prop::array::uniform4(-1f32..1.0), way_point in prop::option::of(prop::array::uniform3(-2f32..2.0)),
        steps in 1u32..600,
    ) -> Piece {
        Piece { mode, source, sticks, way_point, steps }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn in_flight_the_path_never_jumps(flight in prop::collection::vec(pieces(), 1..12)) {
        let mut bench = Bench::aloft();
        for piece in flight {
            bench.mode.mode = piece.mode;
            let [roll, pitch, yaw, throttle] = piece.sticks;
            bench.command = CommandSetpoint { source: piece.source, roll, pitch, yaw, throttle };
            if let Some(place) = piece.way_point {
                let _ = bench.send(GuidedKind::WayPoint, place);
            }
            for _ in 0..piece.steps {
                let before = bench.setpoint;
                bench.follow();
                let moved = bench.setpoint.position - before.position;
                prop_assert!(moved.horizontal().amax() <= 1.0 * DT + 2e-4, "{moved:?} in {piece:?}");
                prop_assert!(moved.z.abs() <= 0.6 * DT + 2e-4, "{moved:?} in {piece:?}");
                let faster = bench.setpoint.velocity - before.velocity;
                prop_assert!(faster.amax() <= 1.5 * DT + 1.1e-3, "{faster:?} in {piece:?}");
            }
        }
    }

    #[test]
    fn no_input_makes_a_set_point_that_is_no_number(
        numbers in prop::collection::vec((any::<[f32; 10]>(), any::<[f32; 5]>(), 0usize..7, 0usize..4), 1..40),
    ) {
        let mut bench = Bench::new();
        for ([x, y, z, u, v, w, q0, q1, q2, q3], [roll, pitch, yaw, throttle, rate], state, mode) in numbers {
            bench.enter(FlightPhase::ALL[state]);
            bench.mode.mode = FlightMode::ALL[mode];
            bench.command = CommandSetpoint { source: CommandSource::Pilot, roll, pitch, yaw, throttle };
            bench.land_detected.descent_rate = rate;
            bench.estimate.position = Vec3::new(x, y, z);
            bench.estimate.velocity = Vec3::new(u, v, w);
            bench.estimate.attitude = Quat::new_unchecked(q0, q1, q2, q3);
            let _ = bench.send(GuidedKind::WayPoint, [x, v, q0]);
            let point = bench.step();
            let all = point.position.iter().chain(&point.velocity).chain(&point.acceleration);
            prop_assert!(all.chain([&point.yaw, &point.yaw_rate]).all(|number| number.is_finite()), "{point:?}");
        }
    }
}

/// It drifted on with the pilot's sticks at rest, and fell over its legs.
#[test]
fn a_landing_brakes_in_every_mode_with_a_pilot_too() {
    for mode in [FlightMode::AltHold, FlightMode::Stabilize, FlightMode::PosHold] {
        for (lost, place, speed) in [
            (Validity::NONE, true, true),
            (Validity::POSITION_XY, false, true),
            (Validity::POSITION_XY | Validity::VELOCITY_XY, false, false),
        ] {
            let mut bench = Bench::aloft();
            (bench.mode.mode, bench.command.source) = (mode, CommandSource::Pilot);
            bench.estimate.velocity = Vec3::new(0.4, 0.0, 0.0);
            bench.step();
            bench.estimate.valid = Validity::ALL.without(lost);
            bench.enter(FlightPhase::Landing);
            let axes = bench.step().axes;
            assert_eq!(axes.contains(SetpointAxes::POSITION_XY), place, "{mode:?} {lost:?}");
            assert!(!speed || axes.intersects(SetpointAxes::POSITION_XY | SetpointAxes::VELOCITY_XY), "{mode:?}");
        }
    }
}
