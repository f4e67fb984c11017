//! Faults in flight: what the aircraft does, as its topics and the truth show it.

use crate::recorded::{Flown, Row};
use stampfly_fixed_wing::messages::{Lateral, Place, Troubles};
use stampfly_plane::Parameters;
use stampfly_sim::fault::Class;
use stampfly_sim::vehicle::{Options, Verdict};
use stampfly_types::messages::CommandSource;
use stampfly_types::{Duration, Instant, frame};

/// A moment of the mission `round`: it cruises along its longest leg.
const CRUISE: f32 = 60.0;
/// The first two way-points are 300 m apart.
const TURNING: f32 = 45.0;

/// A flight of `round`; words with `@` are faults, others parameters.
fn flight(text: &str) -> Flown {
    let words = |is_fault: bool| {
        let words = text.split_whitespace().filter(|word| word.contains('@') == is_fault);
        words.map(Into::into).collect()
    };
    let flown = Flown::with(&Options { fault: words(true), param: words(false), ..Options::default() }, 1);
    let changes = flown.outcome.faults.iter().all(|(_, changes)| *changes > 0);
    assert!(changes, "a fault did nothing: {:?}", flown.outcome.faults);
    flown
}

fn power_on() -> Instant {
    Instant::ZERO
}

fn after(seconds: f32) -> Instant {
    power_on() + Duration::from_seconds(seconds)
}

/// It came down once, softly, on the strip.
fn landed_on_the_strip(flown: &Flown) {
    let [touch] = flown.outcome.measured.touchdowns.all()[..] else {
        panic!("{:?}", flown.outcome.measured.touchdowns.all())
    };
    assert!(touch.sink < 1.5 && touch.across.abs() < 5.0 && (-5.0..65.0).contains(&touch.past), "{touch:?}");
    assert!(flown.outcome.disarmed && flown.outcome.succeeded(), "{}", flown.outcome.sentence());
}

/// All of the mission, to its end.
fn finished(flown: &Flown) {
    assert_eq!(flown.outcome.legs, [7, 7]);
    landed_on_the_strip(flown);
}

/// While it flew, it never was near the stall.
fn fast_enough(flown: &Flown) {
    let stall = Parameters::default().speed.stall;
    let cruises = flown.rows.iter().filter(|row| row.place() == Place::CruisingCruise);
    let slowest = cruises.map(|row| (row.truth.velocity - row.truth.wind).norm()).fold(f32::INFINITY, f32::min);
    assert!(slowest > 1.15 * stall && slowest.is_finite(), "{slowest} m/s");
}

/// Does it hold in each of these cycles, of which there are some?
fn always<'a>(mut rows: impl Iterator<Item = &'a Row> + Clone, holds: impl Fn(&Row) -> bool) -> bool {
    rows.clone().next().is_some() && rows.all(holds)
}

#[test]
fn without_a_fix_it_circles_at_its_height_and_flies_on_with_the_next_one() {
    let flown = flight(&format!("gnss-lost@{CRUISE}+60"));
    let lost = flown.first(|row| row.at > after(CRUISE) && row.troubled(Troubles::POSITION)).expect("noticed");
    assert!((9.0..11.0).contains(&lost.since(after(CRUISE)).seconds()), "{lost:?}");
    let circles = flown.between(lost, 0.1, 50.0);
    assert!(always(circles.clone(), |row| row.demand.lateral == Lateral::Bank && row.place() == Place::CruisingCruise));
    assert!(always(circles.clone(), |row| (row.height() - row.demand.height).abs() < 3.0), "at its height");
    let turned: f32 = circles.map(|row| row.truth.angular_rate.z * 0.02).sum();
    assert!(turned > 6.3, "a circle: {turned} rad");
    assert!(always(flown.between(after(CRUISE + 61.0), 0.0, 20.0), |row| row.demand.lateral != Lateral::Bank));
    fast_enough(&flown);
    finished(&flown);
}

