//! Attitude filters through their interface: arbitrary input, known motion, distorted fields, hard
//! iron, biases.

use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use stampfly_eskf::attitude::{AttitudeConfig, AttitudeFilter, Mahony};
use stampfly_eskf::{Estimator, Fusion, Refusal};
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimatorCommand, FlowData, ImuData, MagData, SensorMask, TofData, Validity,
};
use stampfly_types::{Duration, GRAVITY, Instant, Quat, Vec3, frame, math};

const DT: f32 = 0.005;
/// The earth's field in central Europe, NED.
const EARTH: Vec3 = Vec3::new(16.0, 0.0, 42.0);

/// A body moved by a hand: all axes, back and forth, up to 2 rad/s.
struct Hand {
    attitude: Quat,
    time: f32,
    noise: ChaCha8Rng,
}

impl Hand {
    fn new() -> Self {
        Self { attitude: Quat::identity(), time: 0.0, noise: ChaCha8Rng::seed_from_u64(7) }
    }

    fn vector(&mut self, sigma: f32) -> Vec3 {
        Vec3::from_fn(|_| sigma * self.noise.sample::<f32, _>(StandardNormal))
    }

    /// Moves for a step, or rests, and returns rate and specific force.
    fn step(&mut self, moving: bool) -> (Vec3, Vec3) {
        self.time += DT;
        let t = self.time;
        let rate = Vec3::new(1.2 * math::sin(2.1 * t), 0.9 * math::sin(1.3 * t + 1.0), math::sin(0.7 * t + 2.0));
        let rate = if moving { rate } else { Vec3::zeros() };
        let half = Quat::from_scaled_axis(rate * (0.5 * DT));
        let middle = self.attitude * half;
        self.attitude = middle * half;
        let push = Vec3::new(math::sin(3.0 * t), math::cos(4.3 * t), math::sin(5.1 * t)) * 1.5;
        let push = if moving { push } else { Vec3::zeros() };
        let force = middle.inverse() * (push - Vec3::new(0.0, 0.0, GRAVITY));
        (rate + self.vector(0.002), force + self.vector(0.02))
    }

    fn field(&mut self, world: Vec3) -> Vec3 {
        self.attitude.inverse() * world + self.vector(0.3)
    }

    /// Tilt and heading error of an attitude, degrees.
    fn errors(&self, attitude: &Quat) -> [f32; 2] {
        let error = *attitude * self.attitude.inverse();
        [frame::tilt(&error), frame::yaw(&error).abs()].map(f32::to_degrees)
    }
}

/// At rest, level, heading north, as the motion starts.
fn calibration() -> CalibrationResult {
    let specific_force = Vec3::new(0.0, 0.0, -GRAVITY);
    CalibrationResult { specific_force, field: EARTH, complete: true, ..Default::default() }
}

fn started() -> AttitudeFilter {
    AttitudeFilter::from_calibration(AttitudeConfig::default(), &calibration())
}

/// Runs the filter over `seconds` of motion with this world field, body field and gyro bias.
/// Returns the worst tilt and heading error of the last half, and the number of rejected fields.
fn carry(
    hand: &mut Hand,
    filter: &mut AttitudeFilter,
    seconds: f32,
    moving: bool,
    world: Vec3,
    body: Vec3,
    bias: Vec3,
) -> ([f32; 2], u32) {
    let steps = (seconds / DT) as u32;
    let (mut worst, mut refused) = ([0.0f32; 2], 0);
    for step in 0..steps {
        let (rate, force) = hand.step(moving);
        filter.step(&force, &(rate + bias), DT);
        if step % 2 == 0 {
            let field = hand.field(world) + body;
            refused += u32::from(!filter.field(&field, 0.0, 2.0 * DT).is_fused());
        }
        if step > steps / 2 {
            let [tilt, heading] = hand.errors(&filter.attitude());
            worst = [worst[0].max(tilt), worst[1].max(heading)];
        }
    }
    (worst, refused)
}

