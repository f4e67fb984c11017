//! A link that is lost at any moment, in any mode: noticed in time, and a soft landing.
//!
//! One seed, in the thorough size two; `FLIGHTS=20` flies as many of each, and prints the longest time and the hardest touch.

use crate::thorough::flights;
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_host::flown::fly;
use stampfly_sim::fault::{Fault, Moment};
use stampfly_sim::vehicle::Vehicle;
use stampfly_types::messages::FlightMode;

/// From the last frame to the alert, s: half a second, and what a frame and a pass of the failsafe take.
const NOTICED: f64 = 0.52;
/// At the first touch after it, m/s.
const SOFT: f64 = 0.5;

#[test]
fn a_link_lost_at_any_moment_lands_softly() {
    let pilots = [FlightMode::PosHold, FlightMode::AltHold, FlightMode::Stabilize, FlightMode::Acro].map(Some);
    let (mut longest, mut hardest, mut flown) = (0.0f64, 0.0f64, 0);
    for moment in Moment::USUAL {
        for pilot in pilots.into_iter().chain([None]) {
            for seed in 1..=flights(1, 2) {
                let (noticed, touch) = lose(moment, pilot, seed);
                flown += 1;
                longest = longest.max(noticed);
                hardest = hardest.max(touch.unwrap_or_default());
            }
        }
    }
    println!("{flown} flights: noticed within {longest:.3} s, touch at most {hardest:.2} m/s");
}

/// When the loss was noticed, s after it, and the speed of the touch, m/s, of a vehicle that had armed.
fn lose(moment: Moment, pilot: Option<FlightMode>, seed: u64) -> (f64, Option<f64>) {
    let what = format!("{} {pilot:?} seed {seed}", moment.name());
    let mission = Mission::parse("arm; takeoff 0.5; hover 2; goto 1 0 0.7; land").expect("a mission");
    let fault = format!("link-lost@{}", moment.name());
    let faults = vec![Fault::parse(&fault, StampFly::FAULTS).expect("a fault")];
    let setup = Setup { mission, faults, pilot, ..Setup::reference(seed) };
    let judged = fly::<StampFly>(&setup, &mut (), &mut |_, _| {}).outcome.judgement;
    assert!(judged.as_expected && judged.violations.is_empty(), "{what}: {} {:?}", judged.outcome, judged.violations);
    let lost = judged.faults[0].since.expect("it begins");
    let alert = judged.alerts.iter().find(|alert| alert.name == "COMM_LOST" && alert.since >= lost);
    let noticed = alert.map_or(f64::INFINITY, |alert| alert.since - lost);
    assert!(noticed <= NOTICED, "{what}: noticed after {noticed} s");
    if moment == Moment::Ground {
        assert_eq!(judged.outcome, "refused", "{what}: nobody is heard, and it arms");
        return (noticed, None);
    }
    let touch = judged.touch_speed_mps.expect("it comes down");
    assert!(touch <= SOFT, "{what}: touches at {touch} m/s");
    (noticed, Some(touch))
}
