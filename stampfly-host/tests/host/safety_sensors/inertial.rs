//! An inertial sensor that does not measure.

use super::*;

/// The death of an inertial sensor that goes on delivering: name, what it does to a sample, and the longest time until the
/// motors stop, ms.
type Death = (&'static str, Box<dyn FnMut(f32, &mut ImuData)>, u64);

fn deaths() -> Vec<Death> {
    let mut held: Option<ImuData> = None;
    let mut gyro: Option<Vec3> = None;
    vec![
        ("stuck", Box::new(move |_, imu: &mut ImuData| *imu = *held.get_or_insert(*imu)), 60),
        ("gyro stuck", Box::new(move |_, imu: &mut ImuData| imu.gyro = *gyro.get_or_insert(imu.gyro)), 60),
        ("gyro zero", Box::new(|_, imu: &mut ImuData| imu.gyro = Vec3::zeros()), 60),
        ("all zero", Box::new(|_, imu: &mut ImuData| (imu.accel, imu.gyro) = (Vec3::zeros(), Vec3::zeros())), 60),
        ("not finite", Box::new(|_, imu: &mut ImuData| imu.gyro.x = f32::NAN), 55),
        ("full scale", Box::new(|_, imu: &mut ImuData| imu.gyro = Vec3::repeat(-34.9)), 25),
    ]
}

#[test]
fn d7_an_inertial_sensor_that_dies_but_goes_on_delivering_stops_the_motors() {
    use FlightPhase::{Flying, Landing, TakeOff};
    for (k, phase) in [Flying, TakeOff, Landing, Flying].into_iter().enumerate().take(thorough(3, 4)) {
        for (what, lie, limit) in deaths() {
            let lies = Lies { imu: Some(lie), ..Lies::default() };
            let seconds = if phase == Landing { 30.0 } else { 14.0 };
            let (seen, since) = fly(k as u64 + 1, seconds, Onset::After(phase, 0.3), lies);
            let took = seen.motors_off_after(since);
            assert!(took <= Duration::from_millis(limit), "{what} in {phase:?}: {took}");
        }
    }
}

/// An accelerometer that dies while the gyro measures: name, and what it does to a sample.
type AccelDeath = (&'static str, Box<dyn FnMut(f32, &mut ImuData)>);

/// Not one axis at full scale: that is a blow from the side.
fn accel_deaths() -> [AccelDeath; 3] {
    let mut held: Option<Vec3> = None;
    [
        ("accel stuck", Box::new(move |_, imu: &mut ImuData| imu.accel = *held.get_or_insert(imu.accel))),
        ("accel zero", Box::new(|_, imu: &mut ImuData| imu.accel = Vec3::zeros())),
        ("one axis of the accel", Box::new(|_, imu: &mut ImuData| imu.accel.x = 0.0)),
    ]
}

#[test]
fn a_vehicle_whose_accelerometer_dies_lands_upright() {
    use FlightPhase::{Flying, Landing, TakeOff};
    for seed in seeds() {
        for (phase, after) in [(Flying, 2.0), (TakeOff, 0.4), (Landing, 0.1)] {
            for (what, lie) in accel_deaths() {
                let lies = Lies { imu: Some(lie), ..Lies::default() };
                let (seen, since) = fly(seed, 40.0, Onset::After(phase, after), lies);
                let what = format!("{what} in {phase:?}, seed {seed}");
                let (drift, highest) = (seen.drift(since, Instant::MAX), seen.highest(since));
                println!("{what}: {drift:.2} m, {highest:.2} m");
                let cut = seen.alerts.iter().any(|(_, alerts)| alerts.intersects(stampfly_mode::decision::CUT));
                assert!(!cut, "{what}: {:?}", seen.alerts);
                assert!(drift < 1.0 && highest < 0.9, "{what}: {drift} m, {highest} m");
                assert!(!seen.end().0.armed && seen.end().1.contact, "{what}: it has landed");
            }
        }
    }
}

#[test]
fn d7_an_inertial_sensor_dead_at_power_on_never_arms() {
    for (what, lie) in deaths().into_iter().map(|(what, lie, _)| (what, lie)).chain(accel_deaths()) {
        let (seen, _) = fly(1, 12.0, Onset::PowerOn, Lies { imu: Some(lie), ..Lies::default() });
        assert!(seen.modes.iter().all(|(_, mode)| !mode.armed), "{what}");
    }
}

#[test]
fn d21_two_garbled_samples_are_flown_through() {
    let garbage = [
        ImuData { accel: Vec3::repeat(-78.45), gyro: Vec3::repeat(-34.9), temperature: 25.0, ..Default::default() },
        ImuData {
            accel: Vec3::new(40.0, -75.0, 60.0),
            gyro: Vec3::new(-30.0, 12.0, 25.0),
            temperature: 25.0,
            ..Default::default()
        },
    ];
    for seed in seeds() {
        for broken in garbage {
            let mut count = 0;
            let lie = move |_: f32, imu: &mut ImuData| {
                // Two of every hundred.
                count += 1;
                if count % 100 < 2 {
                    *imu = broken;
                }
            };
            let lies = Lies { imu: Some(Box::new(lie)), ..Lies::default() };
            let (seen, since) = fly(seed, 35.0, Onset::After(FlightPhase::Flying, 0.5), lies);
            let cut = Alerts::IMPACT | Alerts::GYRO_ANOMALY | Alerts::IMU_FAULTY | Alerts::TUMBLED;
            assert!(seen.alerts.iter().all(|(_, alerts)| !alerts.intersects(cut)), "seed {seed}");
            let landing = seen.entered(FlightPhase::Landing, since).expect("it lands");
            assert!(seen.entered(FlightPhase::IdleGround, landing).is_some() && seen.end().1.contact, "seed {seed}");
            assert!(seen.drift(since, Instant::MAX) < 1.0, "seed {seed}");
        }
    }
}

#[test]
fn a_gyro_whose_zero_jumps_is_flown_on_with() {
    use FlightPhase::{Flying, Landing, TakeOff};
    for seed in seeds() {
        for (phase, after) in [(Flying, 2.0), (TakeOff, 0.0), (Landing, 0.1)] {
            for jump in [1.0, -2.0] {
                let lie: Box<dyn FnMut(f32, &mut ImuData)> = Box::new(move |_, imu| imu.gyro.x += jump);
                let lies = Lies { imu: Some(lie), ..Lies::default() };
                let (seen, since) = fly(seed, 40.0, Onset::After(phase, after), lies);
                let what = format!("{jump} rad/s in {phase:?}, seed {seed}");
                let (drift, highest) = (seen.drift(since, Instant::MAX), seen.highest(since));
                println!("{what}: {drift:.2} m, {highest:.2} m");
                assert!(drift < 0.6 && highest < 0.8, "{what}: {drift} m, {highest} m");
                assert!(!seen.end().0.armed && seen.end().1.contact, "{what}: it has landed");
            }
        }
    }
}

/// Nothing lands it well: its attitude is wrong by half of every turn, and how far it slides before it
/// touches depends on how it leans by then. But it does not fly on.
#[test]
fn an_inertial_sensor_of_half_the_scale_ends_the_flight() {
    for seed in seeds() {
        for scale in [0.3, 0.4, 0.5] {
            let lie: Box<dyn FnMut(f32, &mut ImuData)> = Box::new(move |_, imu| {
                imu.accel *= scale;
                imu.gyro *= scale;
            });
            let lies = Lies { imu: Some(lie), ..Lies::default() };
            let (seen, since) = fly(seed, 30.0, Onset::After(FlightPhase::Flying, 1.0), lies);
            let (took, drift) = (seen.motors_off_after(since), seen.drift(since, Instant::MAX));
            let highest = seen.highest(since);
            println!("{scale}, seed {seed}: {took}, {drift:.2} m, {highest:.2} m");
            assert!(took <= Duration::from_secs(8), "{scale}, seed {seed}: {took}");
            assert!(highest < 1.5, "{scale}, seed {seed}: {highest} m");
        }
    }
}
