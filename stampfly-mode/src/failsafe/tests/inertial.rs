//! An inertial sensor that does not measure, samples that are garbage, and what must still be seen.

use super::*;

/// The sample of a vehicle that stands, a millisecond a number.
pub fn still(millis: u64) -> [Stamped<ImuData>; 1] {
    let grain = 1e-3 * (millis % 7) as f32;
    let small = Vec3::new(grain, -grain, 2.0 * grain);
    let data = ImuData { accel: REST + small, gyro: small, temperature: 25.0, ..Default::default() };
    [Stamped { at: Instant::from_millis(millis), generation: 0, data }]
}

const GONE: Vec3 = Vec3::new(f32::NAN, 0.0, 0.0);
/// What a register of 0x8000 is.
const FULL: [Vec3; 2] = [Vec3::new(-78.45, -78.45, -78.45), Vec3::new(-34.9, -34.9, -34.9)];

/// Samples until this alert, of a vehicle that flew well for a second.
fn until(alert: Alerts, mut fault: impl FnMut(&mut Rig, usize) -> Alerts) -> Option<usize> {
    let mut rig = Rig::flying().settled();
    (1..=4_000).find(|k| fault(&mut rig, *k).contains(alert))
}

#[test]
fn d7_an_inertial_sensor_that_is_stuck_stops_the_motors_within_50_ms() {
    let [force, rate] = [REST * 1.01, Vec3::new(0.1, 0.2, 0.3)];
    let cases: [(&str, fn(&mut Rig, Vec3, Vec3) -> Alerts); 3] = [
        ("both", |rig, force, rate| rig.exactly(force, rate)),
        ("gyro", |rig, force, rate| {
            let noise = rig.noise(0.05);
            rig.exactly(force + noise, rate)
        }),
        ("one axis of the gyro", |rig, force, rate| {
            let [n, m] = [rig.noise(0.05), rig.noise(0.005)];
            rig.exactly(force + n, Vec3::new(rate.x, rate.y + m.y, rate.z + m.z))
        }),
    ];
    for (what, fault) in cases {
        let seen = until(Alerts::IMU_FAULTY, |rig, _| fault(rig, force, rate));
        assert_eq!(seen, Some(21), "{what}: 50 ms after the first repetition");
    }
}

#[test]
fn an_accelerometer_that_is_stuck_beside_a_gyro_that_measures_ends_in_a_landing() {
    // Not at full scale: from the side that is a blow.
    for force in [REST * 1.01, Vec3::zeros(), Vec3::new(4.0, 0.1, -9.8)] {
        let mut rig = Rig::flying().settled();
        let mut seen = Alerts::NONE;
        for sample in 1..=800 {
            let noise = rig.noise(0.005);
            let active = rig.exactly(force, noise);
            assert!(!active.intersects(crate::decision::CUT), "{force:?}, sample {sample}: {active:?}");
            assert_eq!(active.contains(Alerts::ACCEL_FAULTY), sample > 20, "{force:?}, sample {sample}");
            seen |= active;
        }
        assert_eq!(seen, Alerts::ACCEL_FAULTY, "{force:?}: and nothing else");
    }
}

#[test]
fn d7_an_inertial_sensor_that_says_zero_stops_the_motors_within_60_ms() {
    let all = until(Alerts::IMU_FAULTY, |rig, _| rig.exactly(Vec3::zeros(), Vec3::zeros()));
    assert!(all.is_some_and(|samples| samples <= 22), "{all:?}");
}

#[test]
fn d7_samples_that_are_not_finite_are_silence() {
    for (accel, gyro) in
        [(GONE, Vec3::zeros()), (REST, GONE), (REST * f32::INFINITY, Vec3::zeros()), (REST * 1e30, GONE)]
    {
        assert_eq!(until(Alerts::IMU_LOST, |rig, _| rig.exactly(accel, gyro)), Some(20), "50 ms");
    }
}

