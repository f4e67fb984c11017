//! A pilot flies over the secure session's real bytes: in quiet air, flooded, and with the radio lost.

use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Air, Outcome, Setup, StampFly};
use stampfly_board::topics::Id;
use stampfly_flight::Observer;
use stampfly_param::parameters;
use stampfly_sim::fault::Fault;
use stampfly_sim::vehicle::{Vehicle, Verdict, Witness};
use stampfly_types::messages::{Alerts, FlightMode, FlightPhase, FlightStatus, PilotInput, SystemAlert};
use stampfly_types::{Duration, Instant, Message};

/// A period of control, and what a stamp of a sensor's may differ.
const LATE: Duration = Duration::from_micros(3_750);

/// Counts the duties that came later than a period and a half after those before, and a stranger's sticks on an armed vehicle.
#[derive(Default)]
struct Deadlines {
    last: Option<Instant>,
    met: u32,
    missed: u32,
    armed: bool,
    stolen: u32,
    /// When the pilot was heard last before the link counted as lost, and when that was.
    heard: Option<Instant>,
    lost: Option<Instant>,
}

impl Observer for Deadlines {}

impl Witness<Runnables> for Deadlines {
    fn published(&mut self, topic: usize, at: Instant, _: u32, words: &[u32]) {
        if topic == Id::flight_status as usize {
            self.armed = read::<FlightStatus>(words).armed;
        }
        let is_lost = |words| read::<SystemAlert>(words).active.intersects(Alerts::COMM_LOST);
        if topic == Id::system_alert as usize && self.armed && self.lost.is_none() && is_lost(words) {
            self.lost = Some(at);
        }
        if topic == Id::command_pilot as usize {
            if self.lost.is_none() {
                self.heard = Some(at);
            }
            self.stolen += u32::from(self.armed && read::<PilotInput>(words).throttle == 1.0);
        }
        if topic == Id::actuator_motor as usize {
            let is_late = self.last.is_some_and(|last| at.since(last) > LATE);
            (self.missed, self.met) = (self.missed + u32::from(is_late), self.met + u32::from(!is_late));
            self.last = Some(at);
        }
    }
}

fn read<M: Message<Words: for<'w> TryFrom<&'w [u32]>>>(words: &[u32]) -> M {
    M::from_words(&words.try_into().ok().expect("its words")).expect("a message")
}

fn fly(flood: Option<u32>, hover: u32, faults: &[&str]) -> (Outcome, Deadlines) {
    fly_with(flood, hover, faults, Some(FlightMode::PosHold), false)
}

fn fly_with(
    flood: Option<u32>,
    hover: u32,
    faults: &[&str],
    pilot: Option<FlightMode>,
    open: bool,
) -> (Outcome, Deadlines) {
    let mission = Mission::parse(&format!("arm\ntakeoff 0.5\nhover {hover}\nland\n")).expect("a mission");
    let faults = faults.iter().map(|text| Fault::parse(text, StampFly::FAULTS).expect("a fault")).collect();
    let mut setup = Setup {
        mission,
        faults,
        pilot,
        air: flood.map(|flood| Air { flood, ..Air::default() }),
        ..Setup::reference(1)
    };
    let number = f32::from(u8::from(open));
    parameters::set(&mut setup.vehicle, "link.unauthenticated", number).expect("a parameter");
    let mut deadlines = Deadlines::default();
    let outcome = StampFly::fly(&setup, &mut deadlines, &mut |_, _| {}).outcome;
    (outcome, deadlines)
}

