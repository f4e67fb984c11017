//! A Tello's commands: what is answered when, and what the vehicle is asked for.

use crate::common::{Id, Vehicle};
use stampfly_services::Tello;
use stampfly_services::tello::Destination;
use stampfly_types::messages::{ArmBlocks, FlightPhase, GuidedKind, Setpoint, SetpointAxes, StateEstimate, Validity};
use stampfly_types::{Instant, Quat, Vec3};

/// A program, the service and the vehicle, a moment at a time.
struct Talk {
    tello: Tello<u8>,
    vehicle: Vehicle,
    now: Instant,
    said: Vec<(u8, String)>,
    states: usize,
}

impl Talk {
    fn new(vehicle: Vehicle) -> Self {
        Self { tello: Tello::new(), vehicle, now: Instant::ZERO, said: Vec::new(), states: 0 }
    }

    fn hear(&mut self, program: u8, text: &str) -> Vec<String> {
        self.hear_any(program, text, false)
    }

    /// What lay in a queue for more than a second.
    fn hear_late(&mut self, program: u8, text: &str) -> Vec<String> {
        self.hear_any(program, text, true)
    }

    fn hear_any(&mut self, program: u8, text: &str, is_late: bool) -> Vec<String> {
        let Self { tello, vehicle, now, said, .. } = self;
        let put: &mut dyn FnMut(&u8, Destination, &[u8]) = &mut |to, what, bytes| {
            assert_eq!(what, Destination::Program);
            said.push((*to, String::from_utf8(bytes.to_vec()).expect("text")));
        };
        match is_late {
            true => tello.hear_late(*now, program, text.as_bytes(), vehicle, put),
            false => tello.hear(*now, program, text.as_bytes(), vehicle, put),
        }
        self.answers()
    }

    /// So many turns of 20 ms.
    fn wait(&mut self, turns: u64) -> Vec<String> {
        for _ in 0..turns {
            self.now = Instant::from_micros(self.now.as_micros() + 20_000);
            let Self { tello, vehicle, now, said, states, .. } = self;
            tello.poll(*now, vehicle, &mut |to, what, bytes| match what {
                Destination::Program => said.push((*to, String::from_utf8(bytes.to_vec()).expect("text"))),
                Destination::State => *states += 1,
            });
        }
        self.answers()
    }

    fn answers(&mut self) -> Vec<String> {
        std::mem::take(&mut self.said).into_iter().map(|(_, text)| text).collect()
    }

    fn kinds(&self) -> Vec<GuidedKind> {
        self.vehicle.guided.iter().map(|command| command.kind).collect()
    }

    fn is_at(&mut self, position: Vec3, yaw: f32) {
        let valid = Validity::TILT | Validity::POSITION_XY | Validity::POSITION_Z;
        let attitude = Quat::from_euler_angles(0.0, 0.0, yaw);
        self.vehicle.publish(Id::estimate_state, &StateEstimate { position, attitude, valid, ..Default::default() });
        let axes = SetpointAxes::POSITION_XY | SetpointAxes::POSITION_Z | SetpointAxes::YAW;
        self.vehicle.publish(Id::setpoint, &Setpoint { position, yaw, axes, ..Default::default() });
    }
}

#[test]
fn a_take_off_waits_for_the_calibration_and_is_answered_in_the_air() {
    let mut talk = Talk::new(Vehicle::standing());
    talk.vehicle.status(|status| status.blocks = ArmBlocks::CALIBRATING);
    assert_eq!(talk.hear(1, "takeoff"), ["error say command first"]);
    assert_eq!(talk.hear(1, "command"), ["ok"]);
    assert_eq!(talk.hear(1, "takeoff"), Vec::<String>::new());
    assert_eq!(talk.wait(100), Vec::<String>::new());
    assert_eq!(talk.kinds(), []);
    talk.vehicle.status(|status| status.blocks = ArmBlocks::NONE);
    talk.wait(20);
    assert_eq!(talk.kinds(), [GuidedKind::Arm]);
    talk.vehicle.status(|status| (status.phase, status.armed) = (FlightPhase::Armed, true));
    talk.wait(20);
    assert_eq!(talk.kinds(), [GuidedKind::Arm, GuidedKind::TakeOff]);
    assert_eq!(talk.hear(1, "forward 50"), ["error busy"]);
    talk.vehicle.status(|status| status.phase = FlightPhase::Flying);
    assert_eq!(talk.wait(20), ["ok"]);
    assert!(talk.states > 20, "the state is sent meanwhile: {}", talk.states);
}

