//! Who commands: pages, programs, stations with the key and transmitters under one rule.

use stampfly_services::{Asked, CommandArbiter, CommandNotice, Passed, Refusal, Requester};
use stampfly_types::Instant;
use stampfly_types::messages::{CommandSource, FlightMode, FlightStatus, GuidedCommand, GuidedKind, PilotInput};

const PAGE: Requester = Requester::Page(1);
const STATION: Requester = Requester::Link(2);
const OTHER_STATION: Requester = Requester::Link(3);
const PROGRAM: Requester = Requester::Mavlink { connection: 4, system: 255, component: 190 };

/// A arbiter, and what it has passed on.
#[derive(Default)]
struct Scene {
    arbiter: CommandArbiter,
    now: Instant,
    status: FlightStatus,
    passed: Vec<Passed>,
    told: u32,
}

impl Scene {
    /// A vehicle that a program leads.
    fn led_by(requester: Requester) -> Self {
        let mut scene = Self::default();
        assert_eq!(scene.guide(requester, GuidedKind::Arm), Ok(()));
        scene.status = FlightStatus { armed: true, commander: CommandSource::Guided, ..FlightStatus::default() };
        scene
    }

    /// A vehicle that is flown by the sticks of this requester.
    fn flown_by(requester: Requester) -> Self {
        let mut scene = Self::default();
        assert_eq!(scene.steer(requester, 0.0, true), Ok(()));
        scene.status = FlightStatus { armed: true, commander: CommandSource::Pilot, ..FlightStatus::default() };
        scene.pass(20);
        assert_eq!(scene.steer(requester, 0.0, true), Ok(()));
        scene
    }

    fn guide(&mut self, requester: Requester, kind: GuidedKind) -> Result<(), Refusal> {
        let Self { arbiter, now, passed, .. } = self;
        let command = GuidedCommand { kind, ..GuidedCommand::default() };
        arbiter.guide(*now, requester, command, &mut |what| {
            passed.push(what);
            Ok(())
        })
    }

    fn steer(&mut self, requester: Requester, pitch: f32, arm: bool) -> Result<(), Refusal> {
        self.frame(requester, PilotInput { pitch, arm, ..PilotInput::default() })
    }

    fn frame(&mut self, requester: Requester, input: PilotInput) -> Result<(), Refusal> {
        let Self { arbiter, now, passed, status, .. } = self;
        arbiter.steer(*now, requester, &input, status, &mut |what| {
            passed.push(what);
            Ok(())
        })
    }

    /// Time passes. Returns how many signs of life were passed on.
    fn pass(&mut self, millis: u64) -> usize {
        let (end, mut signs) = (self.now.as_micros() / 1_000 + millis, 0);
        for ms in (self.now.as_micros() / 1_000..=end).step_by(5) {
            self.now = Instant::from_millis(ms);
            self.arbiter.keep(self.now, self.status.armed, &mut |_| {
                signs += 1;
                Ok(())
            });
        }
        self.now = Instant::from_millis(end);
        signs
    }

    fn passed(&mut self) -> Vec<Passed> {
        core::mem::take(&mut self.passed)
    }

    fn told(&mut self) -> Vec<String> {
        let mut all = Vec::new();
        while let Some((number, told)) = self.arbiter.told(self.told) {
            self.told = number;
            all.push(told.to_string());
        }
        all
    }
}

#[test]
fn a_second_commander_is_told_who_commands_and_does_not_keep_the_flight_of_one_that_has_left_going() {
    let requesters = [PAGE, STATION, OTHER_STATION, PROGRAM];
    for commander in requesters {
        for other in requesters.into_iter().filter(|requester| *requester != commander) {
            let mut scene = Scene::led_by(commander);
            assert_eq!(scene.guide(other, GuidedKind::WayPoint), Err(Refusal::Occupied(commander)));
            assert_eq!(scene.steer(other, 1.0, true), Err(Refusal::Occupied(commander)));
            assert!(scene.pass(2_900) > 20, "its last sign is passed on for three seconds");
            for _ in 0..20 {
                assert!(!scene.arbiter.alive(scene.now, other), "a watcher's signs do not count");
                assert_eq!(scene.steer(other, 0.0, true), Err(Refusal::Occupied(commander)));
                scene.pass(200);
            }
            assert_eq!(scene.pass(1_000), 0, "{commander} has left, {other} chatters: the vehicle hears none");
            let gone = format!("{commander} is silent, none commands");
            assert_eq!(scene.told().iter().filter(|told| **told == gone).count(), 1);
            assert_eq!(scene.guide(other, GuidedKind::Hold), Ok(()), "a command takes over");
        }
    }
}

