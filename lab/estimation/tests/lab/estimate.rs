//! What the estimator makes of recorded data, against bars.
//!
//! The first part needs the recorded data; see `build.rs` for how they are found.

use stampfly_lab::dataset::{self, Kind};
use stampfly_lab::estimate::{self, Figures, Method};

/// Set by the build script.
const FOLDER: &str = env!("STAMPFLY_DATA_FOLDER");

fn figures(file: &str) -> Figures {
    let recording = dataset::load(format!("{FOLDER}/{file}")).unwrap();
    estimate::run(&recording, &estimate::suite(recording.kind)).figures
}

/// Logs that lie still, and how far from the start each may end, metres.
const STILL: [(&str, f64); 4] =
    [("static_test7", 0.001), ("static_low_ba", 0.001), ("static_comparison", 0.001), ("test_400hz_static", 0.0015)];
/// Carried logs, and how far from the start the best of four other filters ends, metres: the StampFly's firmware in two
/// versions, the Crazyflie's and PX4's EKF2, each in a replay of the same log.
const CARRIED: [(&str, f64); 8] = [
    ("static_test_30s", 0.2388),
    ("flow_test_square_01", 0.0402),
    ("square01", 0.0911),
    ("square_30cm", 0.0751),
    ("analysis_rot", 0.1549),
    ("angle_test2", 0.4060),
    ("flow_sa", 0.1252),
    ("flow_scale", 0.4218),
];

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn a_vehicle_that_lies_still_stays() {
    for (name, end) in STILL {
        let figures = figures(&format!("stampfly_logs/{name}.csv"));
        assert!(!figures.diverged && figures.started_still, "{name}: {figures:?}");
        assert!(figures.end_xy_m.unwrap() <= end, "{name}: {figures:?}");
        assert!(figures.rejected.values().all(|share| *share < 0.01), "{name}: {:?}", figures.rejected);
    }
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn a_carried_vehicle_goes_as_far_as_its_flow_says() {
    let mut as_good = 0;
    for (name, best) in CARRIED {
        let figures = figures(&format!("stampfly_logs/{name}.csv"));
        let ratio = figures.max_xy_m.unwrap() / figures.flow_dead_reckoning_max_xy_m.unwrap();
        assert!((0.8..=1.2).contains(&ratio), "{name}: {ratio}, {figures:?}");
        assert!(!figures.diverged && figures.max_xy_m.unwrap() < 2.0, "{name}: {figures:?}");
        assert!(figures.rejected["flow"] < 0.1 && figures.rejected["tof"] < 0.05, "{name}: {:?}", figures.rejected);
        let end = figures.end_xy_m.unwrap();
        assert!(end <= 2.0 * best, "{name} ends at {end} m, the best peer at {best}");
        as_good += usize::from(end <= best);
    }
    assert!(3 * as_good >= 2 * CARRIED.len(), "no worse than the best peer on {as_good} of {}", CARRIED.len());
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn a_flight_of_which_only_the_inertial_sensor_was_recorded_is_not_lost() {
    let mut flights = 0;
    for entry in std::fs::read_dir(format!("{FOLDER}/stampfly_flights")).unwrap() {
        let path = entry.unwrap().path();
        let Ok(recording) = dataset::load(&path) else { continue };
        let figures = estimate::run(&recording, &estimate::suite(recording.kind)).figures;
        // Nothing measured what its state claims, and it claims nothing.
        assert!(!figures.diverged && figures.end_xy_m.is_none(), "{}: {figures:?}", recording.name);
        flights += 1;
    }
    assert!(flights >= 5, "only {flights} flights");
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2])
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn tilt_of_a_crazyflie_agrees_with_motion_capture() {
    let flights = [
        "B2_circle_slow_rep2",
        "B3_figure8_fast_rep2",
        "B3_figure8_slow_rep1",
        "B5_helix_fast_mell_rep1",
        "B9_trefoil_slow_rep5",
    ];
    // One crashed: its own estimate is no measure.
    assert!(!figures("nanobench/B9_trefoil_fast_rep5.npz").diverged);
    let all: Vec<_> = flights.iter().map(|name| figures(&format!("nanobench/{name}.npz"))).collect();
    assert!(all.iter().all(|figures| !figures.diverged && figures.truth_samples > 500), "{all:?}");
    let tilt = median(all.iter().map(|figures| figures.tilt_rmse_deg.unwrap()).collect());
    let aligned = median(all.iter().map(|figures| figures.tilt_rmse_aligned_deg.unwrap()).collect());
    let device = median(all.iter().map(|figures| figures.device_tilt_rmse_deg.unwrap()).collect());
    assert!(tilt <= 1.05 * device && aligned <= 1.5, "{tilt}°, aligned {aligned}°, the vehicle's own {device}°");
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn attitude_in_a_hand_agrees_with_motion_capture() {
    // The published Madgwick filter, one tuning for all trials: 1.497°, 4.241° and 2.904° in total.
    let trials = [
        ("02_undisturbed_slow_rotation_B", 1.0, 2.2),
        ("11_undisturbed_slow_translation_B", 1.0, 1.6),
        ("26_disturbed_phone_vibration_A", 1.0, 2.4),
    ];
    for (name, tilt, total) in trials {
        let figures = figures(&format!("broad/{name}.npz"));
        assert!(
            figures.tilt_rmse_deg.unwrap() < tilt && figures.total_rmse_deg.unwrap() < total,
            "{name}: {figures:?}"
        );
        assert!(!figures.diverged && figures.truth_gaps > 0 && figures.truth_samples > 30_000, "{name}: {figures:?}");
        assert!(figures.end_xy_m.is_none() && figures.position_rmse_m.is_none(), "nobody measured a position");
    }
}

/// A log in which the flow says two metres a second while the vehicle lies still.
fn runaway() -> String {
    let mut text =
        "timestamp_ms,dt_ms,raw_accel_x,raw_accel_y,raw_accel_z,raw_gyro_x,raw_gyro_y,raw_gyro_z,raw_baro_alt,\
        raw_tof,raw_flow_squal,raw_flow_dx,raw_flow_dy,dev_pos_x,dev_pos_y,dev_pos_z,dev_vel_x,dev_vel_y,dev_vel_z,\
        dev_roll_deg,dev_pitch_deg,dev_yaw_deg\n"
            .to_owned();
    for n in 0..600 {
        let counts = if n > 100 { 6 } else { 0 };
        text += &format!("{},10,0,0.00{},-9.81,0,0,0,0,1.5,100,{counts},0{}\n", n * 10, n % 3, ",0".repeat(9));
    }
    text
}

#[test]
fn an_attitude_filter_is_not_blamed_for_having_no_position() {
    let recording = dataset::parse("carried", runaway().as_bytes()).unwrap();
    let mut suite = estimate::suite(recording.kind);
    suite.method = Method::Attitude;
    let figures = estimate::run(&recording, &suite).figures;
    assert!(!figures.diverged && figures.end_xy_m.is_none(), "{figures:?}");
    assert_eq!((figures.unused["flow"], figures.unused["tof"]), (1.0, 1.0));
}

#[test]
fn an_estimator_that_runs_away_is_called_lost() {
    let recording = dataset::parse("runaway", runaway().as_bytes()).unwrap();
    assert_eq!(recording.kind, Kind::StampFlyLog);
    let mut suite = estimate::suite(recording.kind);
    let kept = estimate::run(&recording, &suite).figures;
    // The same filter that may not use its flow stays where it is, ten metres from what the flow says.
    suite.vehicle.eskf.flow_min_quality = 101;
    let blind = estimate::run(&recording, &suite).figures;
    assert!(!kept.diverged && kept.max_xy_m.unwrap() > 5.0, "{kept:?}");
    assert!(blind.diverged && blind.unused["flow"] == 1.0, "{blind:?}");
}