#[test]
fn d7_garbage_for_good_stops_the_motors_within_100_ms_and_not_before_50() {
    let seen = until(Alerts::IMU_FAULTY, |rig, _| {
        let [force, rate] = [rig.noise(150.0), rig.noise(69.0)];
        rig.exactly(force, rate)
    });
    assert!(seen.is_some_and(|samples| samples <= 40), "{seen:?}");
    assert!(seen.is_some_and(|samples| samples > 20), "not sooner than after 50 ms: {seen:?}");
}

#[test]
fn d7_full_scale_for_good_stops_the_motors() {
    let seen = until(Alerts::IMU_FAULTY, |rig, _| rig.exactly(FULL[0], FULL[1]));
    assert_eq!(seen, Some(21), "53 ms");
    let seen = until(Alerts::GYRO_ANOMALY, |rig, _| {
        let noise = rig.noise(0.05);
        rig.exactly(REST + noise, FULL[1])
    });
    assert_eq!(seen, Some(4), "10 ms: a rate that goes on");
}

#[test]
fn d21_two_garbled_samples_are_flown_through() {
    let full = Vec3::new(78.4, -78.4, 78.4);
    for (force, rate) in [(FULL[0], FULL[1]), (full, Vec3::zeros()), (REST * 5.0, FULL[1]), (REST, FULL[1] * 0.5)] {
        for length in 1..=3 {
            let mut rig = Rig::flying().settled();
            for _ in 0..length {
                assert!(rig.exactly(force, rate).is_empty(), "{force:?} {rate:?}");
            }
            for k in 0..400 {
                assert!(rig.sample(REST, Vec3::zeros()).is_empty(), "{force:?} {rate:?}, {k} samples later");
            }
        }
    }
}

#[test]
fn d21_a_blow_is_still_seen_at_once() {
    // Without a jump of the rate: in two samples. With one that looks like garbage: 5 ms after two samples.
    for (jump, limit) in [(0.0, 4), (30.0, 4)] {
        let mut rig = Rig::flying().settled();
        let turning = Vec3::new(jump, -0.5 * jump, 0.0);
        let blows = [REST * 9.0, REST * 7.0, REST * 2.0, REST];
        let seen = blows.iter().position(|blow| rig.sample(*blow, turning).contains(Alerts::IMPACT));
        assert!(seen.is_some_and(|samples| samples < limit), "{jump}: {seen:?}");
        assert!(jump > 0.0 || seen == Some(1), "{seen:?}");
    }
}

#[test]
fn a_blow_that_turns_the_vehicle_is_seen_in_two_samples() {
    // Each rate is 12 rad/s from the one before, which by itself makes a sample suspect.
    let mut rig = Rig::flying().settled();
    let wall = Vec3::new(-60.0, 0.0, -10.0);
    let seen = (1..4).find(|k| rig.sample(wall, Vec3::new(0.0, 12.0 * *k as f32, 0.0)).contains(Alerts::IMPACT));
    assert_eq!(seen, Some(2));
    // From two sides, 45° apart, it is garbage.
    let mut rig = Rig::flying().settled();
    let sides = [Vec3::new(-75.0, 0.0, -10.0), Vec3::new(-53.0, 53.0, -10.0)];
    assert_eq!(sides.map(|force| rig.sample(force, Vec3::new(0.0, 12.0, 0.0))), [Alerts::NONE; 2]);
}

/// A sample of a vehicle at rest with this peak.
fn with_peak(rig: &mut Rig, accel_peak: f32, gyro: Vec3) -> Alerts {
    struck(rig, REST, accel_peak, gyro)
}

fn struck(rig: &mut Rig, force: Vec3, accel_peak: f32, gyro: Vec3) -> Alerts {
    rig.now += PERIOD;
    let data = ImuData { accel: force + rig.noise(0.05), gyro: gyro + rig.noise(0.005), temperature: 25.0, accel_peak };
    rig.step(rig.now, &[Stamped { at: rig.now, generation: 0, data }])
}

