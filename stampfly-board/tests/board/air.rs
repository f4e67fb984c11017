//! A pilot flies over the secure session's real bytes: in quiet air, flooded, and with the radio lost.

use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Air, Outcome, Setup, StampFly};
use stampfly_board::topics::Id;
use stampfly_flight::Observer;
use stampfly_sim::fault::Fault;
use stampfly_sim::vehicle::{Vehicle, Verdict, Witness};
use stampfly_types::messages::{FlightMode, FlightPhase};
use stampfly_types::{Duration, Instant};

/// A period of control, and what a stamp of a sensor's may differ.
const LATE: Duration = Duration::from_micros(3_750);

/// Counts the duties that came later than a period and a half after those before.
#[derive(Default)]
struct Deadlines {
    last: Option<Instant>,
    met: u32,
    missed: u32,
}

impl Observer for Deadlines {}

impl Witness<Runnables> for Deadlines {
    fn published(&mut self, topic: usize, at: Instant, _: u32, _: &[u32]) {
        if topic == Id::actuator_motor as usize {
            let is_late = self.last.is_some_and(|last| at.since(last) > LATE);
            (self.missed, self.met) = (self.missed + u32::from(is_late), self.met + u32::from(!is_late));
            self.last = Some(at);
        }
    }
}

fn fly(flood: Option<u32>, hover: u32, faults: &[&str]) -> (Outcome, Deadlines) {
    let mission = Mission::parse(&format!("arm\ntakeoff 0.5\nhover {hover}\nland\n")).expect("a mission");
    let faults = faults.iter().map(|text| Fault::parse(text, StampFly::FAULTS).expect("a fault")).collect();
    let setup = Setup {
        mission,
        faults,
        pilot: Some(FlightMode::PosHold),
        air: flood.map(|flood| Air { flood }),
        ..Setup::reference(1)
    };
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