#[test]
fn a_hand_that_turns_and_pushes() {
    let (mut hand, mut filter) = (Hand::new(), started());
    let ([tilt, heading], refused) = carry(&mut hand, &mut filter, 60.0, true, EARTH, Vec3::zeros(), Vec3::zeros());
    assert!(tilt < 1.0 && heading < 1.0 && refused < 60, "{tilt}°, {heading}°, {refused} refused");
}

#[test]
fn rest_shows_a_bias_of_a_degree_a_second() {
    let (mut hand, mut filter) = (Hand::new(), AttitudeFilter::new(AttitudeConfig::default()));
    let bias = Vec3::new(0.017, -0.017, 0.017);
    carry(&mut hand, &mut filter, 10.0, false, EARTH, Vec3::zeros(), bias);
    assert!(filter.is_stationary());
    assert!((filter.gyro_bias() - bias).amax() < 5e-4, "{:?}", filter.gyro_bias());
    assert!(filter.gyro_bias_sigma() < 2.0 * AttitudeConfig::default().rest_bias_sigma);
}

#[test]
fn motion_shows_it_too_and_a_clean_field_its_vertical_part() {
    let bias = Vec3::new(0.015, -0.012, 0.010);
    let mut hand = Hand::new();
    let mut filter = AttitudeFilter::new(AttitudeConfig::default());
    carry(&mut hand, &mut filter, 120.0, true, EARTH, Vec3::zeros(), bias);
    assert!(!filter.is_stationary());
    let off = (filter.gyro_bias() - bias).amax();
    assert!(off < 3e-3, "{:?} for {bias:?}", filter.gyro_bias());
    let (errors, _) = carry(&mut hand, &mut filter, 20.0, true, EARTH, Vec3::zeros(), bias);
    assert!(errors[0] < 1.0 && errors[1] < 2.0, "{errors:?}");
}

#[test]
fn a_magnet_nearby_turns_nothing_and_is_reported() {
    let (mut hand, mut filter) = (Hand::new(), started());
    carry(&mut hand, &mut filter, 20.0, true, EARTH, Vec3::zeros(), Vec3::zeros());
    let bent = EARTH + Vec3::new(0.0, 25.0, 0.0);
    let ([tilt, heading], refused) = carry(&mut hand, &mut filter, 15.0, true, bent, Vec3::zeros(), Vec3::zeros());
    assert!(tilt < 1.0 && heading < 3.0, "{tilt}°, {heading}° for a field bent by 57°");
    assert!(refused > 1_400, "{refused} of 1500 refused");
    let (errors, refused) = carry(&mut hand, &mut filter, 10.0, true, EARTH, Vec3::zeros(), Vec3::zeros());
    assert!(errors[1] < 2.0 && refused < 200, "{errors:?}, {refused} refused afterwards");
}

#[test]
fn a_field_that_only_turns_is_not_followed_at_once() {
    // Strength and dip as before: only the sudden change reveals it.
    let (mut hand, mut filter) = (Hand::new(), started());
    carry(&mut hand, &mut filter, 30.0, true, EARTH, Vec3::zeros(), Vec3::zeros());
    let turned = Quat::from_euler_angles(0.0, 0.0, 0.5) * EARTH;
    let (errors, _) = carry(&mut hand, &mut filter, 5.0, true, turned, Vec3::zeros(), Vec3::zeros());
    assert!(errors[1] < 3.0, "{errors:?} for a field turned by 29°");
}