#[test]
fn a_sharp_blow_counts_in_the_sample_in_which_it_begins() {
    let blow = |prepare: fn(&mut Rig), peak: f32, gyro: Vec3| {
        let mut rig = Rig::flying();
        prepare(&mut rig);
        with_peak(&mut rig.settled(), peak, gyro)
    };
    assert_eq!(blow(|_| (), 60.0, Vec3::zeros()), Alerts::IMPACT);
    assert_eq!(blow(|_| (), 30.0, Vec3::zeros()), Alerts::NONE, "3 g for some samples of the chip are no blow");
    assert_eq!(blow(|rig| rig.mode.phase = FlightPhase::Landing, 60.0, Vec3::zeros()), Alerts::NONE, "the ground");
    assert_eq!(blow(|rig| rig.estimate.height = 0.05, 60.0, Vec3::zeros()), Alerts::NONE, "a touch-down");
    assert_eq!(blow(|_| (), 60.0, Vec3::new(0.0, 12.0, 0.0)), Alerts::IMPACT, "a wall turns the vehicle");
    assert_eq!(blow(|_| (), 60.0, Vec3::new(0.0, 40.0, 0.0)), Alerts::NONE, "no wall turns it so fast");
    let from = |force: [f32; 3]| struck(&mut Rig::flying().settled(), force.into(), 60.0, Vec3::zeros());
    for ceiling in [[0.0, 0.0, GRAVITY], [10.0, 0.0, 15.0], [0.0, -10.0, 15.0]] {
        assert_eq!(from(ceiling), Alerts::NONE, "a ceiling: {ceiling:?}");
    }
    for wall in [[0.0, -15.0, 5.0], [-15.0, 0.0, 5.0], [15.0, 0.0, 5.0]] {
        assert_eq!(from(wall), Alerts::IMPACT, "a wall: {wall:?}");
    }
    for peak in [f32::NAN, f32::INFINITY] {
        assert_eq!(blow(|_| (), peak, Vec3::zeros()), Alerts::NONE, "{peak}");
    }
}

/// Peaks of 2 g to 5 g that grow within a quarter of a second, as of a bent propeller that is being spun up.
#[test]
fn peaks_of_vibration_are_no_blow_and_a_blow_among_them_is_seen() {
    let mut rig = Rig::flying().settled();
    for k in 0..4_000 {
        let strength = (k as f32 / 100.0).min(1.0) * GRAVITY;
        let peak = strength * (3.5 + 3.0 * rig.noise(1.0).x);
        assert_eq!(with_peak(&mut rig, peak, Vec3::zeros()), Alerts::NONE, "sample {k}, {peak} m/s^2");
    }
    assert_eq!(with_peak(&mut rig, 16.0 * GRAVITY, Vec3::zeros()), Alerts::IMPACT);
}

/// One in ten of them is large, as of a propeller that touches something in gusts.
#[test]
fn vibration_whose_peaks_are_rare_is_no_blow() {
    let mut rig = Rig::flying().settled();
    for k in 0..6_000 {
        let rare = if k % 10 == 9 { 25.0 * (k as f32 / 3_000.0).min(1.0) } else { 0.0 };
        assert_eq!(with_peak(&mut rig, 19.0 + rare, Vec3::zeros()), Alerts::NONE, "sample {k}");
    }
}

/// What has just begun is judged by the mean over a tenth of a second, and there peaks of up to 2 g count in full.
#[test]
fn vibration_that_has_just_begun_is_no_blow() {
    let after = |samples: usize| {
        let mut rig = Rig::flying().settled();
        for _ in 0..samples {
            assert_eq!(with_peak(&mut rig, 1.9 * GRAVITY, Vec3::zeros()), Alerts::NONE);
        }
        with_peak(&mut rig, 5.0 * GRAVITY, Vec3::zeros())
    };
    assert_eq!([0, 5, 10].map(after), [Alerts::IMPACT, Alerts::NONE, Alerts::NONE]);
}

#[test]
fn a_fast_turn_is_no_spin() {
    let turns = |rate: f32| {
        until(Alerts::GYRO_ANOMALY, |rig, k| rig.sample(REST, Vec3::new(0.0, 0.0, (0.25 * k as f32).min(rate))))
    };
    assert_eq!(turns(13.5), None);
    assert!(turns(14.5).is_some_and(|samples| samples <= 60));
}

