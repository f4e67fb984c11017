//! The recorded data, file by file: every file is read, and physics says that the frames are right.
//!
//! These need the recorded data; see `build.rs` for how they are found.

use stampfly_lab::dataset::{self, Kind, Recording};
use stampfly_types::{Duration, Instant, Quat, Vec3, math};

/// Set by the build script.
const FOLDER: &str = env!("STAMPFLY_DATA_FOLDER");

/// The recording in this file of the data folder.
fn load(file: &str) -> Recording {
    dataset::load(format!("{FOLDER}/{file}")).unwrap()
}

/// Every recording in a folder, by file name.
fn load_all(folder: &str, ending: &str) -> Vec<(String, Recording)> {
    let mut files: Vec<_> =
        std::fs::read_dir(format!("{FOLDER}/{folder}")).unwrap().map(|f| f.unwrap().path()).collect();
    files.sort();
    let of_kind = files.into_iter().filter(|file| file.extension().is_some_and(|e| e == ending));
    of_kind
        .filter_map(|file| {
            let name = file.file_name().unwrap().to_string_lossy().into_owned();
            (!["motor_steady_state.csv", "flight_stats.csv", "rmse_table.csv"].contains(&name.as_str()))
                .then(|| (name, dataset::load(&file).unwrap()))
        })
        .collect()
}

fn mean(vectors: impl Iterator<Item = Vec3>) -> Vec3 {
    let (sum, count) = vectors.fold((Vec3::zeros(), 0), |(sum, count), vector| (sum + vector, count + 1));
    sum / count as f32
}

/// Mean of the specific force in the world, over all instants with a known attitude. NED: (0, 0, −9.81).
fn mean_force(recording: &Recording) -> Vec3 {
    let attitude_at = |at: Instant| {
        let next = recording.truth.partition_point(|point| point.at < at);
        recording.truth.get(next).and_then(|point| point.attitude)
    };
    mean(recording.imu.iter().filter_map(|sample| Some(attitude_at(sample.at)? * sample.data.accel)))
}