#[test]
fn another_place_is_told_from_drift_and_home_is_found_again() {
    let (mut hand, mut filter) = (Hand::new(), started());
    carry(&mut hand, &mut filter, 20.0, true, EARTH, Vec3::zeros(), Vec3::zeros());
    // 1.5 times as strong and turned by 50°, permanently: it becomes the reference, without its
    // direction.
    let elsewhere = Quat::from_euler_angles(0.0, 0.0, 0.9) * (EARTH * 1.5);
    let (errors, refused) = carry(&mut hand, &mut filter, 60.0, true, elsewhere, Vec3::zeros(), Vec3::zeros());
    assert!(errors[1] < 5.0, "{errors:?}");
    assert!((1_500..4_500).contains(&refused), "{refused} of 6000 until it was the reference");
    let (errors, refused) = carry(&mut hand, &mut filter, 10.0, true, EARTH, Vec3::zeros(), Vec3::zeros());
    assert!(errors[1] < 5.0 && refused < 200, "{errors:?}, {refused} refused at home");
}

#[test]
fn a_magnet_on_the_sensor_is_found_and_the_heading_with_it() {
    let magnet = Vec3::new(12.0, -8.0, 15.0);
    let (mut hand, mut filter) = (Hand::new(), AttitudeFilter::new(AttitudeConfig::default()));
    carry(&mut hand, &mut filter, 60.0, true, EARTH, magnet, Vec3::zeros());
    assert!((filter.hard_iron() - magnet).norm() < 2.0, "{:?}", filter.hard_iron());
    let (errors, _) = carry(&mut hand, &mut filter, 20.0, true, EARTH, magnet, Vec3::zeros());
    assert!(errors[0] < 1.0 && errors[1] < 5.0, "{errors:?}");
}

#[test]
fn without_magnets_no_hard_iron_is_found() {
    let (mut hand, mut filter) = (Hand::new(), started());
    carry(&mut hand, &mut filter, 60.0, true, EARTH, Vec3::zeros(), Vec3::zeros());
    assert_eq!(filter.hard_iron(), Vec3::zeros());
}

#[test]
fn delays_of_the_sensors_are_made_up_for() {
    // The sensors are 4 and 15 ms late. A turntable moves steadily enough for its angle to be known
    // exactly.
    let config = AttitudeConfig { inertial_delay: 0.004, mag_delay: 0.015, ..Default::default() };
    let heading_error = |config| {
        let mut filter = AttitudeFilter::from_calibration(config, &calibration());
        let rate = |time: f32| 4.0 * math::sin(time);
        let angle = |time: f32| 4.0 * (1.0 - math::cos(time));
        let mut worst = 0.0f32;
        for step in 1..4_000u16 {
            let time = f32::from(step) * DT;
            let gyro = Vec3::new(0.0, 0.0, rate((time - 0.5 * DT - 0.004).max(0.0)));
            filter.step(&Vec3::new(0.0, 0.0, -GRAVITY), &gyro, DT);
            let seen = frame::from_yaw(angle((time - 0.015).max(0.0))).inverse() * EARTH;
            _ = filter.field(&seen, 0.0, DT);
            let error = math::wrap_angle(frame::yaw(&filter.attitude()) - angle(time)).abs();
            worst = worst.max(error);
        }
        worst
    };
    let (known, ignored) = (heading_error(config), heading_error(AttitudeConfig::default()));
    assert!(known < 0.004 && ignored > 0.015, "{known} rad with delays known, {ignored} without");
}

#[test]
fn a_magnetometer_that_is_late_by_an_unknown_time_is_found_out() {
    for (delay, magnet) in
        [(0.0, Vec3::zeros()), (0.015, Vec3::zeros()), (0.03, Vec3::zeros()), (0.015, Vec3::new(6.0, -4.0, 5.0))]
    {
        let mut hand = Hand::new();
        let mut filter = AttitudeFilter::new(AttitudeConfig::default());
        let mut seen = std::collections::VecDeque::new();
        for step in 0..(90.0 / DT) as u32 {
            let (rate, force) = hand.step(true);
            filter.step(&force, &rate, DT);
            seen.push_back(hand.field(EARTH) + magnet);
            if seen.len() as f32 > delay / DT + 0.5 {
                let field = seen.pop_front().unwrap();
                if step % 2 == 0 {
                    _ = filter.field(&field, 0.0, 2.0 * DT);
                }
            }
        }
        let found = filter.mag_delay();
        println!("{delay} s: found {found}");
        assert!((found - delay).abs() < 0.003, "{found} s, not {delay}");
    }
}