/// A quadcopter flies for 50 ms on its last rates.
#[test]
fn garbage_that_does_not_follow_from_itself_is_no_blow_and_no_spin_for_50_ms() {
    let garbage: [(&str, fn(&mut Rig) -> Alerts); 2] = [
        ("a register", |rig| rig.exactly(FULL[0], FULL[1])),
        ("bits at random", |rig| {
            let [force, rate] = [rig.noise(150.0), rig.noise(69.0)];
            rig.exactly(force, rate)
        }),
    ];
    for (what, garbage) in garbage {
        let mut rig = Rig::flying().settled();
        for sample in 1..=20 {
            let cuts = garbage(&mut rig).intersects(crate::decision::CUT);
            assert!(!cuts, "{what}, sample {sample}");
        }
        for sample in 0..400 {
            assert_eq!(rig.sample(REST, Vec3::zeros()), Alerts::IMU_NOISY, "{what}, {sample} samples later");
        }
    }
}

/// A vehicle that is struck turns on as it was left, faster than torque could make it.
#[test]
fn a_turn_that_goes_on_is_no_garbage() {
    let mut rig = Rig::flying().settled();
    let turns = |k: usize| Vec3::new(20.0 - 0.2 * k as f32, 0.0, 0.0);
    let seen = (1..=8).find(|k| rig.sample(REST, turns(*k)).contains(Alerts::GYRO_ANOMALY));
    assert_eq!(seen, Some(4));
}

#[test]
fn d21_a_spin_is_still_caught() {
    // A propeller is gone: 100 rad/s² about the vertical.
    let seen = until(Alerts::GYRO_ANOMALY, |rig, k| rig.sample(REST, Vec3::new(0.0, 0.0, 0.25 * k as f32)));
    assert!(seen.is_some_and(|samples| samples <= 60), "{seen:?}");
}

#[test]
fn a_backlog_of_samples_is_no_silence() {
    let mut rig = Rig::flying().settled();
    let start = rig.now;
    let backlog: Vec<_> = (1..=14)
        .map(|k| {
            let at = start + PERIOD * k;
            let data = ImuData {
                accel: REST + rig.noise(0.05),
                gyro: rig.noise(0.005),
                temperature: 25.0,
                ..Default::default()
            };
            Stamped { at, generation: 0, data }
        })
        .collect();
    assert_eq!(rig.step(start + PERIOD * 14, &backlog), Alerts::NONE, "35 ms in one piece, the newest is fresh");
}

#[test]
fn a_stamp_in_the_future_does_not_hide_silence() {
    let mut rig = Rig::flying().settled();
    let data = ImuData { accel: REST, gyro: rig.noise(0.1), temperature: 25.0, ..Default::default() };
    let late = Stamped { at: rig.now + Duration::from_secs(15), generation: 0, data };
    let from = rig.now;
    assert_eq!(rig.step(from, &[late]), Alerts::NONE);
    let lost = (1..100).find(|k| rig.step(from + PERIOD * *k, &[]).contains(Alerts::IMU_LOST));
    assert_eq!(lost, Some(20), "50 ms");
}

#[test]
fn tumbling_is_watched_while_armed_and_in_acro() {
    let tumbles = |phase, mode, tilt: f32| {
        let mut rig = Rig::flying();
        (rig.mode.phase, rig.mode.mode) = (phase, mode);
        rig.estimate.attitude = stampfly_types::Quat::from_euler_angles(tilt, 0.0, 0.0);
        (1..=800).find(|_| rig.sample(REST, Vec3::zeros()).contains(Alerts::TUMBLED))
    };
    use FlightPhase::{Armed, Flying};
    assert_eq!(tumbles(Flying, FlightMode::Stabilize, 1.2), Some(121), "0.3 s");
    assert_eq!(tumbles(Armed, FlightMode::PosHold, 1.2), None);
    assert_eq!(tumbles(Armed, FlightMode::PosHold, 1.5), Some(121));
    assert_eq!(tumbles(Flying, FlightMode::Acro, 2.0), None, "half way through a loop");
    assert_eq!(tumbles(Flying, FlightMode::Acro, 3.0), Some(401), "a second on its back");
}

