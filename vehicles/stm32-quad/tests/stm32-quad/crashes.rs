//! After every kind of crash the motors are off within a second, from when the truth says that it
//! is one. `FLIGHTS=20` flies as many seeds of each kind.

use crate::recorded::Flown;
use stampfly_sim::vehicle::Options;
use std::thread;

/// Faults of a flight with its mode, and how a crash comes of it.
const KINDS: [(&str, &str); 20] = [
    ("angle", "gyro-bias=0.3@hover"),
    ("angle", "gyro-bias=0.5@hover"),
    ("angle", "gyro-bias=-1@hover"),
    ("acro", "gyro-bias=0.5@hover"),
    ("acro", "gyro-bias=1@landing"),
    ("angle", "accel-bias=5@hover"),
    ("acro", "accel-bias=-5@landing"),
    ("angle", "motor-weak=1@hover"),
    ("acro", "motor-weak=1@hover"),
    ("angle", "motor-weak=0.7@takeoff"),
    ("angle", "motor-weak=1@landing"),
    ("angle", "motor-weak=1@touch"),
    ("angle", "motor-stuck=1@hover"),
    ("acro", "motor-stuck=0@takeoff"),
    ("angle", "motor-stuck=1@touch"),
    ("angle", "imu-stuck@hover"),
    ("acro", "imu-stuck@landing"),
    ("angle", "wall=0.4@move"),
    ("acro", "ceiling=0.2@takeoff"),
    ("angle", "slope=0.5@landing"),
];

fn flight((mode, fault): (&str, &str), seed: u64) -> Flown {
    let options = Options {
        pilot: Some(mode.into()),
        fault: vec![fault.into()],
        mission: Some("0,0,1.5,2; 3,0,1.5,2".into()),
        ..Options::default()
    };
    Flown::with(&options, seed)
}

#[test]
fn a_second_after_a_crash_the_motors_are_off() {
    let seeds: u64 = std::env::var("FLIGHTS").map_or(2, |text| text.parse().expect("FLIGHTS is a number"));
    let half = |first: usize| {
        move || {
            let mut lines = Vec::new();
            for kind in KINDS.iter().skip(first).step_by(2) {
                let (mut crashes, mut longest) = (0, 0.0f64);
                for seed in 1..=seeds {
                    let flown = flight(*kind, seed);
                    if let Some(crash) = flown.crash() {
                        crashes += 1;
                        longest = longest.max(flown.turned_after(crash).seconds_f64());
                    }
                }
                println!("{kind:?}: {crashes} of {seeds} crash, motors off after {longest:.3} s at most");
                lines.push((*kind, crashes, longest));
            }
            lines
        }
    };
    let lines = thread::scope(|scope| {
        let halves = [0, 1].map(|first| scope.spawn(half(first)));
        halves.into_iter().flat_map(|half| half.join().expect("no panic")).collect::<Vec<_>>()
    });
    let crashes: u64 = lines.iter().map(|(_, crashes, _)| crashes).sum();
    assert!(crashes > 10 * seeds, "{crashes} crashes are too few to say anything");
    let late: Vec<_> = lines.iter().filter(|(_, _, longest)| *longest > 1.0).collect();
    assert!(late.is_empty(), "{late:?}");
}