/// Correlation of the gyro's three axes with the rate the reference turned at, both averaged over `window`.
fn rate_correlation(recording: &Recording, window: Duration) -> Vec3 {
    let (mut sums, mut count) = ([Vec3::zeros(); 3], 0);
    let seen: Vec<(Instant, Quat)> = recording.truth.iter().filter_map(|p| Some((p.at, p.attitude?))).collect();
    let mut start = 0;
    for end in 0..seen.len() {
        let span = seen[end].0.since(seen[start].0);
        if span < window {
            continue;
        }
        // Body rate from the rotation between two instants; a gap in the reference is not a rotation.
        if span.as_micros() < 2 * window.as_micros() {
            let turned = (seen[start].1.inverse() * seen[end].1).scaled_axis() / span.seconds();
            let from = recording.imu.partition_point(|s| s.at <= seen[start].0);
            let to = recording.imu.partition_point(|s| s.at <= seen[end].0);
            if to > from {
                let measured = mean(recording.imu[from..to].iter().map(|s| s.data.gyro));
                sums[0] += turned.component_mul(&measured);
                sums[1] += turned.component_mul(&turned);
                sums[2] += measured.component_mul(&measured);
                count += 1;
            }
        }
        start = end;
    }
    assert!(count > 200, "only {count} windows");
    sums[0].component_div(&sums[1].component_mul(&sums[2]).map(f32::abs).map(math::sqrt))
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn stampfly_logs_are_read_whole() {
    // The folder grows: a recording that is added has to be read as well.
    let logs = load_all("stampfly_logs", "csv");
    assert!(logs.len() >= 12, "{}", logs.len());
    for (name, log) in &logs {
        assert_eq!(log.kind, Kind::StampFlyLog, "{name}");
        assert!(log.imu.len() > 1_200 && log.timing.not_finite == 0, "{name}: {:?}", log.timing);
        assert!(log.imu.len() as f64 > 0.95 * log.timing.rows as f64, "{name}: {:?}", log.timing);
        let seconds = log.duration().seconds();
        let rate = |count: usize| count as f32 / seconds;
        assert!((13.0..31.0).contains(&seconds), "{name}: {seconds} s");
        assert!((10.0..100.0).contains(&rate(log.flow.len())), "{name}: flow at {} Hz", rate(log.flow.len()));
        assert!((5.0..45.0).contains(&rate(log.tof.len())), "{name}: range at {} Hz", rate(log.tof.len()));
        assert!((1.0..51.0).contains(&rate(log.baro.len())), "{name}: baro at {} Hz", rate(log.baro.len()));
        assert_eq!(log.device.as_ref().map(Vec::len), Some(log.timing.rows), "{name}");
        assert!(log.truth.is_empty());
        let down = mean(log.imu.iter().take(100).map(|s| s.data.accel)).z;
        assert!((-10.3..-9.3).contains(&down), "{name}: {down} m/s² along z");
    }
    let with_mag = logs.iter().filter(|(_, log)| !log.mag.is_empty()).count();
    assert!((6..logs.len()).contains(&with_mag), "{with_mag} logs have 25 columns, the others 22");
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn flow_of_a_tilting_vehicle_follows_the_gyro() {
    // Turned by hand on the spot: the flow is the rotation, +q along x and −p along y.
    let log = load("stampfly_logs/flow_sa.csv");
    let mut sums = [[0.0f32; 2]; 2];
    for sample in log.flow.iter().filter(|s| s.data.valid) {
        let place = log.imu.partition_point(|imu| imu.at <= sample.at);
        let gyro = mean(log.imu[place.saturating_sub(3)..place].iter().map(|s| s.data.gyro));
        let rates = [sample.data.delta_x, sample.data.delta_y].map(|angle| angle / sample.data.interval);
        for (sum, (rate, turn)) in sums.iter_mut().zip(rates.into_iter().zip([gyro.y, -gyro.x])) {
            sum[0] += rate * turn;
            sum[1] += turn * turn;
        }
    }
    let slopes = sums.map(|[cross, square]| cross / square);
    assert!(slopes.iter().all(|slope| (0.6..1.3).contains(slope)), "{slopes:?}");
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn stampfly_flights_are_read_whole_and_in_order() {
    let flights = load_all("stampfly_flights", "csv");
    assert_eq!(flights.len(), 7);
    for (name, flight) in &flights {
        assert_eq!(flight.kind, Kind::StampFlyFlight, "{name}");
        let timing = flight.timing;
        assert_eq!(flight.imu.len() + timing.repeated + timing.backwards + timing.not_finite, timing.rows, "{name}");
        assert!(flight.imu.windows(2).all(|pair| pair[0].at < pair[1].at), "{name}");
        assert!((29.0..31.0).contains(&flight.duration().seconds()), "{name}");
        let down = mean(flight.imu.iter().take(100).map(|s| s.data.accel)).z;
        assert!((-10.3..-9.3).contains(&down), "{name}: {down} m/s² along z");
    }
    // Sent in batches of four under one stamp, each sample a new one: 400 Hz come back.
    let batched = load("stampfly_flights/stampfly_fft_20260113T231806.csv");
    assert_eq!((batched.timing.repeated, batched.imu.len()), (0, 11_944));
    assert!(batched.timing.spread > 7_000);
    // Every sample sent about four times: 9 700 of 14 992 rows say nothing new.
    let repeated = load("stampfly_flights/stampfly_fft_20260113T222402.csv");
    assert!(repeated.timing.repeated > 9_700, "{:?}", repeated.timing);
    let wide = load("stampfly_flights/stampfly_fft_20260113T215417.csv");
    let highest = wide.tof.iter().map(|s| s.data.distance).fold(0.0, f32::max);
    assert!((1.3..1.4).contains(&highest), "the README says 1.339 m, read {highest}");
    assert!(wide.device.is_some() && batched.device.is_none());
    assert_eq!(wide.timing.longest, Duration::from_millis(192));
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn nanobench_frames_agree_with_physics() {
    let flights = load_all("nanobench", "npz");
    assert_eq!(flights.len(), 6);
    for (name, flight) in &flights {
        assert_eq!(flight.kind, Kind::NanoBench, "{name}");
        let force = mean_force(flight);
        assert!((-10.3..-9.3).contains(&force.z) && force.horizontal().norm() < 0.6, "{name}: {force:?}");
        let correlation = rate_correlation(flight, Duration::from_millis(50));
        // Slow circles hardly turn about z, hence the low bound; a wrong axis or sign gives zero or less.
        assert!(correlation.min() > 0.3 && correlation.sum() > 1.6, "{name}: {correlation:?}");
        // The velocity is the derivative of the position, in the same frame.
        let (mut error, mut speed) = (0.0, 0.0);
        for pair in flight.truth.windows(11).step_by(10) {
            let (first, last) = (pair[0], pair[10]);
            let moved = last.position.unwrap() - first.position.unwrap();
            let expected = mean(pair.iter().map(|p| p.velocity.unwrap())) * last.at.since(first.at).seconds();
            error += (moved - expected).norm_squared();
            speed += moved.norm_squared();
        }
        assert!(error < 0.01 * speed, "{name}: {error} of {speed}");
        let up = flight.truth.iter().map(|p| p.position.unwrap().z).fold(0.0, f32::min);
        assert!(up < -0.5, "{name}: flies at negative z");
        let own = flight.device.as_ref().unwrap();
        assert!(own.len() > 2_000, "{name}");
        let lost = name == "B9_trefoil_fast_rep5.npz";
        assert_eq!(flight.timing.extrapolated > 100, lost, "{name}: {:?}", flight.timing);
        if name == "B3_figure8_slow_rep1.npz" {
            let apart =
                own.iter().zip(&flight.truth).map(|(own, truth)| own.attitude.angle_to(&truth.attitude.unwrap()));
            assert!(apart.sum::<f32>() / (own.len() as f32) < 0.05, "the device's attitude is in the same frame");
        }
    }
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn broad_frames_agree_with_physics() {
    let trials = load_all("broad", "npz");
    assert_eq!(trials.len(), 4);
    for (name, trial) in &trials {
        assert_eq!(trial.kind, Kind::Broad, "{name}");
        let force = mean_force(trial);
        assert!((-9.9..-9.7).contains(&force.z) && force.horizontal().norm() < 0.15, "{name}: {force:?}");
        let correlation = rate_correlation(trial, Duration::from_millis(20));
        assert!(correlation.min() > 0.95, "{name}: {correlation:?}");
        // The field points north and, in central Europe, steeply down.
        let seen = trial.truth.iter().zip(&trial.mag).filter_map(|(p, m)| Some(p.attitude? * m.data.field));
        let field = mean(seen);
        assert!(field.x > 10.0 && field.y.abs() < 2.0 && field.z > 30.0, "{name}: {field:?}");
        let counted = trial.truth.iter().filter(|p| p.counts).count();
        let missing = trial.truth.iter().filter(|p| p.attitude.is_none()).count();
        assert!((30_000..35_000).contains(&counted), "{name}: {counted} samples count");
        assert!(missing > 1_000 && trial.truth_gaps > 0 && trial.truth_gaps < missing, "{name}: {}", trial.truth_gaps);
        assert!((trial.duration().seconds() * 285.714 - trial.imu.len() as f32).abs() < 5.0, "{name}");
        assert_eq!(trial.timing.rows, trial.imu.len(), "{name}");
    }
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn px4_replays_are_read_and_their_outputs_are_not() {
    let replay = load("px4_ekf2_replay/replay_data__iris_gps.csv");
    assert_eq!(replay.kind, Kind::Px4Replay);
    assert!((34.0..36.0).contains(&replay.duration().seconds()));
    assert!(replay.imu.len() > 5_000 && replay.mag.len() > 100 && replay.baro.len() > 100);
    assert!(replay.skipped.contains_key("landed") && replay.skipped.contains_key("airspeed"), "{:?}", replay.skipped);
    assert!(replay.gnss.len() > 150 && !replay.skipped.contains_key("gps"), "{:?}", replay.skipped);
    let highest = replay.gnss.iter().map(|fix| -fix.data.position.z).fold(0.0, f32::max);
    assert!((3.0..4.0).contains(&highest), "it climbs to {highest} m");
    let own = replay.device.as_ref().expect("EKF2's states lie beside it");
    assert!(own.len() > 300 && own.iter().all(|point| point.position.is_none()), "{}", own.len());
    let down = mean(replay.imu.iter().take(500).map(|s| s.data.accel)).z;
    assert!((-10.1..-9.6).contains(&down), "{down}");
    let strength = mean(replay.mag.iter().map(|s| s.data.field)).norm();
    assert!((20.0..70.0).contains(&strength), "{strength} µT is no field of the earth");
    let output = dataset::load(format!("{FOLDER}/px4_ekf2_replay/change_indication__iris_gps.csv")).unwrap_err();
    assert!(output.to_string().contains("no known kind of recording begins with `Timestamp,state[0]"), "{output}");
}

/// Hostile variations of real files: bytes changed, and the end cut off.
mod damage {
    use super::*;
    use proptest::prelude::*;

    /// The first bytes of a file, cut behind a line.
    fn beginning(file: &str) -> Vec<u8> {
        let mut bytes = std::fs::read(format!("{FOLDER}/{file}")).unwrap();
        if !file.ends_with("npz") {
            bytes.truncate(6_000);
        }
        bytes
    }

    fn survive(file: &str, cases: u32) {
        let whole = beginning(file);
        let change = (any::<prop::sample::Index>(), any::<u8>());
        let changes = (prop::collection::vec(change, 0..12), any::<prop::sample::Index>(), any::<bool>());
        let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig::with_cases(cases));
        let result = runner.run(&changes, |(changes, end, cut)| {
            let mut bytes = whole.clone();
            for (index, byte) in changes {
                let index = index.index(bytes.len());
                bytes[index] = byte;
            }
            if cut {
                bytes.truncate(end.index(bytes.len()));
            }
            if let Ok(recording) = dataset::parse("damaged", &bytes) {
                prop_assert!(recording.imu.windows(2).all(|pair| pair[0].at < pair[1].at));
            }
            Ok(())
        });
        result.unwrap();
    }

    #[test]
    #[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
    fn of_text_files_is_survived() {
        survive("stampfly_logs/square01.csv", 200);
        survive("stampfly_flights/stampfly_fft_20260113T215417.csv", 200);
        survive("px4_ekf2_replay/replay_data__iris_gps.csv", 200);
    }

    #[test]
    #[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
    fn of_archives_is_survived() {
        survive("nanobench/B3_figure8_slow_rep1.npz", 40);
        survive("broad/02_undisturbed_slow_rotation_B.npz", 10);
    }
}
