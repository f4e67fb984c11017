//! PX4's EKF2 replay recordings: as close to receiver and magnetometer as EKF2 was with the same samples, and what
//! happens when some of them are missing.

use stampfly_drivers::Sample;
use stampfly_lab::dataset::{self, GnssFix, Kind, Recording};
use stampfly_lab::estimate::{self, AgainstReceiver, Estimated, Figures};
use stampfly_types::math::wrap_angle as wrapped;
use stampfly_types::messages::Validity;
use stampfly_types::{Duration, Instant, Vec3, frame};

/// Set by the build script.
const FOLDER: &str = env!("STAMPFLY_DATA_FOLDER");
/// An estimate may be so much farther from receiver, magnetometer and EKF2 than EKF2 was from receiver and magnetometer.
const SHARE: f64 = 1.2;
/// EKF2's log has no position to compare with. The receiver is good to a centimetre in these recordings, and 50 ms at
/// 3 m/s, the fastest flight, are this, m.
const POSITION: f64 = 0.15;

/// Every replay recording of the folder.
fn recordings() -> Vec<Recording> {
    let entries = std::fs::read_dir(format!("{FOLDER}/px4_ekf2_replay")).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.file_name().is_some_and(|name| name.to_string_lossy().starts_with("replay_data")));
    files.sort();
    let recordings: Vec<_> = files.iter().map(|file| dataset::load(file).unwrap()).collect();
    assert!(recordings.len() >= 2 && recordings.iter().all(|recording| recording.kind == Kind::Px4Replay));
    recordings
}

fn figures(recording: &Recording) -> (Figures, AgainstReceiver) {
    let figures = estimate::run(recording, &estimate::suite(recording.kind)).figures;
    let receiver = figures.receiver.clone().expect("a receiver");
    println!("{}: {receiver:?}, rejected {:?}, {} resets", recording.name, figures.rejected, figures.resets);
    (figures, receiver)
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn position_velocity_and_heading_are_as_close_as_those_of_ekf2() {
    for recording in recordings() {
        let (figures, ours) = figures(&recording);
        let name = &recording.name;
        assert!(!figures.diverged && figures.resets == 0 && ours.invalid == 0.0 && ours.fixes > 50, "{name}: {ours:?}");
        let (velocity, heading) = (ours.device_velocity_mps.unwrap(), ours.device_heading_deg.unwrap());
        assert!(ours.velocity_mps.unwrap() <= SHARE * velocity, "{name}: {ours:?}");
        assert!(ours.velocity_to_device_mps.unwrap() <= SHARE * velocity, "{name}: {ours:?}");
        assert!(ours.heading_deg.unwrap() <= SHARE * heading, "{name}: {ours:?}");
        assert!(ours.heading_to_device_deg.unwrap() <= SHARE * heading, "{name}: {ours:?}");
        assert!(
            ours.position_m.unwrap() <= ours.device_position_m.map_or(POSITION, |device| SHARE * device),
            "{name}: {ours:?}"
        );
    }
}

/// Largest difference to fixes of the receiver after ten seconds: of the position, m, and of the velocity, m/s; and the share of them
/// with a position that is not valid.
fn worst(run: &Estimated, fixes: &[Sample<GnssFix>]) -> [f64; 3] {
    let begin = run.start.at + Duration::from_secs(10);
    let (mut worst, mut invalid, mut count) = ([0.0f32; 2], 0.0, 0.0);
    for fix in fixes.iter().filter(|fix| fix.at >= begin) {
        let at = fix.at - Duration::from_millis(110);
        let next = run.drive.instances.partition_point(|instance| instance.at <= at);
        let state = &run.drive.instances[next - 1].state;
        worst[0] = worst[0].max((state.position - fix.data.position).norm());
        worst[1] = worst[1].max((state.velocity - fix.data.velocity).norm());
        invalid += f64::from(u8::from(!state.valid.contains(Validity::POSITION_XY | Validity::POSITION_Z)));
        count += 1.0;
    }
    [f64::from(worst[0]), f64::from(worst[1]), invalid / count]
}

/// A change of a recording.
type Change = fn(&mut Recording);

/// In the middle of both flights.
fn in_flight(fix: &Sample<GnssFix>, seconds: u64) -> bool {
    (Instant::from_secs(25)..Instant::from_secs(25 + seconds)).contains(&fix.at)
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn samples_that_are_missing_or_wrong_cost_little() {
    // Largest difference to the receiver that each may make, m and m/s.
    let changes: [(&str, Change, [f64; 2]); 5] = [
        ("nothing", |_| {}, [0.3, 0.4]),
        ("no barometer", |recording| recording.baro.clear(), [0.3, 0.4]),
        ("no fix for five seconds", |recording| recording.gnss.retain(|fix| !in_flight(fix, 5)), [2.0, 1.0]),
        (
            "every fifth fix",
            |recording| {
                let mut count = 0;
                recording.gnss.retain(|_| {
                    count += 1;
                    count % 5 == 0
                });
            },
            [1.0, 0.8],
        ),
        (
            "reflected for a second",
            |recording| {
                for fix in recording.gnss.iter_mut().filter(|fix| in_flight(fix, 1)) {
                    fix.data.position += Vec3::new(30.0, -20.0, 10.0);
                }
            },
            [0.5, 0.6],
        ),
    ];
    for (name, change, [position, velocity]) in changes {
        for recording in recordings() {
            let mut changed = recording.clone();
            change(&mut changed);
            let run = estimate::run(&changed, &estimate::suite(changed.kind));
            let worst = worst(&run, &recording.gnss);
            println!("{}, {name}: {worst:?}, {:?}", recording.name, run.figures.rejected);
            assert!(
                worst[0] < position && worst[1] < velocity && worst[2] == 0.0,
                "{}, {name}: {worst:?}",
                recording.name
            );
            assert_eq!(run.figures.resets, 0, "{}, {name}", recording.name);
        }
    }
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn without_a_magnetometer_no_heading_is_claimed_that_is_not_known() {
    let mut found = 0;
    for recording in recordings() {
        let mut without = recording.clone();
        without.mag.clear();
        let mut suite = estimate::suite(recording.kind);
        // These fixes are better than a receiver's that says nothing about itself.
        suite.receiver.velocity_sigma = Vec3::new(0.05, 0.05, 0.05);
        let [with, without] = [recording, without].map(|recording| estimate::run(&recording, &suite));
        let pairs = with.drive.instances.iter().zip(&without.drive.instances);
        let claimed: Vec<f32> = pairs
            .filter(|(_, without)| without.state.valid.contains(Validity::HEADING))
            .map(|(with, without)| {
                wrapped(frame::yaw(&with.state.attitude) - frame::yaw(&without.state.attitude)).to_degrees()
            })
            .collect();
        let largest = claimed.iter().fold(0.0f32, |largest, angle| largest.max(angle.abs()));
        println!(
            "claimed at {} of {} instants, at most {largest} degrees off",
            claimed.len(),
            without.drive.instances.len()
        );
        found += usize::from(!claimed.is_empty());
        assert!(largest < 3.0, "{largest} degrees");
    }
    assert!(found > 0, "the one that flies a way finds its heading");
}
