//! Wrong time stamps are harmless: late, swapped, repeated and future measurements, steps of any
//! length, any clock value.

use super::flight::{Flight, STEP, is_sound};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Uniform};
use stampfly_eskf::{Eskf, EskfConfig, Estimator, Fusion, Refusal};
use stampfly_types::messages::{FlowData, ImuData, MagData, TofData};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

fn started(flight: &Flight) -> Eskf {
    let mut eskf = Eskf::new(EskfConfig { mag_enable: true, ..EskfConfig::default() });
    eskf.initialize(flight.start, &flight.calibration());
    eskf
}

/// Ten seconds of flight from a start of the clock; the estimate must be good at the end.
fn fly(start: Instant) -> Eskf {
    let mut flight = Flight::new(start, 5);
    let mut eskf = started(&flight);
    for step in 1..=4_000 {
        flight.feed(&mut eskf, step);
    }
    let [tilt, velocity, height] = flight.errors(&eskf, flight.at(4_000));
    assert!(tilt < 0.05 && velocity < 0.15 && height < 0.03, "{start}: {tilt} rad, {velocity} m/s, {height} m");
    assert!(is_sound(&eskf) && !eskf.status().diverged);
    eskf
}

#[test]
fn the_clock_may_begin_anywhere() {
    let usual = fly(Instant::from_secs(10));
    // Two seconds before 32 bits of microseconds overflow, and beyond the 53 bits of a double.
    for start in [(1 << 32) - 2_000_000, (1 << 53) + 1, u64::MAX - 3_600_000_000] {
        let other = fly(Instant::from_micros(start));
        assert_eq!(usual.nominal(), other.nominal(), "{start}");
        assert_eq!(usual.covariance(), other.covariance(), "{start}");
    }
}

#[test]
fn late_measurements_do_as_well_as_those_on_time() {
    // Every measurement on time, and every one up to 80 ms late with correct stamps. Flow itself is
    // 9 ms old.
    let run = |most: u64| {
        let mut flight = Flight::new(Instant::from_secs(10), 7);
        let mut eskf = started(&flight);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let delays = Uniform::new_inclusive(0, most).expect("a range");
        // Sorted by due step, then by stamp: the samples of one sensor arrive in order.
        let mut tofs: Vec<(u64, Instant, TofData)> = Vec::new();
        let mut flows: Vec<(u64, Instant, FlowData)> = Vec::new();
        let (mut refused, mut squares) = (0, [0.0; 3]);
        for step in 1..=8_000u64 {
            let at = flight.at(step);
            let imu = flight.imu(at);
            eskf.predict(at, &imu);
            let after = |last: Option<u64>, delay: u64| (step + delay).max(last.unwrap_or(0));
            if step.is_multiple_of(13) {
                let due = after(tofs.last().map(|s| s.0), delays.sample(&mut random));
                tofs.push((due, at, flight.tof(at)));
            }
            if step.is_multiple_of(4) {
                let due = after(flows.last().map(|s| s.0), delays.sample(&mut random));
                flows.push((due, at, flight.flow(at)));
            }
            let arrived = |due: u64| due <= step;
            while tofs.first().is_some_and(|s| arrived(s.0)) {
                let (_, at, tof) = tofs.remove(0);
                refused += u32::from(matches!(eskf.fuse_tof(at, &tof), Fusion::Refused(_)));
            }
            while flows.first().is_some_and(|s| arrived(s.0)) {
                let (_, at, flow) = flows.remove(0);
                refused += u32::from(matches!(eskf.fuse_flow(at, &flow), Fusion::Refused(_)));
            }
            if step > 2_000 {
                for (sum, error) in squares.iter_mut().zip(flight.errors(&eskf, at)) {
                    *sum += error * error / 6_000.0;
                }
            }
        }
        assert!(is_sound(&eskf) && eskf.status().resets == 0);
        (squares.map(f64::sqrt), refused)
    };
    let (prompt, refused) = run(0);
    assert!(refused < 10, "{refused}: only before there is a past or a height");
    let (late, refused) = run(32);
    assert!(refused < 25, "{refused}");
    for ((prompt, late), least) in prompt.into_iter().zip(late).zip([0.005, 0.02, 0.005]) {
        assert!(late < 1.6 * prompt + least, "{prompt} on time, {late} late");
    }
}