#[test]
fn what_keeps_it_on_the_ground_is_said() {
    let mut talk = Talk::new(Vehicle::standing());
    talk.vehicle.status(|status| status.blocks = ArmBlocks::LOW_BATTERY);
    talk.hear(1, "command");
    talk.hear(1, "takeoff");
    assert_eq!(talk.wait(500), ["error LOW_BATTERY"]);
}

#[test]
fn a_move_is_flown_as_the_vehicle_looks_and_answered_when_it_is_there() {
    let mut talk = Talk::new(Vehicle::flying());
    // Looking east.
    talk.is_at(Vec3::new(1.0, 2.0, -0.5), core::f32::consts::FRAC_PI_2);
    talk.hear(1, "command");
    assert_eq!(talk.hear(1, "forward 100"), Vec::<String>::new());
    let goal = talk.vehicle.guided.last().expect("a way-point").position;
    assert!((goal - Vec3::new(1.0, 3.0, -0.5)).norm() < 1e-5, "{goal}");
    assert_eq!(talk.wait(50), Vec::<String>::new());
    talk.is_at(Vec3::new(1.0, 2.95, -0.5), core::f32::consts::FRAC_PI_2);
    assert_eq!(talk.wait(20), ["ok"]);
    // Not into the ground, and not to the ceiling.
    talk.hear(1, "down 400");
    assert_eq!(talk.vehicle.guided.last().expect("a way-point").position.z, -0.2);
}

#[test]
fn a_turn_of_more_than_half_is_flown_in_quarters_the_right_way_round() {
    let mut talk = Talk::new(Vehicle::flying());
    talk.is_at(Vec3::new(0.0, 0.0, -0.5), 0.0);
    talk.hear(1, "command");
    talk.hear(1, "ccw 270");
    let mut turned = 0.0_f32;
    let mut answers = Vec::new();
    for _ in 0..8 {
        answers.extend(talk.wait(15));
        let Some(goal) = talk.vehicle.guided.last().map(|command| command.yaw) else { continue };
        turned += stampfly_types::math::wrap_angle(goal - stampfly_types::math::wrap_angle(turned));
        talk.is_at(Vec3::new(0.0, 0.0, -0.5), goal);
    }
    assert!((turned.to_degrees() + 270.0).abs() < 0.1, "{}", turned.to_degrees());
    assert_eq!(answers, ["ok"]);
}

#[test]
fn anybody_can_stop_the_motors_and_only_the_program_does_anything_else() {
    let mut talk = Talk::new(Vehicle::flying());
    talk.hear(1, "command");
    assert_eq!(talk.hear(2, "command"), ["error another program commands"]);
    assert_eq!(talk.hear(2, "land"), ["error say command first"]);
    assert_eq!(talk.hear(2, "emergency"), ["ok"]);
    assert_eq!(talk.kinds(), [GuidedKind::Kill]);
}

#[test]
fn landing_interrupts_and_the_interrupted_is_answered() {
    let mut talk = Talk::new(Vehicle::flying());
    talk.is_at(Vec3::new(0.0, 0.0, -0.5), 0.0);
    talk.hear(1, "command");
    talk.hear(1, "forward 100");
    assert_eq!(talk.hear(1, "land"), ["error interrupted"]);
    talk.vehicle.status(|status| (status.phase, status.armed) = (FlightPhase::IdleGround, false));
    assert_eq!(talk.wait(20), ["ok"]);
}

#[test]
fn sticks_that_stop_coming_are_let_go() {
    let mut talk = Talk::new(Vehicle::flying());
    talk.hear(1, "command");
    talk.hear(1, "rc 0 0 0 0");
    talk.wait(5);
    assert_eq!(talk.vehicle.steered, [], "centred sticks take nothing over");
    talk.hear(1, "rc 10 -20 30 -40");
    talk.wait(8);
    let input = talk.vehicle.steered.last().expect("sticks");
    let sticks = [input.roll, input.pitch, input.throttle, input.yaw];
    assert!(
        sticks.iter().zip([0.1, -0.2, 0.3, -0.4]).all(|(stick, wanted)| (stick - wanted).abs() < 1e-6),
        "{sticks:?}"
    );
    let count = talk.vehicle.steered.len();
    talk.wait(50);
    assert!(talk.vehicle.steered.len() - count <= 25, "for half a second");
    assert_eq!(talk.kinds(), [GuidedKind::Hold]);
}