#[test]
fn as_an_estimator_it_reports_validity_and_refusals() {
    let mut filter = AttitudeFilter::new(AttitudeConfig::default());
    let imu = ImuData { accel: Vec3::new(0.0, 0.0, -GRAVITY), ..Default::default() };
    let mag = MagData { field: EARTH };
    assert_eq!(filter.fuse_mag(Instant::from_micros(1), &mag), Fusion::Refused(Refusal::NotInitialized));
    assert_eq!(filter.estimate().valid, Validity::NONE);
    filter.initialize(Instant::from_micros(1_000), &calibration());
    let mut at = Instant::from_micros(1_000);
    for _ in 0..800 {
        at += Duration::from_micros(5_000);
        filter.predict(at, &imu);
        assert!(!matches!(filter.fuse_mag(at, &mag), Fusion::Refused(_)));
    }
    let not_used = Fusion::Refused(Refusal::NotUsed);
    assert_eq!(filter.fuse_tof(at, &TofData::default()), not_used);
    assert_eq!(filter.fuse_flow(at, &FlowData::default()), not_used);
    assert_eq!(filter.fuse_baro(at, &BaroData::default()), not_used);
    assert_eq!(filter.fuse_velocity(at, &Vec3::zeros(), &Vec3::new(0.1, 0.1, 0.1)), not_used);
    let estimate = filter.estimate();
    assert_eq!(estimate.valid, Validity::NONE.set(Validity::TILT | Validity::HEADING, true));
    assert!(estimate.sensors.contains(SensorMask::MAG) && estimate.sensors.contains(SensorMask::STATIONARY));
    assert_eq!((estimate.position, estimate.velocity), (Vec3::zeros(), Vec3::zeros()));
    assert!(filter.status().offered[3] == 800 && filter.status().refused[3] < 150, "{:?}", filter.status());

    // Repeated, too late, far in the future, NaN.
    let stale = Fusion::Refused(Refusal::Stale);
    assert_eq!(filter.fuse_mag(at, &mag), Fusion::Refused(Refusal::Repeated));
    assert_eq!(filter.fuse_mag(at + Duration::from_secs(5), &mag), Fusion::Refused(Refusal::Future));
    let later = at + Duration::from_secs(1);
    filter.predict(later, &imu);
    assert_eq!(filter.fuse_mag(later - Duration::from_micros(200_000), &mag), stale);
    let broken = MagData { field: Vec3::new(f32::NAN, 0.0, 0.0) };
    assert_eq!(filter.fuse_mag(later, &broken), Fusion::Refused(Refusal::NotFinite));
    assert_eq!(filter.fuse_mag(later, &MagData { field: Vec3::new(1e9, 0.0, 0.0) }), Fusion::Refused(Refusal::Range));
    assert!(filter.fuse_mag(later, &mag).is_fused(), "the others left no trace");

    let before = filter.clone();
    filter.predict(later, &imu);
    filter.predict(Instant::from_micros(7), &imu);
    assert_eq!(before, filter, "an inertial sample that was there already");
    filter.command(later, &EstimatorCommand { full_resets: 1, ..Default::default() });
    assert_eq!(filter.status().offered, [0; 5]);
}