#[test]
fn everybody_kills_and_lands_and_the_commander_stays() {
    for other in [STATION, PROGRAM, Requester::Transmitter] {
        let mut scene = Scene::led_by(PAGE);
        scene.passed();
        for kind in [GuidedKind::Land, GuidedKind::Kill] {
            assert_eq!(scene.guide(other, kind), Ok(()));
        }
        let kill = PilotInput { kill: true, ..PilotInput::default() };
        assert_eq!(scene.frame(other, kill), Ok(()));
        assert_eq!(scene.passed().len(), 3);
        assert_eq!(scene.arbiter.holder(scene.now), Some(PAGE));
        let kill = format!("{other}: KILL");
        assert!(scene.told().contains(&kill));
    }
}

#[test]
fn an_arm_switch_that_is_turned_off_lands_a_vehicle_that_another_flies() {
    for mut scene in [Scene::led_by(PAGE), Scene::flown_by(PAGE)] {
        for (arm, refusals) in [(true, 3), (false, 3)] {
            for _ in 0..refusals {
                assert_eq!(scene.steer(STATION, 0.0, arm), Err(Refusal::Occupied(PAGE)));
                scene.pass(20);
            }
        }
        let lands = |what: &&Passed| matches!(what, Passed::Command(command) if command.kind == GuidedKind::Land);
        assert_eq!(scene.passed().iter().filter(lands).count(), 1, "once");
        assert!(scene.told().contains(&format!("{STATION}: land")));
    }
    // One that was off all the time asks for nothing.
    let mut scene = Scene::flown_by(PAGE);
    scene.passed();
    assert!(scene.steer(STATION, 1.0, false).is_err() && scene.steer(STATION, 1.0, false).is_err());
    assert_eq!(scene.passed(), []);
}

#[test]
fn of_two_transmitters_one_is_heard_and_the_others_switch_does_not_flap() {
    for (one, two) in
        [(STATION, PAGE), (Requester::Transmitter, PAGE), (PAGE, Requester::Transmitter), (STATION, OTHER_STATION)]
    {
        // On the ground: who came first.
        let mut scene = Scene::default();
        for _ in 0..10 {
            assert_eq!(scene.steer(one, 0.0, false), Ok(()));
            assert_eq!(scene.steer(two, 0.0, false), Err(Refusal::Occupied(one)), "{one}, {two}");
            scene.pass(20);
        }
        // A switch that is turned on takes over; frames of the one before do not turn it off again.
        assert_eq!(scene.steer(two, 0.0, true), Ok(()));
        scene.passed();
        for _ in 0..10 {
            assert_eq!(scene.steer(one, 0.0, false), Err(Refusal::Occupied(two)));
            assert_eq!(scene.steer(two, 0.0, true), Ok(()));
            scene.pass(20);
        }
        let arms = |what: &Passed| matches!(what, Passed::Sticks(input) if input.arm);
        assert!(scene.passed().iter().all(arms));

        // In the air: who has armed.
        scene.status = FlightStatus { armed: true, commander: CommandSource::Pilot, ..FlightStatus::default() };
        for _ in 0..10 {
            assert_eq!(scene.steer(two, 0.5, true), Ok(()));
            assert_eq!(scene.steer(one, 0.9, false), Err(Refusal::Occupied(two)));
            scene.pass(20);
        }
        assert!(scene.told().contains(&CommandNotice { requester: two, what: Asked::Sticks }.to_string()));
        assert_eq!(scene.guide(PROGRAM, GuidedKind::WayPoint), Err(Refusal::Occupied(two)));
    }
}

