//! Heading: found in motion, from the field with its declination, or given; valid only when known.

use super::run::{Plan, check, run, wrapped};
use super::world::{Setting, World, vector};
use stampfly_eskf::{Aiding, Eskf, EskfConfig, Estimator, Refusal, StartHeading, aid};
use stampfly_types::messages::{CalibrationResult, ImuData, Validity};
use stampfly_types::{GRAVITY, Instant, Vec3, math};

/// Degrees.
const NOSES: [f64; 5] = [70.0, -110.0, 179.0, 25.0, -45.0];

#[test]
fn a_receiver_alone_finds_any_heading() {
    for (nose, seed) in NOSES.into_iter().zip(1..) {
        let setting = Setting { heading: nose.to_radians(), fix_delay: 0.15, seed, ..Setting::default() };
        let outcome = run(setting, Plan::default(), EskfConfig::outdoors());
        check(&format!("nose at {nose} degrees, no magnetometer"), &setting, &outcome);
        let known = outcome.heading_known.expect("found");
        assert!((setting.stands..setting.stands + 15.0).contains(&known), "nose at {nose}: after {known} s");
    }
}

#[test]
fn a_magnetometer_with_its_declination_finds_it_standing() {
    for (nose, declination) in NOSES.into_iter().zip([15.0f64, -12.0, 0.0, 25.0, 8.0]) {
        let east = declination.to_radians();
        let field = [20.0 * east.cos(), 20.0 * east.sin(), 40.0];
        let setting = Setting { heading: nose.to_radians(), field, stands: 10.0, ..Setting::default() };
        let plan = Plan { mag: true, ..Plan::default() };
        let config = EskfConfig {
            mag_enable: true,
            start_heading: StartHeading::Magnetic,
            earth_field: Some(aid::field::earth(east as f32, math::atan2(2.0, 1.0))),
            ..EskfConfig::outdoors()
        };
        let outcome = run(setting, plan, config);
        check(&format!("nose at {nose}, declination {declination} degrees"), &setting, &outcome);
        assert!(outcome.heading_known.is_some_and(|known| known < 0.1), "{nose}: standing");
        assert_eq!((outcome.gated, outcome.refused, outcome.resets), (0, 0, 0));
    }
}

#[test]
fn a_given_heading_is_taken() {
    let setting = Setting { heading: 1.2, ..Setting::default() };
    let start_heading = StartHeading::Given { heading: 1.15, sigma: 0.1 };
    let outcome = run(setting, Plan::default(), EskfConfig { start_heading, ..EskfConfig::outdoors() });
    check("given", &setting, &outcome);
    assert!(outcome.heading_known.is_some_and(|known| known < 0.1));
}

#[test]
fn without_motion_no_heading_is_claimed() {
    let setting = Setting { speed: 0.0, heading: 1.0, ..Setting::default() };
    let outcome = run(setting, Plan { seconds: 300.0, ..Plan::default() }, EskfConfig::outdoors());
    assert_eq!(outcome.heading_known, None);
    assert!(outcome.invalid == 1.0, "nor what hangs on it");
    assert!(outcome.horizontal < 1.0, "it is where the receiver says all the same: {} m", outcome.horizontal);
}

#[test]
fn a_heading_that_is_roughly_known_is_not_valid() {
    let force = Vec3::new(0.0, 0.0, -GRAVITY);
    let valid = |sigma: f32| {
        let start_heading = StartHeading::Given { heading: 0.5, sigma };
        let mut eskf = Eskf::new(EskfConfig { start_heading, ..EskfConfig::outdoors() });
        eskf.initialize(Instant::ZERO, &CalibrationResult { specific_force: force, ..CalibrationResult::default() });
        eskf.predict(Instant::from_millis(5), &ImuData { accel: force, ..ImuData::default() });
        eskf.estimate().valid.contains(Validity::HEADING)
    };
    assert!(valid(0.1) && !valid(0.5) && !valid(f32::INFINITY) && !valid(f32::NAN));
}

#[test]
fn what_hangs_on_the_heading_is_refused_and_counted_until_it_is_known() {
    let mut world = World::new(Setting::default());
    let mut eskf = Eskf::new(EskfConfig::outdoors());
    let force = Vec3::new(0.0, 0.0, -GRAVITY);
    let fix = world.fix(0.0);
    let position = |eskf: &mut Eskf, time: f64| {
        eskf.fuse_position(World::instant(time), &vector(fix.position), &Vec3::new(0.5, 0.5, 1.0))
    };
    _ = position(&mut eskf, 0.0);
    eskf.initialize(World::instant(0.0), &CalibrationResult { specific_force: force, ..CalibrationResult::default() });
    for step in 1..=200 {
        let at = f64::from(step) / 200.0;
        eskf.predict(World::instant(at), &world.imu(at));
    }
    _ = position(&mut eskf, 0.4);
    _ = position(&mut eskf, 1.03);
    _ = position(&mut eskf, 1.0);
    _ = position(&mut eskf, 1.0);
    _ = eskf.fuse(World::instant(1.0), aid::velocity::body, [0.0; 3], [0.01; 3], 5.0);
    let tally = eskf.tally(Aiding::Position);
    let counted =
        [Refusal::NotInitialized, Refusal::Stale, Refusal::Future, Refusal::Repeated].map(|why| tally.refused(why));
    assert_eq!((counted, tally.all_refused(), tally.fused), ([1; 4], 4, 1));
    assert_eq!(eskf.tally(Aiding::Own).refused(Refusal::Missing), 1);
    assert!(wrapped(0.0).abs() < 1e-9);
}