#[test]
fn a_flood_of_2000_frames_a_second_misses_no_deadline_and_keeps_the_pilots_frames() {
    let (outcome, deadlines) = fly(Some(2_000), 30, &[]);
    let air = outcome.air;
    println!("{air:?}\nmet {} missed {}", deadlines.met, deadlines.missed);
    assert!(outcome.finished && outcome.succeeded(), "{:?}", outcome.judgement);
    assert!(air.strange >= 60_000 && deadlines.met >= 12_000, "{air:?}, {} deadlines", deadlines.met);
    assert_eq!(deadlines.missed, 0);
    assert!(air.sent >= 1_500 && 10 * air.taken >= 9 * air.sent, "{air:?}");
    assert_eq!(air.forged, 0, "{air:?}");
    // A quarter each, less what came before the first frame of the pilot's.
    assert!(air.forbidden > 14_000 && air.tally.tag > 10_000 && air.tally.old > 10_000, "{air:?}");
    assert!(air.worst_tags <= 8, "{air:?}");
}

#[test]
fn in_quiet_air_everything_arrives_and_telemetry_is_opened() {
    let (outcome, _) = fly(Some(0), 2, &[]);
    let air = outcome.air;
    assert!(outcome.finished && outcome.succeeded(), "{:?}", outcome.judgement);
    assert!(air.sent > 100 && air.taken == air.sent && air.telemetry > 100, "{air:?}");
    assert_eq!((air.strange, air.tally.refused()), (0, 0), "{air:?}");
}

#[test]
fn l7_a_lost_session_lands_the_vehicle() {
    for flood in [0, 2_000] {
        let (outcome, deadlines) = fly(Some(flood), 30, &["link-lost@hover"]);
        println!("{:?} {:?}", outcome.phases, outcome.air);
        assert!(outcome.succeeded(), "{:?}", outcome.judgement);
        assert!(outcome.phases.iter().any(|phase| phase.phase == FlightPhase::Landing), "{:?}", outcome.phases);
        assert_eq!((deadlines.missed, outcome.air.forged), (0, 0), "a stranger is no sign of life");
    }
}

#[test]
fn l8_a_session_that_comes_and_goes_ends_well() {
    let (outcome, deadlines) = fly(Some(2_000), 10, &["link-flap@hover"]);
    println!("{:?} {:?}", outcome.phases, outcome.air);
    assert!(outcome.succeeded(), "{:?}", outcome.judgement);
    assert!(outcome.air.taken > 100, "{:?}", outcome.air);
    assert_eq!((deadlines.missed, outcome.air.forged), (0, 0));
}

#[test]
fn l7_whoever_has_no_key_takes_over_no_flight_that_began_with_one() {
    // As the vehicle is delivered: packets that authenticate nobody may fly it, and the stranger has the transmitter's address.
    let (outcome, deadlines) = fly_with(Some(2_000), 30, &["link-lost@hover"], Some(FlightMode::PosHold), true);
    println!("{:?} {:?}", outcome.phases, outcome.air);
    assert!(outcome.succeeded(), "{:?}", outcome.judgement);
    assert_eq!(deadlines.stolen, 0, "not while it is armed, though the pilot is silent");
    assert!(outcome.air.forged > 0, "on the ground the parameter lets it: the test can fail");
}

#[test]
fn a_program_flies_with_sealed_commands_that_are_acknowledged() {
    let (outcome, deadlines) = fly_with(Some(2_000), 5, &[], None, false);
    println!("{:?}", outcome.air);
    assert!(outcome.finished && outcome.succeeded(), "{:?}", outcome.judgement);
    assert_eq!((deadlines.missed, outcome.air.forged), (0, 0));
    assert!(outcome.air.acknowledged > 50 && outcome.air.taken == outcome.air.sent, "{:?}", outcome.air);
}

#[test]
fn l7_after_the_last_authentic_frame_the_failsafe_acts_in_time() {
    let (outcome, deadlines) = fly(Some(2_000), 30, &["link-lost@hover"]);
    let reaction = deadlines.lost.zip(deadlines.heard).map(|(lost, heard)| lost.since(heard));
    println!("{reaction:?}");
    assert!(outcome.succeeded(), "{:?}", outcome.judgement);
    assert!(reaction.is_some_and(|reaction| reaction <= Duration::from_millis(520)), "{reaction:?}");
}