#[test]
fn a_magnetometer_that_falls_silent_costs_no_tilt_and_as_much_heading_as_it_says() {
    let mut filter = AttitudeFilter::new(AttitudeConfig::default());
    let mut hand = Hand::new();
    filter.initialize(Instant::ZERO, &CalibrationResult { complete: false, field: Vec3::zeros(), ..calibration() });
    let mut at = Instant::ZERO;
    for step in 0..200 * 300 {
        let (gyro, accel) = hand.step(true);
        at += Duration::from_micros(5_000);
        filter.predict(at, &ImuData { accel, gyro, temperature: 25.0, ..Default::default() });
        if step < 4_000 {
            let field = hand.field(EARTH);
            _ = filter.fuse_mag(at, &MagData { field });
        }
        if step == 10 {
            assert!(!filter.estimate().valid.contains(Validity::HEADING), "one look at an unknown field");
        }
        if step == 4_000 {
            assert!(filter.estimate().valid.contains(Validity::HEADING));
            assert!(filter.heading_sigma() < 0.07, "{}", filter.heading_sigma());
        }
    }
    assert!(filter.estimate().valid.contains(Validity::TILT) && !filter.estimate().sensors.contains(SensorMask::MAG));
    let [tilt, heading] = hand.errors(&filter.attitude());
    let sigma = filter.heading_sigma().to_degrees();
    assert!(tilt < 1.5 && heading < 3.0 * sigma && sigma > 5.0, "{tilt}°, {heading}° of {sigma}°");
}

#[test]
fn how_large_they_are() {
    assert!(size_of::<AttitudeFilter>() <= 1_320, "{} bytes", size_of::<AttitudeFilter>());
    assert!(size_of::<Mahony>() <= 20, "{} bytes", size_of::<Mahony>());
}

/// Any number, invalid ones more often than in reality.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => -50.0f32..50.0,
        2 => any::<f32>(),
        1 => prop::sample::select(vec![0.0, -0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e-40]),
    ]
}