#[test]
fn a_lost_estimate_stays_an_alert_after_the_reset() {
    let mut rig = Rig::flying().settled();
    rig.status.diverged = true;
    assert_eq!(rig.sample(REST, Vec3::zeros()), Alerts::ESTIMATE_DIVERGED);
    rig.status.diverged = false;
    for _ in 0..4_000 {
        assert_eq!(rig.sample(REST, Vec3::zeros()), Alerts::ESTIMATE_DIVERGED);
    }
    rig.mode.armed = false;
    assert_eq!(rig.sample(REST, Vec3::zeros()), Alerts::NONE);
}

/// One sample in twenty is off by 15 rad/s, and two of them come together with opposite signs.
#[test]
fn opposite_spikes_are_a_burst_and_no_turn() {
    let spike = |rate: f32| Vec3::new(rate, 0.0, 0.0);
    let seen = until(Alerts::GYRO_ANOMALY, |rig, k| match k % 40 {
        20 => rig.sample(REST, spike(15.0)),
        21 => rig.sample(REST, spike(-15.0)),
        22 => rig.sample(REST, spike(-15.0)),
        _ => rig.sample(REST, Vec3::zeros()),
    });
    assert_eq!(seen, None);
}

/// Samples that measure, but for one number.
fn measured(k: usize) -> ImuData {
    let noise = Vec3::repeat(1e-3 * (k % 7) as f32);
    ImuData { accel: REST + noise, gyro: noise, temperature: 25.0, ..Default::default() }
}

/// What the last of these samples makes of the sensor: a fault, noise. Each is suspect or not.
fn judged(suspects: impl IntoIterator<Item = bool>) -> [bool; 2] {
    let (mut monitor, config) = (ImuMonitor::default(), FailsafeConfig::default());
    let judge = |(k, suspect)| {
        let verdict = monitor.step(&config, &measured(k), suspect);
        [verdict.faulty, verdict.noisy]
    };
    suspects.into_iter().enumerate().map(judge).last().unwrap_or_default()
}

#[test]
fn suspect_samples_are_noise_from_six_close_together_and_a_fault_from_21() {
    for (suspects, expected) in [(5, [false; 2]), (6, [false, true]), (20, [false, true]), (21, [true; 2])] {
        assert_eq!(judged(vec![true; suspects]), expected, "{suspects} running");
    }
    // However long the fault lasts, it is over after as many good samples as there are until it is found, twice.
    for (good, expected) in [(42, [true; 2]), (43, [false, true]), (144, [false, true]), (145, [false; 2])] {
        let samples = [vec![true; 1_000], vec![false; good]].concat();
        assert_eq!(judged(samples), expected, "{good} good ones later");
    }
}

#[test]
fn an_axis_that_trembles_at_full_scale_does_not_measure() {
    let config = FailsafeConfig::default();
    let found = |sensor: fn(&mut ImuData) -> &mut Vec3, full_scale: f32| {
        let mut monitor = ImuMonitor::default();
        (1..=100).find(|k| {
            let mut sample = measured(*k);
            sensor(&mut sample).y = full_scale + 1e-3 * (k % 7) as f32;
            let verdict = monitor.step(&config, &sample, false);
            verdict.faulty || verdict.accel_faulty
        })
    };
    // Calibration and the filter of the decimation move it by up to 2 %.
    assert_eq!(found(|sample| &mut sample.accel, 0.985 * config.accel_full_scale), Some(20));
    assert_eq!(found(|sample| &mut sample.gyro, -0.985 * config.gyro_full_scale), Some(20));
    assert_eq!(found(|sample| &mut sample.accel, 0.97 * config.accel_full_scale), None);
    assert_eq!(found(|sample| &mut sample.gyro, -0.97 * config.gyro_full_scale), None);
}