#[test]
fn a_switch_that_is_on_when_its_frames_begin_does_not_take_the_place_of_one_that_is_off() {
    let mut scene = Scene::default();
    for _ in 0..10 {
        assert_eq!(scene.steer(PAGE, 0.0, false), Ok(()));
        assert_eq!(scene.steer(STATION, 0.0, true), Err(Refusal::Occupied(PAGE)), "it was not seen off");
        scene.pass(20);
    }
    scene.pass(3_000);
    assert_eq!(scene.steer(STATION, 0.0, true), Ok(()), "the other is gone: the mode machine wants it off first");
}

#[test]
fn the_paired_transmitter_takes_over_by_acting_and_a_program_leads_again_when_it_has_let_go() {
    let mut scene = Scene::led_by(PROGRAM);
    scene.status.mode = FlightMode::PosHold;
    // Its frames pass, so that the mode machine sees its sticks move, and take nothing over.
    for _ in 0..50 {
        assert_eq!(scene.steer(Requester::Transmitter, 0.0, true), Ok(()));
        assert!(scene.arbiter.alive(scene.now, PROGRAM));
        scene.pass(20);
    }
    assert_eq!(scene.arbiter.holder(scene.now), Some(PROGRAM));
    // The pilot moves the sticks, and the mode machine lets him.
    scene.status.commander = CommandSource::Pilot;
    for _ in 0..10 {
        assert_eq!(scene.steer(Requester::Transmitter, 0.5, true), Ok(()));
        scene.pass(20);
    }
    assert_eq!(scene.guide(PROGRAM, GuidedKind::WayPoint), Err(Refusal::Occupied(Requester::Transmitter)));
    assert!(scene.told().contains(&"the transmitter: flies by hand".into()));
    for _ in 0..160 {
        assert_eq!(scene.steer(Requester::Transmitter, 0.0, true), Ok(()));
        scene.pass(20);
    }
    assert_eq!(scene.guide(PROGRAM, GuidedKind::WayPoint), Ok(()));
    // In a manual mode nothing is let go of.
    scene.status.mode = FlightMode::Stabilize;
    assert_eq!(scene.steer(Requester::Transmitter, 0.0, true), Ok(()));
    assert_eq!(scene.guide(PROGRAM, GuidedKind::WayPoint), Err(Refusal::Occupied(Requester::Transmitter)));
}

#[test]
fn a_transmitter_on_a_table_does_not_keep_a_vehicle_in_the_air_that_the_sticks_of_another_have_left() {
    for pilot in [PAGE, STATION] {
        let mut scene = Scene::flown_by(pilot);
        scene.pass(600);
        scene.passed();
        for _ in 0..200 {
            assert!(scene.steer(Requester::Transmitter, 0.0, true).is_err());
            scene.pass(20);
        }
        let sticks = |what: &&Passed| matches!(what, Passed::Sticks(_));
        assert_eq!(scene.passed().iter().filter(sticks).count(), 0);
    }
}

#[test]
fn sticks_of_a_station_on_the_ground_keep_no_program_from_commanding() {
    let mut scene = Scene::default();
    for _ in 0..10 {
        assert_eq!(scene.steer(STATION, 0.0, false), Ok(()));
        // At any time between two frames.
        assert_eq!(scene.arbiter.holder(scene.now), None);
        scene.pass(20);
    }
    assert_eq!(scene.guide(PAGE, GuidedKind::Arm), Ok(()));
}

/// A page sends its sticks as long as it is open, and a vehicle is armed a moment before its program is known to command.
#[test]
fn sticks_whose_arm_switch_is_off_take_no_lease_that_is_free() {
    for requester in [Requester::Page(2), STATION] {
        let mut scene = Scene::default();
        assert_eq!(scene.steer(requester, 0.0, false), Ok(()));
        scene.status = FlightStatus { armed: true, commander: CommandSource::Guided, ..FlightStatus::default() };
        scene.pass(20);
        assert_eq!(scene.steer(requester, 0.0, false), Ok(()), "the mode machine is told that they rest");
        assert_eq!(scene.arbiter.holder(scene.now), None);
        assert_eq!(scene.guide(PAGE, GuidedKind::TakeOff), Ok(()));
        assert_eq!(scene.steer(requester, 0.0, false), Err(Refusal::Occupied(PAGE)));
    }
}
