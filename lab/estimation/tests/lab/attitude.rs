//! The attitude filter over hand-held recordings, against VQF 2.1.2 on the same files.
//!
//! The reference numbers are the recordings' own table (`vqf9d_*`, default parameters), and for what is done to the
//! recordings here, what the same version made of the same change. Bars are ratios of means: a single trial hangs on
//! how the field happened to be bent.

use stampfly_eskf::attitude::AttitudeConfig;
use stampfly_lab::dataset::{self, Recording};
use stampfly_lab::estimate::{self, Figures, Suite};
use stampfly_types::{Duration, Instant, Vec3, frame};

/// Set by the build script.
const FOLDER: &str = env!("STAMPFLY_DATA_FOLDER");

/// The trials of the folder that the table has numbers for: the recording, and VQF's tilt and total error, degrees RMS.
fn trials() -> Vec<(Recording, [f64; 2])> {
    let table = std::fs::read_to_string(format!("{FOLDER}/broad/rmse_table.csv")).unwrap();
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let column = |name: &str| header.iter().position(|cell| *cell == name).unwrap();
    let (tilt, total) = (column("vqf9d_incl"), column("vqf9d_total"));
    let known = lines.filter_map(|cells| Some((cells[0], [cells[tilt].parse().ok()?, cells[total].parse().ok()?])));
    let trials: Vec<_> = known
        .filter_map(|(name, errors)| {
            let file = format!("{FOLDER}/broad/{name}.npz");
            std::path::Path::new(&file).exists().then(|| (dataset::load(file).unwrap(), errors))
        })
        .collect();
    assert!(trials.len() >= 4, "only {} trials", trials.len());
    trials
}

fn figures(recording: &Recording) -> Figures {
    let figures = estimate::run(recording, &estimate::suite(recording.kind)).figures;
    assert!(!figures.diverged && figures.truth_samples > 30_000, "{}: {figures:?}", recording.name);
    figures
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// Mean total error over the trials, each changed in this way, degrees RMS.
fn changed(change: impl Fn(&mut Recording)) -> f64 {
    let totals = trials().into_iter().map(|(mut recording, _)| {
        change(&mut recording);
        figures(&recording).total_rmse_deg.unwrap()
    });
    mean(totals)
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn tilt_and_attitude_are_better_than_vqf() {
    let trials = trials();
    let ours: Vec<_> = trials.iter().map(|(recording, _)| figures(recording)).collect();
    let tilt = mean(ours.iter().map(|f| f.tilt_rmse_deg.unwrap())) / mean(trials.iter().map(|t| t.1[0]));
    let total = mean(ours.iter().map(|f| f.total_rmse_deg.unwrap())) / mean(trials.iter().map(|t| t.1[1]));
    assert!(tilt <= 0.8, "tilt: {tilt} of VQF's");
    assert!(total <= 0.9, "total: {total} of VQF's");
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn nothing_hangs_on_delays_that_are_known_in_advance() {
    let trials = trials();
    let unknown = |recording: &Recording| {
        let attitude = AttitudeConfig::default();
        let suite = Suite { attitude, ..estimate::suite(recording.kind) };
        let figures = estimate::run(recording, &suite).figures;
        [figures.tilt_rmse_deg.unwrap(), figures.total_rmse_deg.unwrap()]
    };
    let ours: Vec<_> = trials.iter().map(|(recording, _)| unknown(recording)).collect();
    for ((recording, vqf), ours) in trials.iter().zip(&ours) {
        println!("{}: {ours:.3?}, VQF {vqf:.3?}", recording.name);
        let share = |part: usize| ours[part] / vqf[part];
        assert!(share(0) <= 1.05 && share(1) <= 1.05, "{}: {ours:?}, VQF {vqf:?}", recording.name);
    }
    for (part, name) in ["tilt", "total"].into_iter().enumerate() {
        let share = mean(ours.iter().map(|f| f[part])) / mean(trials.iter().map(|t| t.1[part]));
        println!("{name}: {share:.3} of VQF's");
        assert!(share <= 0.9, "{name}: {share} of VQF's");
    }
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn tilt_is_the_same_without_a_magnetometer() {
    for (mut recording, [tilt, _]) in trials() {
        let with = figures(&recording).tilt_rmse_deg.unwrap();
        recording.mag.clear();
        let without = figures(&recording).tilt_rmse_deg.unwrap();
        assert!((without - with).abs() < 0.1 * tilt, "{}: {without}°, with it {with}°", recording.name);
    }
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn a_magnet_on_the_sensor_is_found() {
    // VQF: 24.35°, 19.94°, 17.44°, 21.54°. Part of ours is the time until there was enough turning to find it.
    let ours = changed(|recording| {
        recording.mag.iter_mut().for_each(|sample| sample.data.field += Vec3::new(-8.0, -5.0, -6.0));
    });
    assert!(ours <= 0.6 * 20.82, "{ours}°");
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn a_field_that_turns_for_a_while_is_not_followed() {
    // Turned by 20° about the vertical, neither stronger nor steeper. VQF: 5.08°, 3.46°, 5.32°, 3.81°.
    let span = Instant::from_secs(70)..Instant::from_secs(82);
    let ours = changed(|recording| {
        let plain = estimate::run(recording, &estimate::suite(recording.kind));
        let turn = frame::from_yaw(-20f32.to_radians());
        for sample in recording.mag.iter_mut().filter(|sample| span.contains(&sample.at)) {
            let next = plain.drive.instances.partition_point(|instance| instance.at < sample.at);
            let attitude = plain.drive.instances[next].state.attitude;
            sample.data.field = attitude.inverse() * (turn * (attitude * sample.data.field));
        }
    });
    assert!(ours <= 0.6 * 4.42, "{ours}°");
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn a_bias_of_a_degree_a_second_that_rest_shows_costs_nothing() {
    // VQF: 1.38°, 0.90°, 4.07°, 1.73°.
    let ours = changed(|recording| {
        recording.imu.iter_mut().for_each(|sample| sample.data.gyro += Vec3::new(0.0175, 0.0175, -0.0175));
    });
    assert!(ours <= 0.9 * 2.02, "{ours}°");
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn a_start_in_motion_with_an_unknown_bias() {
    // Picked up two seconds before the recording begins. VQF, of the same: 1.47°, 5.36°, 6.17°, 3.62°.
    let ours = changed(|recording| {
        let moving = recording.truth.iter().find(|point| point.counts).unwrap().at + Duration::from_secs(2);
        recording.imu.retain(|sample| sample.at >= moving);
        recording.mag.retain(|sample| sample.at >= moving);
        // Three seconds to find its feet.
        recording.truth.retain(|point| point.at >= moving + Duration::from_secs(3));
        recording.imu.iter_mut().for_each(|sample| sample.data.gyro += Vec3::new(0.0105, 0.0087, -0.0122));
    });
    assert!(ours <= 0.6 * 4.16, "{ours}°");
}
