//! Sensors with a user's model, missing axes, and standing still.

use super::run::heading;
use super::world::{Setting, World, vector};
use stampfly_eskf::aid::{Row, velocity};
use stampfly_eskf::filter::{NominalState, POSITION};
use stampfly_eskf::{Aiding, Eskf, EskfConfig, Estimator, Fusion, Refusal, StartHeading};
use stampfly_types::messages::{CalibrationResult, ImuData, Validity};
use stampfly_types::{GRAVITY, Instant, Vec3};

const FORCE: Vec3 = Vec3::new(0.0, 0.0, -GRAVITY);

fn started(config: EskfConfig) -> Eskf {
    let mut eskf = Eskf::new(config);
    eskf.initialize(World::instant(0.0), &CalibrationResult { specific_force: FORCE, ..CalibrationResult::default() });
    eskf
}

fn north(config: EskfConfig) -> EskfConfig {
    EskfConfig { start_heading: StartHeading::Given { heading: 0.0, sigma: 0.02 }, initial_position: 1.0, ..config }
}

/// Dead reckoning by wheels alone: speed along the nose and no sideways slip, 0.2 s late, for two
/// minutes.
#[test]
fn late_wheel_speeds_hold_velocity_and_position() {
    let mut world = World::new(Setting::default());
    let mut eskf = started(north(EskfConfig::outdoors()));
    let mut worst = 0.0f64;
    for step in 1..=24_000u32 {
        let time = f64::from(step) / 200.0;
        eskf.predict(World::instant(time), &world.imu(time));
        if step.is_multiple_of(10) && time > 0.2 {
            let then = time - 0.2;
            let [x, y, _] = world.truth(then).velocity;
            let along = |state: &NominalState| {
                let [x, y, z] = velocity::body(state);
                [x, y, z]
            };
            let speed = x.hypot(y) as f32;
            let fusion = eskf.fuse(World::instant(then), along, [speed, 0.0, 0.0], [0.01, 0.01, 0.01], 5.0);
            assert!(fusion.is_fused(), "{time} s: {fusion:?}");
        }
        let error = vector(world.truth(time).velocity) - eskf.estimate().velocity;
        worst = worst.max(f64::from(error.norm()));
    }
    let estimate = eskf.estimate();
    assert!(worst < 0.6, "{worst} m/s");
    assert!(estimate.valid.contains(Validity::VELOCITY_XY | Validity::POSITION_XY));
    let end = world.truth(120.0);
    // 900 m of path, and only the gyro holds the heading.
    let off = vector(end.position) - estimate.position;
    assert!(off.norm() < 20.0, "{} m", off.norm());
    assert!((heading(&eskf) - end.heading).sin().abs() < 0.1);
}

/// Ranges to three beacons in a field, one of them wrong.
#[test]
fn ranges_to_beacons_place_it_and_one_that_lies_is_left_out() {
    let mut eskf = started(EskfConfig { initial_position: 5.0, ..north(EskfConfig::outdoors()) });
    let beacons = [Vec3::new(30.0, 0.0, -2.0), Vec3::new(-20.0, 25.0, -2.0), Vec3::new(0.0, -40.0, -2.0)];
    let truth = Vec3::new(2.0, -3.0, 0.0);
    for step in 1..=2_000u64 {
        let at = Instant::from_micros(10_000_000 + step * 5_000);
        eskf.predict(at, &ImuData { accel: FORCE, ..ImuData::default() });
        if !step.is_multiple_of(20) {
            continue;
        }
        for (index, beacon) in beacons.into_iter().enumerate() {
            let range = |state: &NominalState| {
                let away = state.position - beacon;
                let distance = away.norm().max(0.1);
                let [x, y, z] = [away.x / distance, away.y / distance, away.z / distance];
                [Row::new(distance, [(POSITION, x), (POSITION + 1, y), (POSITION + 2, z)])]
            };
            let lie = if index == 2 && step > 1_000 { 15.0 } else { 0.0 };
            let fusion = eskf.fuse(at, range, [(truth - beacon).norm() + lie], [0.01], 5.0);
            assert_eq!(fusion.is_fused(), lie == 0.0, "{step}: {fusion:?}");
        }
    }
    let estimate = eskf.estimate();
    let off = (truth - estimate.position).horizontal().norm();
    assert!(off < 0.1, "{off} m");
    let tally = eskf.tally(Aiding::Own);
    assert_eq!((tally.fused, tally.gated, tally.all_refused()), (250, 50, 0));
}