#[test]
fn what_lay_in_a_queue_is_answered_with_an_error_and_not_done_and_what_ends_a_flight_is_done() {
    let mut talk = Talk::new(Vehicle::flying());
    talk.is_at(Vec3::new(0.0, 0.0, -0.5), 0.0);
    assert_eq!(talk.hear_late(1, "command"), ["error expired"]);
    talk.hear(1, "command");
    let late =
        ["takeoff", "forward 50", "go 50 0 0 30", "cw 90", "flip l", "speed 80", "up 30", "command", "keepalive"];
    for text in late {
        assert_eq!(talk.hear_late(1, text), ["error expired"], "{text}");
    }
    assert_eq!(talk.hear_late(1, "rc 50 0 0 0"), Vec::<String>::new(), "sticks are not answered");
    talk.wait(10);
    assert_eq!((talk.kinds(), talk.vehicle.steered.len()), (vec![], 0));
    assert_eq!(talk.hear_late(1, "speed?"), ["50"], "a question does nothing");
    // Sticks of before are let go with those that are late.
    talk.hear(1, "rc 50 0 0 0");
    talk.wait(1);
    talk.hear_late(1, "rc 50 0 0 0");
    let steered = talk.vehicle.steered.len();
    talk.wait(10);
    assert_eq!((talk.kinds(), talk.vehicle.steered.len()), (vec![GuidedKind::Hold], steered));
    for (text, kind) in [("stop", GuidedKind::Hold), ("land", GuidedKind::Land), ("emergency", GuidedKind::Kill)] {
        talk.hear_late(1, text);
        assert_eq!(talk.kinds().last(), Some(&kind), "{text}");
    }
    assert_eq!(talk.hear_late(2, "emergency"), ["ok"], "it is everybody's");
}

#[test]
fn sticks_that_a_network_has_held_up_are_let_go_and_so_is_what_comes_with_them() {
    for held in [60, 200] {
        let mut talk = Talk::new(Vehicle::flying());
        talk.is_at(Vec3::new(0.0, 0.0, -0.5), 0.0);
        talk.hear(1, "command");
        for _ in 0..20 {
            talk.hear(1, "rc 30 0 0 0");
            talk.wait(5);
        }
        talk.wait(held);
        let steered = talk.vehicle.steered.len();
        // All of them at once.
        let answers: Vec<_> = (0..30).flat_map(|_| talk.hear(1, "rc 30 0 0 0")).collect();
        assert_eq!(answers, Vec::<String>::new());
        assert_eq!(talk.hear(1, "forward 100"), ["error expired"]);
        talk.wait(10);
        assert_eq!(talk.vehicle.steered.len(), steered, "held up for {held} turns");
        assert!(talk.kinds().iter().all(|kind| *kind == GuidedKind::Hold), "{:?}", talk.kinds());
        // It is back.
        for _ in 0..5 {
            talk.hear(1, "rc 30 0 0 0");
            talk.wait(5);
        }
        assert_eq!(talk.vehicle.steered.len(), steered + 25);
        talk.hear(1, "land");
        assert_eq!(talk.kinds().last(), Some(&GuidedKind::Land));
    }
}

#[test]
fn a_program_that_says_a_lot_in_one_moment_after_a_silence_is_not_taken_for_late() {
    let mut talk = Talk::new(Vehicle::flying());
    talk.is_at(Vec3::new(0.0, 0.0, -0.5), 0.0);
    talk.hear(1, "command");
    talk.wait(200);
    for _ in 0..10 {
        assert_eq!(talk.hear(1, "speed 50"), ["ok"]);
        assert_eq!(talk.hear(1, "speed?"), ["50"]);
    }
    for _ in 0..3 {
        talk.hear(1, "rc 0 0 0 0");
    }
    assert_eq!(talk.hear(1, "forward 100"), Vec::<String>::new());
    assert_eq!(talk.kinds(), [GuidedKind::Hold, GuidedKind::WayPoint]);
}

/// The mode machine gives a pilot the vehicle who moves the sticks away from where they were.
#[test]
fn sticks_are_centred_before_they_are_moved_so_that_they_take_over() {
    let mut talk = Talk::new(Vehicle::flying());
    talk.hear(1, "command");
    for _ in 0..2 {
        talk.vehicle.steered.clear();
        for _ in 0..10 {
            talk.hear(1, "rc 0 60 0 0");
            talk.wait(5);
        }
        let pitches: Vec<_> = talk.vehicle.steered.iter().map(|input| input.pitch).collect();
        let (centred, moved) = pitches.split_at(5);
        assert!(centred.iter().all(|pitch| *pitch == 0.0) && moved.iter().all(|pitch| *pitch > 0.59), "{pitches:?}");
        assert!(moved.len() > 40);
        // They stop, and begin again.
        talk.wait(50);
    }
}