#[test]
fn without_a_receiver_it_comes_down_where_it_is_against_the_wind() {
    for fault in ["gnss-lost", "gnss-silent"] {
        let flown = flight(&format!("{fault}@{CRUISE}"));
        let down = flown.first(|row| row.status.commander == CommandSource::Failsafe).expect("it gives up");
        let blind = down.since(after(CRUISE + 10.0)).seconds();
        assert!((blind - Parameters::default().path.blind).abs() < 0.5, "{blind} s");
        assert!(always(flown.between(after(CRUISE + 11.0), 0.0, 110.0), |row| (row.height() - row.demand.height)
            .abs()
            < 3.0));
        assert!(flown.places().iter().all(|place| *place != Place::LandingSlope), "it does not look for the strip");
        let [touch] = flown.outcome.measured.touchdowns.all()[..] else {
            panic!("{:?}", flown.outcome.measured.touchdowns.all())
        };
        assert!(touch.sink < 1.5 && touch.bank.abs() < 0.15, "{touch:?}");
        assert!(flown.outcome.disarmed);
        assert_eq!(flown.outcome.class(), Class::Landed);
    }
    // In a wind its nose is there at the touch.
    let options = Options { fault: vec![format!("gnss-lost@{CRUISE}")], wind: Some([0.0, 4.0]), ..Options::default() };
    let flown = Flown::with(&options, 2);
    let last = flown.rows.iter().rfind(|row| row.height() > 2.0).expect("it flew");
    let from = frame::yaw(&last.truth.attitude) + core::f32::consts::FRAC_PI_2;
    assert!(from.abs() < 0.35, "{from} rad from the wind");
    assert_eq!(flown.outcome.class(), Class::Landed);
}

#[test]
fn what_never_had_a_fix_does_not_arm() {
    let flown = flight("gnss-lost@0");
    assert!(!flown.outcome.armed && !flown.rows.is_empty() && flown.rows.iter().all(|row| !row.home.known));
}

#[test]
fn a_pitot_tube_that_is_blocked_or_silent_is_not_believed_and_the_mission_is_flown() {
    for fault in ["pitot-blocked@takeoff", "pitot-silent@takeoff"] {
        finished(&flight(fault));
    }
    for (fault, within) in [("pitot-blocked", 2.0), ("pitot-silent", 0.6)] {
        let flown = flight(&format!("{fault}@{CRUISE}"));
        let doubted = flown.first(|row| !row.air.measured).expect("noticed");
        assert!(doubted.since(after(CRUISE)).seconds() < within, "{fault} {doubted:?}");
        let flies = |row: &Row| row.place() == Place::CruisingCruise;
        let rest = flown.rows.iter().filter(|row| row.at > doubted && flies(row));
        assert!(always(rest.clone(), |row| !row.air.measured && row.troubled(Troubles::AIRSPEED)));
        let error = |row: &Row| row.air.airspeed - (row.truth.velocity - row.truth.wind).norm();
        assert!(always(rest, |row| error(row).abs() < 3.0), "the velocity less the wind is near");
        fast_enough(&flown);
        finished(&flown);
    }
}

#[test]
fn a_take_off_with_a_blocked_tube_is_given_up_once_and_it_parks() {
    let flown = flight("pitot-blocked@11");
    assert!(!flown.outcome.has_flown() && flown.outcome.disarmed, "{}", flown.outcome.sentence());
    let rolls = flown.places().iter().filter(|place| **place == Place::TakeOffRoll).count();
    assert_eq!(rolls, 1);
    let furthest = flown.rows.iter().map(Row::away).fold(0.0, f32::max);
    assert!(furthest < 100.0, "{furthest} m");
}

#[test]
fn without_a_compass_the_heading_is_found_in_the_roll() {
    let flown = flight("mag-silent@0");
    let is_rolling = |row: &&Row| row.place() == Place::TakeOffRoll;
    let first = flown.rows.iter().find(is_rolling).expect("it rolls");
    let last = flown.rows.iter().rfind(is_rolling).expect("it rolls");
    assert!(first.troubled(Troubles::POSITION) && !last.troubled(Troubles::POSITION));
    let error = frame::yaw(&last.estimate.attitude) - frame::yaw(&last.truth.attitude);
    assert!(error.abs() < 0.2, "{error} rad");
    finished(&flown);
}

#[test]
fn without_a_barometer_the_receivers_height_is_flown() {
    for fault in ["baro-silent@0".to_owned(), format!("baro-silent@{CRUISE}")] {
        let flown = flight(&fault);
        let cruise = flown.between(after(CRUISE), 20.0, 40.0);
        assert!(always(cruise, |row| (row.height() + row.estimate.position.z).abs() < 5.0));
        finished(&flown);
    }
}

