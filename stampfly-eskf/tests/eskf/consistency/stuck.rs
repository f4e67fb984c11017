//! Typical sensor faults: their effect is bounded and reported.

use super::flight::{Flight, is_sound};
use stampfly_eskf::{Eskf, EskfConfig, Estimator, Fusion, Refusal};
use stampfly_types::messages::{FlowData, ImuData, MagData, TofData, Validity};
use stampfly_types::{Instant, Vec3};

/// Fault of a sample.
#[derive(Clone, Copy)]
struct Broken {
    imu: fn(ImuData) -> ImuData,
    tof: fn(TofData) -> TofData,
    flow: fn(FlowData) -> FlowData,
}

const SOUND: Broken = Broken { imu: |v| v, tof: |v| v, flow: |v| v };

/// Eight seconds of flight, then `seconds` with these sensors. Returns the filter and its errors at
/// the end.
fn fly(broken: Broken, seconds: u64, mut told: impl FnMut(Fusion)) -> (Eskf, [f64; 3]) {
    let mut flight = Flight::new(Instant::from_secs(10), 9);
    let mut eskf = Eskf::new(EskfConfig::default());
    eskf.initialize(flight.start, &flight.calibration());
    for step in 1..=3_200 {
        flight.feed(&mut eskf, step);
    }
    let last = 3_200 + 400 * seconds;
    for step in 3_201..=last {
        let at = flight.at(step);
        eskf.predict(at, &(broken.imu)(flight.imu(at)));
        if step % 13 == 0 {
            told(eskf.fuse_tof(at, &(broken.tof)(flight.tof(at))));
        }
        if step % 4 == 0 {
            told(eskf.fuse_flow(at, &(broken.flow)(flight.flow(at))));
        }
        if step % 8 == 0 {
            _ = eskf.fuse_baro(at, &flight.baro(at));
        }
        assert!(is_sound(&eskf) || step % 50 != 0, "step {step}");
    }
    let errors = flight.errors(&eskf, flight.at(last));
    (eskf, errors)
}

#[test]
fn a_stuck_range_moves_the_height_no_farther_than_itself() {
    // The vehicle moves up and down by 10 cm; the range stays constant.
    let tof = |tof: TofData| TofData { distance: 2.0, ..tof };
    let (_, [tilt, velocity, height]) = fly(Broken { tof, ..SOUND }, 30, |_| {});
    assert!(tilt < 0.05 && velocity < 0.3 && height < 0.15, "{tilt} rad, {velocity} m/s, {height} m");
}

#[test]
fn a_range_that_is_said_to_be_none_is_no_range() {
    for (distance, valid, reason) in
        [(0.0, true, Refusal::Range), (9.0, true, Refusal::Range), (2.0, false, Refusal::Quality)]
    {
        let mut flight = Flight::new(Instant::from_secs(10), 9);
        let mut eskf = Eskf::new(EskfConfig::default());
        eskf.initialize(flight.start, &flight.calibration());
        for step in 1..=400 {
            flight.feed(&mut eskf, step);
        }
        let told = eskf.fuse_tof(flight.at(400), &TofData { distance, valid, ..TofData::default() });
        assert_eq!(told, Fusion::Refused(reason), "{distance} m");
    }
}

#[test]
fn flow_of_low_quality_is_refused_and_velocity_becomes_invalid() {
    let flow = |flow: FlowData| FlowData { delta_x: 0.0, delta_y: 0.0, quality: 10, ..flow };
    let mut refused = 0;
    let (eskf, _) = fly(Broken { flow, ..SOUND }, 3, |told| {
        refused += u32::from(told == Fusion::Refused(Refusal::Quality));
    });
    assert_eq!(refused, 300, "all of it");
    let valid = eskf.estimate().valid;
    assert!(!valid.contains(Validity::VELOCITY_XY) && !valid.contains(Validity::POSITION_XY));
    assert!(valid.contains(Validity::HEIGHT | Validity::TILT), "the rest goes on");
}

#[test]
fn stuck_flow_of_good_quality_does_bounded_harm() {
    // A sensor reports "no motion" as valid while the vehicle swings at 0.5 m/s. No other sensor
    // measures velocity, so the state is reset to it. That affects the velocity and must not affect
    // the tilt.
    let flow = |flow: FlowData| FlowData { delta_x: 0.0, delta_y: 0.0, ..flow };
    let (eskf, [tilt, velocity, height]) = fly(Broken { flow, ..SOUND }, 30, |_| {});
    let reported = eskf.status().diverged || eskf.status().resets > 0;
    assert!(reported || tilt < 0.2 && velocity < 1.2, "{tilt} rad, {velocity} m/s");
    assert!(height < 0.1, "{height} m");
}

#[test]
fn a_gyro_of_nothing_but_zeros_is_harmless() {
    let imu = |imu: ImuData| ImuData { gyro: Vec3::zeros(), ..imu };
    let (eskf, [tilt, _, height]) = fly(Broken { imu, ..SOUND }, 20, |_| {});
    assert!(tilt < 0.3 || eskf.status().diverged, "{tilt} rad");
    assert!(height < 0.1, "{height} m");
}

#[test]
fn a_clipping_accelerometer_does_not_carry_the_height_away() {
    // Vibration beyond the range: the downward half is clipped, and the mean is 1.5 m/s² too small.
    let imu = |imu: ImuData| ImuData { accel: Vec3::new(imu.accel.x, imu.accel.y, imu.accel.z.max(-9.0) + 0.7), ..imu };
    let (eskf, [tilt, velocity, height]) = fly(Broken { imu, ..SOUND }, 20, |_| {});
    assert!(!eskf.status().diverged);
    assert!(tilt < 0.05 && velocity < 0.3 && height < 0.1, "{tilt} rad, {velocity} m/s, {height} m");
}

#[test]
fn a_bent_field_costs_little_tilt() {
    let mut flight = Flight::new(Instant::from_secs(10), 9);
    let mut eskf = Eskf::new(EskfConfig { mag_enable: true, ..EskfConfig::default() });
    eskf.initialize(flight.start, &flight.calibration());
    let (mut gated, mut worst) = (0, 0.0f64);
    for step in 1..=400 * 20u64 {
        if step % 16 != 0 {
            flight.feed(&mut eskf, step);
            continue;
        }
        let at = flight.at(step);
        let imu = flight.imu(at);
        eskf.predict(at, &imu);
        _ = eskf.fuse_flow(at, &flight.flow(at));
        // The motor current distorts it by up to twice its strength, on and off.
        let bend = if step / 800 % 2 == 1 { Vec3::new(-50.0, 70.0, 0.0) } else { Vec3::zeros() };
        let told = eskf.fuse_mag(at, &MagData { field: flight.mag(at).field + bend });
        gated += u32::from(matches!(told, Fusion::Gated { .. } | Fusion::Refused(_)));
        let [tilt, ..] = flight.errors(&eskf, at);
        worst = worst.max(tilt);
        assert!(tilt < 0.25, "{tilt} rad after {step} steps");
    }
    assert!(gated > 50 && is_sound(&eskf), "{gated} fields turned down, {worst} rad at worst");
}
