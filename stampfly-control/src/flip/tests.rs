use super::*;
use crate::airframe::Airframe;
use stampfly_types::{Duration, Quat};
use std::println;

const PERIOD: Duration = Duration::from_micros(2_500);

fn hover() -> StateEstimate {
    StateEstimate { height: 2.0, valid: Validity::ALL, ..StateEstimate::default() }
}

fn flip() -> FlipSequencer {
    FlipSequencer::new(&FlipConfig::for_airframe(&Airframe::EXAMPLE))
}

const NOW: Instant = Instant::from_secs(10);

#[test]
fn every_condition_refuses() {
    let start = |estimate: &StateEstimate| flip().start(NOW, FlipDirection::Left, estimate);
    assert_eq!(start(&hover()), Ok(()));
    for (estimate, refusal) in [
        (StateEstimate { height: 0.3, ..hover() }, FlipRefusal::Height),
        (StateEstimate { valid: Validity::ALL.without(Validity::HEIGHT), ..hover() }, FlipRefusal::Estimate),
        (StateEstimate { valid: Validity::ALL.without(Validity::TILT), ..hover() }, FlipRefusal::Estimate),
        (StateEstimate { velocity: Vec3::new(0.0, 0.0, f32::NAN), ..hover() }, FlipRefusal::Estimate),
        (StateEstimate { velocity: Vec3::new(0.0, 0.0, 0.3), ..hover() }, FlipRefusal::Unsteady),
        (StateEstimate { velocity: Vec3::new(0.5, 0.0, 0.0), ..hover() }, FlipRefusal::Unsteady),
        (StateEstimate { angular_rate: Vec3::new(0.0, 0.0, 2.0), ..hover() }, FlipRefusal::Unsteady),
        (StateEstimate { attitude: Quat::from_euler_angles(0.3, 0.0, 0.0), ..hover() }, FlipRefusal::Unsteady),
    ] {
        assert_eq!(start(&estimate), Err(refusal), "{estimate:?}");
    }
    let mut flip = flip();
    assert_eq!(flip.start(NOW, FlipDirection::Left, &hover()), Ok(()));
    assert_eq!(flip.start(NOW, FlipDirection::Left, &hover()), Err(FlipRefusal::Busy));
    flip.cancel(NOW);
    assert_eq!(flip.start(NOW + PERIOD, FlipDirection::Left, &hover()), Err(FlipRefusal::Busy), "a pause first");
    assert_eq!(flip.start(NOW + Duration::from_secs(2), FlipDirection::Left, &hover()), Ok(()));
}

#[test]
fn a_weak_vehicle_never_turns_over() {
    let weak = Airframe { mass: 0.7, ..Airframe::EXAMPLE };
    let mut flip = FlipSequencer::new(&FlipConfig::for_airframe(&weak));
    let high = StateEstimate { height: 100.0, ..hover() };
    assert_eq!(flip.start(NOW, FlipDirection::Left, &high), Err(FlipRefusal::Height));
}

/// Steps a vehicle that does exactly as it is told; gives the angle turned about roll and pitch,
/// the time it took, and how far it rose.
fn flown(direction: FlipDirection, estimate: &mut StateEstimate) -> [f32; 4] {
    let airframe = Airframe::EXAMPLE;
    let (mut flip, mut now) = (flip(), NOW);
    flip.start(now, direction, estimate).expect("nothing speaks against it");
    let (mut roll, mut pitch, mut highest) = (0.0, 0.0, 0.0f32);
    while flip.stage() != FlipStage::Over {
        let demand = flip.step(now, estimate);
        let dt = PERIOD.seconds();
        estimate.angular_rate = demand.rate;
        estimate.attitude *= Quat::from_scaled_axis(demand.rate * dt);
        estimate.attitude = estimate.attitude.normalize();
        let push = estimate.attitude * Vec3::new(0.0, 0.0, -demand.thrust / airframe.mass);
        estimate.velocity += (push + Vec3::new(0.0, 0.0, GRAVITY)) * dt;
        estimate.position += estimate.velocity * dt;
        (roll, pitch) = (roll + demand.rate.x * dt, pitch + demand.rate.y * dt);
        highest = highest.max(-estimate.position.z);
        now += PERIOD;
        assert!(now.since(NOW) < Duration::from_secs(5), "it ends");
    }
    assert!(flip.is_complete());
    [roll, pitch, now.since(NOW).seconds(), highest]
}