#[test]
fn a_model_that_is_no_number_changes_nothing() {
    let mut eskf = started(north(EskfConfig::outdoors()));
    let at = World::instant(0.005);
    eskf.predict(at, &ImuData { accel: FORCE, ..ImuData::default() });
    let before = (*eskf.nominal(), *eskf.covariance());
    let row = |predicted: f32, by: f32| move |_: &NominalState| [Row::new(predicted, [(POSITION, by)])];
    let refused = Fusion::Refused(Refusal::NotFinite);
    assert_eq!(eskf.fuse(at, row(f32::NAN, 1.0), [0.0], [1.0], 5.0), refused);
    assert_eq!(eskf.fuse(at, row(0.0, f32::INFINITY), [0.0], [1.0], 5.0), refused);
    assert_eq!(eskf.fuse(at, row(0.0, 1.0), [f32::NAN], [1.0], 5.0), refused);
    assert_eq!(eskf.fuse(at, row(0.0, 1.0), [0.0], [0.0], 5.0), refused);
    assert_eq!(eskf.fuse(at, row(0.0, 1.0), [0.0], [-1.0], 5.0), refused);
    assert_eq!(eskf.fuse(at, row(0.0, 1.0), [0.0], [1.0], f32::NAN), refused);
    assert_eq!((*eskf.nominal(), *eskf.covariance()), before);
    assert_eq!(eskf.tally(Aiding::Own).refused(Refusal::NotFinite), 6);
}

#[test]
fn a_fix_in_two_dimensions_leaves_the_height_alone() {
    let mut eskf = started(north(EskfConfig { initial_position: 2.0, ..EskfConfig::outdoors() }));
    for step in 1..=400u64 {
        let at = Instant::from_micros(10_000_000 + step * 5_000);
        eskf.predict(at, &ImuData { accel: FORCE, ..ImuData::default() });
        if step.is_multiple_of(40) {
            let position = Vec3::new(0.5, -0.5, f32::NAN);
            assert!(eskf.fuse_position(at, &position, &Vec3::new(0.3, 0.3, f32::INFINITY)).is_fused());
        }
    }
    let estimate = eskf.estimate();
    assert!((estimate.position.x - 0.5).abs() < 0.3 && (estimate.position.y + 0.5).abs() < 0.3);
    assert!(estimate.position.z.abs() < 1e-3, "{}", estimate.position.z);
    assert!(estimate.valid.contains(Validity::POSITION_XY) && !estimate.valid.contains(Validity::POSITION_Z));
    let nothing = Vec3::new(f32::INFINITY, f32::INFINITY, f32::INFINITY);
    let now = Instant::from_micros(12_000_001);
    assert_eq!(eskf.fuse_position(now, &Vec3::zeros(), &nothing), Fusion::Refused(Refusal::Missing));
    let unknown = Vec3::new(0.1, f32::NAN, 0.1);
    let later = Instant::from_micros(12_000_002);
    assert_eq!(eskf.fuse_position(later, &Vec3::zeros(), &unknown), Fusion::Refused(Refusal::NotFinite));
}

#[test]
fn each_axis_is_weighed_by_its_own_deviation() {
    let mut eskf = started(north(EskfConfig { initial_position: 1.0, ..EskfConfig::outdoors() }));
    let at = World::instant(0.005);
    eskf.predict(at, &ImuData { accel: FORCE, ..ImuData::default() });
    assert!(eskf.fuse_position(at, &Vec3::new(1.0, 1.0, 1.0), &Vec3::new(0.1, 1.0, 3.0)).is_fused());
    let p = eskf.nominal().position;
    for (got, sigma) in [(p.x, 0.1f32), (p.y, 1.0), (p.z, 3.0)] {
        let expected = 1.0 / (1.0 + sigma * sigma);
        assert!((got - expected).abs() < 1e-3, "{got}, not {expected}");
    }
}

#[test]
fn a_standing_vehicle_may_say_so_beside_a_late_receiver() {
    let mut eskf = started(north(EskfConfig::outdoors()));
    let bias = Vec3::new(0.1, -0.05, 0.08);
    for step in 1..=4_000u64 {
        let now = 10_000_000 + step * 5_000;
        let at = Instant::from_micros(now);
        eskf.predict(at, &ImuData { accel: FORCE + bias, ..ImuData::default() });
        if step.is_multiple_of(10) {
            assert!(eskf.fuse_zero_velocity(at, 0.02).is_fused());
        }
        if step > 100 && step.is_multiple_of(40) {
            let then = Instant::from_micros(now - 150_000);
            assert!(eskf.fuse_velocity(then, &Vec3::new(0.05, -0.05, 0.1), &Vec3::new(0.1, 0.1, 0.2)).is_fused());
        }
    }
    assert!(eskf.estimate().velocity.norm() < 0.05, "{}", eskf.estimate().velocity.norm());
    assert!(eskf.estimate().valid.contains(Validity::VELOCITY_XY | Validity::VELOCITY_Z));
}