#[test]
fn a_move_behind_sticks_waits_until_they_are_let_go() {
    let mut talk = Talk::new(Vehicle::flying());
    talk.is_at(Vec3::new(0.0, 0.0, -0.5), 0.0);
    talk.hear(1, "command");
    for text in ["forward 50", "land"] {
        for _ in 0..10 {
            talk.hear(1, "rc 0 60 0 0");
            talk.wait(5);
        }
        talk.vehicle.guided.clear();
        assert_eq!(talk.hear(1, text), Vec::<String>::new());
        let steered = talk.vehicle.steered.len();
        if text == "land" {
            assert_eq!(talk.kinds(), [GuidedKind::Land], "at once");
        } else {
            assert_eq!(talk.kinds(), [GuidedKind::Hold]);
            assert_eq!(talk.hear(1, "cw 90"), ["error busy"]);
            talk.wait(6);
            assert_eq!(talk.kinds(), [GuidedKind::Hold, GuidedKind::Hold, GuidedKind::WayPoint]);
            talk.is_at(Vec3::new(0.5, 0.0, -0.5), 0.0);
            assert_eq!(talk.wait(20), ["ok"]);
        }
        assert_eq!(talk.vehicle.steered.len(), steered);
    }
}

#[test]
fn a_program_that_says_nothing_for_fifteen_seconds_has_gone() {
    let mut talk = Talk::new(Vehicle::flying());
    talk.hear(1, "command");
    talk.wait(740);
    let alive = talk.vehicle.alive.len();
    assert!(alive > 700);
    talk.wait(200);
    assert!(talk.vehicle.alive.len() <= alive + 10, "no sign of life any more");
    assert_eq!(talk.hear(2, "command"), ["ok"], "somebody else's turn");
}

#[test]
fn a_speed_is_what_was_said() {
    let mut talk = Talk::new(Vehicle::standing());
    talk.hear(1, "command");
    for speed in 10..=100 {
        assert_eq!(talk.hear(1, &format!("speed {speed}")), ["ok"]);
        assert_eq!(talk.hear(1, "speed?"), [speed.to_string()]);
    }
}

#[test]
fn what_is_no_command_says_why() {
    let mut talk = Talk::new(Vehicle::flying());
    talk.hear(1, "command");
    assert_eq!(talk.hear(1, "forward fifty"), ["error not a number"]);
    assert_eq!(talk.hear(1, "go 0 0 0 10"), ["error out of range"]);
    assert_eq!(talk.hear(1, "dance"), ["error unknown command"]);
    assert_eq!(talk.hear(1, "streamon"), ["error not supported"]);
    assert_eq!(talk.hear(1, "battery?"), ["0"]);
}

#[test]
fn a_turn_of_any_size_is_answered_before_the_program_is_taken_for_gone() {
    for (text, answer, after) in [("cw 400", "ok", 0.0..10.0), ("cw 3600", "error took too long", 13.9..14.1)] {
        let mut talk = Talk::new(Vehicle::flying());
        talk.is_at(Vec3::new(0.0, 0.0, -0.5), 0.0);
        talk.hear(1, "command");
        assert_eq!(talk.hear(1, text), Vec::<String>::new());
        let (mut yaw, mut answers) = (0.0_f32, Vec::new());
        while answers.is_empty() && talk.now < Instant::from_secs(20) {
            answers = talk.wait(1);
            let goal = talk.vehicle.guided.last().map_or(yaw, |command| command.yaw);
            // 1.5 rad/s.
            let way = stampfly_types::math::wrap_angle(goal - yaw).clamp(-0.03, 0.03);
            yaw = stampfly_types::math::wrap_angle(yaw + way);
            talk.is_at(Vec3::new(0.0, 0.0, -0.5), yaw);
        }
        let seconds = talk.now.seconds_f64();
        assert!(answers == [answer] && after.contains(&seconds), "{text}: {answers:?} after {seconds} s");
    }
}

#[test]
fn a_program_that_is_taken_for_gone_is_told_that_nothing_comes_of_its_command() {
    let mut talk = Talk::new(Vehicle::standing());
    talk.vehicle.status(|status| status.blocks = ArmBlocks::CALIBRATING);
    talk.hear(1, "command");
    talk.hear(1, "takeoff");
    talk.wait(390);
    talk.vehicle.status(|status| status.blocks = ArmBlocks::NONE);
    talk.wait(10);
    talk.vehicle.status(|status| (status.phase, status.armed) = (FlightPhase::Armed, true));
    assert_eq!(talk.wait(340), Vec::<String>::new());
    assert_eq!(talk.wait(20), ["error no command for 15 s"]);
}
