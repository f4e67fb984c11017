//! Restarts in flight, and corrupt inertial samples.

use super::flight::{Flight, is_sound};
use stampfly_eskf::{Eskf, EskfConfig, Estimator};
use stampfly_types::messages::{EstimatorCommand, ImuData, Validity};
use stampfly_types::{Instant, Vec3};

fn flown(seconds: u64, seed: u64) -> (Flight, Eskf) {
    flown_with(EskfConfig::default(), seconds, seed)
}

fn flown_with(config: EskfConfig, seconds: u64, seed: u64) -> (Flight, Eskf) {
    let mut flight = Flight::new(Instant::from_secs(10), seed);
    flight.gyro_bias = Vec3::new(0.004, -0.003, 0.002);
    let mut eskf = Eskf::new(config);
    eskf.initialize(flight.start, &flight.calibration());
    for step in 1..=400 * seconds {
        flight.feed(&mut eskf, step);
    }
    (flight, eskf)
}

#[test]
fn b1_a_reset_in_flight_keeps_attitude_heading_and_biases() {
    for seed in 0..8 {
        let (mut flight, mut eskf) = flown(8, seed);
        let at = flight.at(3_200);
        let before = eskf.estimate();
        let reset = EstimatorCommand { full_resets: 1, on_ground: false, ..EstimatorCommand::default() };
        eskf.command(at, &reset);
        let after = eskf.estimate();
        assert_eq!(after.attitude, before.attitude);
        assert_eq!((after.gyro_bias, after.accel_bias), (before.gyro_bias, before.accel_bias));
        assert_eq!(after.velocity, Vec3::zeros());
        assert!(!after.valid.intersects(Validity::VELOCITY_XY | Validity::VELOCITY_Z | Validity::HEIGHT));
        let mut settled = 0;
        for step in 3_201..=4_000 {
            flight.feed(&mut eskf, step);
            let [tilt, velocity, height] = flight.errors(&eskf, flight.at(step));
            assert!(tilt < 0.1, "seed {seed}: {tilt} rad after {} steps", step - 3_200);
            settled = if velocity < 0.3 && height < 0.1 { settled + 1 } else { 0 };
            assert!(is_sound(&eskf) || step % 50 != 0);
        }
        assert!(settled > 400, "seed {seed}: right again within a second, since {settled} steps");
    }
}

/// Bit for bit: the text form of a number is unique, including the sign of zero.
#[test]
fn a_filter_that_begins_again_in_its_place_is_a_new_one_bit_for_bit() {
    let indoors = EskfConfig::indoors();
    let configs = [
        EskfConfig::default(),
        indoors,
        EskfConfig::outdoors(),
        EskfConfig { gate: 4.0, horizon: 0.5, gyro_noise: 0.01, ..indoors },
    ];
    for (seed, [before, after]) in
        (0..).zip(configs.iter().flat_map(|one| configs.iter().map(move |other| [one, other])))
    {
        let (mut flight, mut eskf) = flown_with(*before, 3, seed);
        let (mut told, mut new) = (eskf.clone(), Eskf::new(*after));
        told.begin_again(after);
        assert_eq!(format!("{told:?}"), format!("{new:?}"), "{seed}");
        // And it flies like one.
        for filter in [&mut told, &mut new] {
            filter.initialize(flight.at(1_200), &flight.calibration());
        }
        let mut same = flight.clone();
        for step in 1_201..=2_000 {
            flight.feed(&mut told, step);
            same.feed(&mut new, step);
        }
        assert_eq!(format!("{told:?}"), format!("{new:?}"), "{seed}");
        // Control: a filter that was not restarted differs.
        flight.feed(&mut eskf, 2_001);
        assert_ne!(format!("{eskf:?}"), format!("{new:?}"), "{seed}");
    }
}

#[test]
fn a_reset_on_the_ground_starts_from_the_calibration() {
    let (flight, mut eskf) = flown(8, 1);
    eskf.command(
        flight.at(3_200),
        &EstimatorCommand { full_resets: 1, on_ground: true, ..EstimatorCommand::default() },
    );
    assert_eq!(eskf.estimate().gyro_bias, flight.calibration().gyro_bias);
}

#[test]
fn a_velocity_beyond_any_flight_is_divergence_without_flow_too() {
    let (mut flight, mut eskf) = flown_with(EskfConfig { max_velocity: 50.0, ..EskfConfig::default() }, 2, 1);
    let mut told = None;
    // The accelerometer is dead, and no other sensor measures.
    for step in 801..=4_800 {
        let at = flight.at(step);
        eskf.predict(at, &ImuData { accel: Vec3::zeros(), ..flight.imu(at) });
        if eskf.status().diverged {
            told.get_or_insert(step - 800);
        }
    }
    assert!(told.is_some_and(|steps| steps < 2_400), "{told:?}");
}

#[test]
fn d21_garbage_of_up_to_three_samples_is_bridged_and_counted() {
    let garbage = [
        ImuData { accel: Vec3::repeat(-78.45), gyro: Vec3::repeat(-34.9), temperature: 25.0, ..Default::default() },
        ImuData {
            accel: Vec3::new(30.0, -70.0, 12.0),
            gyro: Vec3::new(20.0, -3.0, 33.0),
            temperature: 25.0,
            ..Default::default()
        },
        ImuData { accel: Vec3::repeat(78.4), gyro: Vec3::zeros(), temperature: 25.0, ..Default::default() },
        ImuData { accel: Vec3::repeat(f32::NAN), gyro: Vec3::zeros(), temperature: 25.0, ..Default::default() },
    ];
    for broken in garbage {
        for length in 1..=3 {
            let (mut flight, mut eskf) = flown(8, 3);
            let [tilt_before, velocity_before, _] = flight.errors(&eskf, flight.at(3_200));
            for step in 3_201..=3_200 + length {
                eskf.predict(flight.at(step), &broken);
            }
            flight.feed(&mut eskf, 3_201 + length);
            let [tilt, velocity, _] = flight.errors(&eskf, flight.at(3_201 + length));
            assert!(tilt < tilt_before + 0.01 && velocity < velocity_before + 0.1, "{broken:?}: {tilt} {velocity}");
            assert_eq!(u64::from(eskf.status().imu_refused), length, "{broken:?}");
        }
    }
    let (_, eskf) = flown(8, 3);
    assert_eq!(eskf.status().imu_refused, 0);
}
