//! A link that is lost at any moment, in any mode: noticed in time, and a soft landing.
//!
//! Two seeds; `FLIGHTS=20` flies as many of each, and prints the longest time and the hardest touch.

use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_host::flown::fly;
use stampfly_host::recorder::Recorder;
use stampfly_sim::fault::{Fault, Moment};
use stampfly_sim::vehicle::Vehicle;
use stampfly_types::messages::FlightMode;

/// From the last frame to the alert, s: half a second, and what a frame and a pass of the failsafe take.
const NOTICED: f64 = 0.52;
/// At the first touch after it, m/s.
const SOFT: f64 = 0.5;

#[test]
fn a_link_lost_at_any_moment_lands_softly() {
    let seeds: u64 = std::env::var("FLIGHTS").ok().and_then(|flights| flights.parse().ok()).unwrap_or(2);
    let pilots = [FlightMode::PosHold, FlightMode::AltHold, FlightMode::Stabilize, FlightMode::Acro].map(Some);
    let (mut longest, mut hardest, mut flown) = (0.0f64, 0.0f64, 0);
    for moment in Moment::ALL {
        for pilot in pilots.into_iter().chain([None]) {
            for seed in 1..=seeds {
                let what = format!("{} {pilot:?} seed {seed}", moment.name());
                let mission = Mission::parse("arm; takeoff 0.5; hover 2; goto 1 0 0.7; land").expect("a mission");
                let fault = format!("link-lost@{}", moment.name());
                let faults = vec![Fault::parse(&fault, StampFly::FAULTS).expect("a fault")];
                let setup = Setup { mission, faults, pilot, ..Setup::reference(seed) };
                let outcome = fly::<StampFly>(&setup, &mut Recorder::<StampFly>::hash_only(), &mut |_, _| {}).outcome;
                let judged = outcome.judgement;
                assert!(
                    judged.as_expected && judged.violations.is_empty(),
                    "{what}: {} {:?}",
                    judged.outcome,
                    judged.violations
                );
                let lost = judged.faults[0].since.expect("it begins");
                let noticed = judged.alerts.iter().find(|alert| alert.name == "COMM_LOST" && alert.since >= lost);
                let noticed = noticed.map_or(f64::INFINITY, |alert| alert.since - lost);
                flown += 1;
                longest = longest.max(noticed);
                if moment.name() == "ground" {
                    assert_eq!(judged.outcome, "refused", "{what}: nobody is heard, and it arms");
                    continue;
                }
                let touch = judged.touch_speed_mps.expect("it comes down");
                assert!(
                    noticed <= NOTICED && touch <= SOFT,
                    "{what}: noticed after {noticed} s, touches at {touch} m/s"
                );
                hardest = hardest.max(touch);
            }
        }
    }
    println!("{flown} flights: noticed within {longest:.3} s, touch at most {hardest:.2} m/s");
}