#[test]
fn a_link_that_is_lost_brings_it_home_and_down() {
    let p = Parameters::default();
    for fault in [format!("link-lost@{TURNING}"), format!("link-lost@{TURNING}+20")] {
        let flown = flight(&fault);
        let lost = flown.first(|row| row.troubled(Troubles::LINK)).expect("noticed");
        assert!((lost.since(after(TURNING)).seconds() - p.link.lost).abs() < 0.5, "{lost:?}");
        // Somebody who is heard again and says nothing changes nothing.
        let home = |row: &Row| row.demand.lateral == Lateral::Orbit && row.demand.place == [0.0; 2];
        assert!(always(flown.between(lost, 0.1, p.link.land - 0.5), home));
        assert!(always(flown.between(lost, 40.0, p.link.land), |row| row.away() < p.path.radius + 15.0));
        let landing = flown.first(|row| row.place() == Place::LandingTransition).expect("it lands");
        assert!((landing.since(lost).seconds() - p.link.land).abs() < 0.5, "{landing:?}");
        landed_on_the_strip(&flown);
        assert_eq!(flown.outcome.class(), Class::Landed);
    }
    // A gap that is shorter than `link.lost` is none.
    let flown = flight(&format!("link-lost@{TURNING}+4"));
    assert!(flown.first(|row| row.troubled(Troubles::LINK)).is_none());
    finished(&flown);
}

#[test]
fn behind_the_fence_it_comes_home_and_lands() {
    let flown = flight("fence.radius=200");
    let left = flown.first(|row| row.troubled(Troubles::FENCE)).expect("it leaves it");
    assert!(always(flown.between(left, 0.1, 59.0), |row| row.demand.place == [0.0; 2]));
    assert!(always(flown.between(left, 12.0, 59.0), |row| !row.troubled(Troubles::FENCE)), "it is back soon");
    let furthest = flown.between(left, 0.0, 59.0).map(Row::away).fold(0.0, f32::max);
    assert!(furthest < 200.0 + 80.0, "a turn further: {furthest} m");
    let landing = flown.first(|row| row.place() == Place::LandingTransition).expect("it lands");
    assert!((landing.since(left).seconds() - Parameters::default().link.land).abs() < 0.5);
    let [touch] = flown.outcome.measured.touchdowns.all()[..] else { panic!("one landing") };
    assert!(touch.sink < 1.5 && touch.across.abs() < 5.0 && flown.outcome.disarmed, "{touch:?}");
}

#[test]
fn a_low_battery_is_a_landing() {
    let small = vec!["battery_capacity=1.0".into()];
    let options = Options { plant: small, param: vec!["battery.warning=12.3".into()], ..Options::default() };
    let flown = Flown::with(&options, 1);
    let low = flown.first(|row| row.troubled(Troubles::BATTERY)).expect("noticed");
    assert!(low > after(25.0), "in the air");
    let landing = flown.first(|row| row.place() == Place::LandingTransition).expect("it lands");
    assert!(landing.since(low).seconds() < 0.1, "at once");
    assert!(flown.outcome.legs[0] < 6, "before the mission is over");
    let [touch] = flown.outcome.measured.touchdowns.all()[..] else { panic!("one landing") };
    assert!(touch.sink < 1.5 && touch.across.abs() < 5.0 && flown.outcome.disarmed, "{touch:?}");
}

#[test]
fn with_a_jammed_aileron_the_mission_is_flown() {
    let flown = flight(&format!("aileron-jammed@{CRUISE}"));
    fast_enough(&flown);
    finished(&flown);
}

#[test]
fn a_small_bias_of_the_roll_rate_is_flown_with() {
    let flown = flight(&format!("gyro-bias=0.02@{CRUISE}"));
    fast_enough(&flown);
    finished(&flown);
}

#[test]
fn without_inertial_samples_the_throttle_closes_within_35_ms_for_good() {
    let flown = flight(&format!("imu-silent@{CRUISE}"));
    let last = *flown.imu.last().expect("there were some");
    let closed = flown.motor.iter().find(|(at, output)| *at > last && output.duty[0] == 0.0).expect("it closes").0;
    // 25 ms of age, and at most 10 ms until the controller looks.
    assert!(closed.since(last).seconds() <= 0.0351, "{:.4} s", closed.since(last).seconds());
    assert!(flown.motor.iter().filter(|(at, _)| *at >= closed).all(|(_, output)| output.duty == [0.0; 8]));
    let open = flown.motor.iter().rfind(|(at, _)| *at < closed).expect("before").1;
    assert!(open.duty[0] > 0.1, "it was open");
    assert!(flown.outcome.cut && flown.outcome.succeeded(), "{}", flown.outcome.sentence());
}

/// Its receiver is silent from the moment on at which it could be armed.
#[test]
fn nobody_takes_off_with_a_receiver_that_is_silent() {
    for fault in ["gnss-silent@ground", "gnss-lost@ground"] {
        let flown = flight(fault);
        assert_eq!(flown.outcome.class(), Class::Refused, "{fault}");
        assert!(!flown.outcome.has_flown(), "{fault}");
    }
}