#[test]
fn it_turns_once_in_every_direction_and_ends_level_and_at_rest() {
    for direction in FlipDirection::ALL {
        let mut estimate = hover();
        let [roll, pitch, seconds, highest] = flown(*direction, &mut estimate);
        let expected = match direction {
            FlipDirection::Left => (-math::TAU, 0.0),
            FlipDirection::Right => (math::TAU, 0.0),
            FlipDirection::Forward => (0.0, -math::TAU),
            FlipDirection::Back => (0.0, math::TAU),
        };
        assert!((roll - expected.0).abs() < 0.3 && (pitch - expected.1).abs() < 0.3, "{direction:?}: {roll} {pitch}");
        assert!(attitude::down_in_body(&estimate.attitude).z > 0.97);
        let moved = estimate.position;
        println!("{direction:?}: {seconds:.2} s, moved by {moved:.2?} m");
        assert!(seconds < 2.0 && moved.norm() < 0.8, "{seconds} s, {moved}");
        assert!(highest < FlipConfig::for_airframe(&Airframe::EXAMPLE).room, "{direction:?} rises by {highest} m");
    }
}

#[test]
fn what_does_not_follow_is_given_up() {
    // It does not climb; it climbs and does not turn; it turns too fast.
    let climbing = StateEstimate { velocity: Vec3::new(0.0, 0.0, -3.0), ..hover() };
    let spinning = StateEstimate { angular_rate: Vec3::new(33.0, 0.0, 0.0), ..climbing };
    for after_start in [hover(), climbing, spinning] {
        let (mut flip, mut now) = (flip(), NOW);
        flip.start(now, FlipDirection::Right, &hover()).expect("nothing speaks against it");
        let mut recovered = false;
        while flip.stage() != FlipStage::Over {
            now += PERIOD;
            flip.step(now, &after_start);
            recovered |= flip.stage() == FlipStage::Recover;
            assert!(now.since(NOW) < Duration::from_secs(5), "it ends");
        }
        assert!(recovered && !flip.is_complete());
    }
}

#[test]
fn an_estimate_that_breaks_ends_it() {
    let mut flip = flip();
    flip.start(NOW, FlipDirection::Right, &hover()).expect("nothing speaks against it");
    let broken = StateEstimate { angular_rate: Vec3::new(f32::NAN, 0.0, 0.0), ..hover() };
    let demand = flip.step(NOW + PERIOD, &broken);
    assert_eq!(flip.stage(), FlipStage::Over);
    assert!(demand.thrust.is_finite() && demand.rate == Vec3::zeros());
}

#[test]
fn what_fails_on_the_way_is_levelled_and_a_turn_needs_no_climb_rate() {
    let climbing = StateEstimate { velocity: Vec3::new(0.0, 0.0, -3.0), ..hover() };
    let begun = |estimate: &StateEstimate| {
        let mut flip = flip();
        flip.start(NOW, FlipDirection::Right, &hover()).expect("nothing speaks against it");
        flip.step(NOW + PERIOD, estimate);
        flip
    };
    for estimate in [hover(), climbing] {
        let mut flip = begun(&estimate);
        flip.abort(NOW + PERIOD);
        assert_eq!(flip.stage(), FlipStage::Recover);
    }
    let blind = StateEstimate { valid: Validity::TILT, ..climbing };
    let mut turning = begun(&climbing);
    turning.step(NOW + PERIOD, &blind);
    assert_eq!(turning.stage(), FlipStage::Turn);
    let mut rising = begun(&hover());
    let demand = rising.step(NOW + PERIOD, &blind);
    assert_eq!((rising.stage(), demand.thrust), (FlipStage::Recover, rising.config.hover_thrust));
    rising.step(NOW + PERIOD, &blind);
    assert_eq!(rising.stage(), FlipStage::Over, "level and at rest");
    let leans = StateEstimate { attitude: Quat::from_euler_angles(0.5, 0.0, 0.0), ..blind };
    let mut rising = begun(&leans);
    let demand = rising.step(NOW + PERIOD, &leans);
    assert!(rising.stage() == FlipStage::Recover && demand.rate.x < 0.0 && demand.thrust > rising.config.hover_thrust);
}