fn any_vector() -> impl Strategy<Value = Vec3> {
    (number(), number(), number()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

/// A plausible bias or an impossible one.
fn calibrated_bias() -> impl Strategy<Value = Vec3> {
    let axis = || prop_oneof![5 => -0.03f32..0.03, 1 => Just(f32::NAN), 1 => Just(f32::MAX), 1 => Just(-42.0)];
    (axis(), axis(), axis()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

fn is_unit(attitude: &Quat) -> bool {
    (attitude.norm_squared() - 1.0).abs() < 2e-4
}

proptest! {
    #[test]
    fn any_input_is_harmless(
        inputs in prop::collection::vec((any_vector(), any_vector(), any_vector(), number(), number()), 1..80),
        calibration in (calibrated_bias(), any_vector(), any_vector(), any::<bool>()),
    ) {
        let (gyro_bias, specific_force, field, complete) = calibration;
        let calibration = CalibrationResult { gyro_bias, specific_force, field, complete, ..Default::default() };
        let mut filter = AttitudeFilter::from_calibration(AttitudeConfig::default(), &calibration);
        let mut mahony = Mahony::new(0.5);
        for (accel, gyro, field, dt, age) in &inputs {
            filter.step(accel, gyro, *dt);
            _ = filter.field(field, *age, *dt);
            mahony.step(accel, gyro, *dt);
            prop_assert!(is_unit(&filter.attitude()), "{:?}", filter.attitude());
            prop_assert!(is_unit(&mahony.attitude()), "{:?}", mahony.attitude());
        }
        // The effect is not permanent: after a minute of rest the tilt is right.
        let still = Vec3::new(0.0, 0.0, -GRAVITY);
        for _ in 0..6_000 {
            filter.step(&still, &Vec3::zeros(), 0.01);
            mahony.step(&still, &Vec3::zeros(), 0.01);
        }
        prop_assert!(frame::tilt(&filter.attitude()) < 0.02, "{} rad", frame::tilt(&filter.attitude()));
        prop_assert!(frame::tilt(&mahony.attitude()) < 0.02 || mahony.attitude().wxyz()[0].abs() < 1e-3);
        prop_assert!(filter.gyro_bias().iter().all(|v| v.is_finite()) && filter.hard_iron().norm().is_finite());
    }

    #[test]
    fn any_stamps_are_harmless(stamps in prop::collection::vec((any::<u64>(), any::<u64>(), any::<bool>()), 1..60)) {
        let mut filter = AttitudeFilter::new(AttitudeConfig::default());
        filter.initialize(Instant::ZERO, &calibration());
        let imu = ImuData { accel: Vec3::new(0.0, 0.5, -GRAVITY), gyro: Vec3::new(0.1, 0.0, 1.0), temperature: 25.0, ..Default::default() };
        for (imu_at, mag_at, near) in stamps {
            // Half of them close together, the others anywhere.
            let [imu_at, mag_at] = [imu_at, mag_at].map(|at| Instant::from_micros(if near { at % 1_000_000 } else { at }));
            filter.predict(imu_at, &imu);
            _ = filter.fuse_mag(mag_at, &MagData { field: EARTH });
            prop_assert!(is_unit(&filter.estimate().attitude));
        }
    }

    /// The same motion in a rotated room and without a field: the tilt is the same.
    #[test]
    fn tilt_owes_nothing_to_the_field(turn in -3.0f32..3.0, strength in 0.1f32..3.0) {
        let run = |field: Option<Vec3>| {
            let (mut hand, mut filter) = (Hand::new(), AttitudeFilter::new(AttitudeConfig {
                // The field reaches the tilt only through the vertical gyro bias.
                mag_bias_sigma: 1e3, ..Default::default()
            }));
            for _ in 0..1_000 {
                let (rate, force) = hand.step(true);
                filter.step(&force, &rate, DT);
                if let Some(field) = field {
                    let seen = hand.attitude.inverse() * field;
                    _ = filter.field(&seen, 0.0, DT);
                }
            }
            filter.attitude().inverse() * Vec3::z()
        };
        let field = Quat::from_euler_angles(0.0, 0.0, turn) * EARTH * strength;
        let apart = (run(Some(field)) - run(None)).amax();
        prop_assert!(apart < 1e-4, "{apart}");
    }

    /// The heading is relative to the field: in a rotated room it rotates, too. Not exactly: the
    /// field dips steeply, so a tilt error turns its horizontal part by almost three times as much,
    /// in the opposite direction in a rotated room.
    #[test]
    fn heading_follows_the_room(turn in -3.0f32..3.0) {
        let run = |turn: f32| {
            let (mut hand, mut filter) = (Hand::new(), AttitudeFilter::new(AttitudeConfig::default()));
            let field = Quat::from_euler_angles(0.0, 0.0, turn) * EARTH;
            for _ in 0..2_000 {
                let (rate, force) = hand.step(true);
                filter.step(&force, &rate, DT);
                let seen = hand.attitude.inverse() * field;
                _ = filter.field(&seen, 0.0, DT);
            }
            filter.attitude()
        };
        let (turned, plain) = (run(turn), run(0.0));
        let apart = turned * plain.inverse();
        prop_assert!(math::wrap_angle(frame::yaw(&apart) + turn).abs() < 0.12, "{apart:?}");
        prop_assert!(frame::tilt(&apart) < 0.01);
    }

    /// A dropped sample has hardly any effect, because the step is then longer.
    #[test]
    fn dropped_samples_are_bridged(seed in any::<u64>()) {
        let mut drops = ChaCha8Rng::seed_from_u64(seed);
        let (mut hand, mut filter) = (Hand::new(), started());
        let mut since = 0.0;
        for _ in 0..6_000 {
            let (rate, force) = hand.step(true);
            since += DT;
            if drops.random_bool(0.9) {
                filter.step(&force, &rate, since);
                _ = filter.field(&(hand.attitude.inverse() * EARTH), 0.0, since);
                since = 0.0;
            }
        }
        let errors = hand.errors(&filter.attitude());
        prop_assert!(errors[0] < 1.5 && errors[1] < 1.5, "{errors:?}");
    }
}