#[test]
fn what_cannot_be_placed_is_refused_with_a_reason() {
    let mut flight = Flight::new(Instant::from_secs(10), 7);
    let mut eskf = started(&flight);
    for step in 1..=400 {
        flight.feed(&mut eskf, step);
    }
    let now = flight.at(401);
    eskf.predict(now, &flight.imu(now));
    let before = (*eskf.nominal(), *eskf.covariance());
    let mut tof = |at: Instant| {
        let range = flight.tof(at);
        eskf.fuse_tof(at, &range)
    };
    let millis = Duration::from_millis;
    assert_eq!(tof(now - millis(101)), Fusion::Refused(Refusal::Stale));
    assert_eq!(tof(now + millis(21)), Fusion::Refused(Refusal::Future));
    assert_eq!(tof(Instant::MAX), Fusion::Refused(Refusal::Future));
    assert_eq!(tof(Instant::ZERO), Fusion::Refused(Refusal::Stale));
    // Step 390 had the last one: that stamp and older ones are repeated.
    let last = now - STEP * 11;
    assert_eq!(tof(last), Fusion::Refused(Refusal::Repeated));
    assert_eq!(tof(last - Duration::from_micros(1)), Fusion::Refused(Refusal::Repeated));
    assert_eq!((*eskf.nominal(), *eskf.covariance()), before, "a refusal changes nothing");
    let range = flight.tof(now);
    assert!(eskf.fuse_tof(now, &range).is_fused());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(30))]
    /// Stamps of −1 to +20 ms relative to the inertial sensor, in any order between the sensors.
    #[test]
    fn stamps_around_the_present_are_harmless(seed: u64) {
        let mut flight = Flight::new(Instant::from_secs(10), seed);
        let mut eskf = started(&flight);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let offsets = Uniform::new_inclusive(0u64, 21_000).expect("a range");
        for step in 1..=2_000u64 {
            let now = flight.at(step);
            let mut stamp = || Instant::from_micros(now.as_micros() + offsets.sample(&mut random) - 1_000);
            let (a, b, c) = (stamp(), stamp(), stamp());
            if step % 4 == 0 {
                let flow = flight.flow(a);
                _ = eskf.fuse_flow(a, &flow);
            }
            let imu = flight.imu(now);
            eskf.predict(now, &imu);
            if step % 13 == 0 {
                let tof = flight.tof(b);
                _ = eskf.fuse_tof(b, &tof);
            }
            if step % 8 == 0 {
                let baro = flight.baro(c);
                _ = eskf.fuse_baro(c, &baro);
            }
        }
        let [tilt, velocity, height] = flight.errors(&eskf, flight.at(2_000));
        prop_assert!(is_sound(&eskf) && !eskf.status().diverged);
        prop_assert!(tilt < 0.08 && velocity < 0.3 && height < 0.05, "{tilt} rad, {velocity} m/s, {height} m");
    }

    /// Steps of any length, forwards, backwards and zero.
    #[test]
    fn steps_of_any_length_leave_the_filter_sound(
        start in prop_oneof![Just(0u64), Just((1u64 << 32) - 500_000), Just(u64::MAX - 5_000_000), any::<u64>()],
        steps in prop::collection::vec(
            prop_oneof![
                8 => Just(2_500i64), 2 => Just(0), 2 => -5_000_000i64..0, 2 => 0i64..100_000,
                1 => 0i64..10_000_000, 1 => any::<i64>(),
            ],
            1..400,
        ),
    ) {
        let mut eskf = Eskf::new(EskfConfig { mag_enable: true, ..EskfConfig::default() });
        let force = Vec3::new(0.0, 0.0, -GRAVITY);
        let calibration = stampfly_types::messages::CalibrationResult {
            specific_force: force,
            field: super::flight::FIELD,
            complete: true,
            ..Default::default()
        };
        let mut at = Instant::from_micros(start);
        eskf.initialize(at, &calibration);
        for step in steps {
            at = Instant::from_micros(at.as_micros().saturating_add_signed(step));
            eskf.predict(at, &ImuData { accel: force, gyro: Vec3::new(0.1, -0.2, 0.1), temperature: 25.0, ..Default::default() });
            _ = eskf.fuse_tof(at, &TofData { distance: 0.5, valid: true, ..Default::default() });
            let flow = FlowData { interval: 0.01, quality: 100, valid: true, ..Default::default() };
            _ = eskf.fuse_flow(at, &flow);
            _ = eskf.fuse_mag(at, &MagData { field: super::flight::FIELD });
            prop_assert!(is_sound(&eskf), "after a step of {step} µs");
            let estimate = eskf.estimate();
            prop_assert!(estimate.velocity.iter().chain(estimate.position.iter()).all(|v| v.is_finite()));
        }
    }
}
