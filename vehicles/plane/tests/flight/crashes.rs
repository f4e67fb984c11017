//! After every kind of crash the propeller is off within a second, from when the truth says that it
//! is one. `FLIGHTS=20` flies as many seeds of each kind.

use crate::recorded::{Flown, Row};
use stampfly_plane::simulation::plant::PLANT;
use stampfly_sim::Truth;
use stampfly_sim::fault::Class;
use stampfly_sim::vehicle::{Options, Verdict};
use stampfly_types::{Duration, Instant, Vec3, frame, math};
use std::thread;

/// Wind towards north and east, m/s, and faults.
const KINDS: [([f32; 2], &str); 22] = [
    ([12.0, 0.0], ""),
    ([0.0, 16.0], ""),
    ([20.0, 0.0], ""),
    ([3.0, 3.0], "gyro-bias=0.1@40"),
    ([0.0, 0.0], "gyro-bias=0.3@60"),
    ([0.0, 4.0], "gyro-bias=-0.5@30"),
    ([0.0, 0.0], "gyro-bias=0.5@takeoff"),
    ([0.0, 0.0], "accel-bias=25@60"),
    ([2.0, 0.0], "accel-bias=-25@60"),
    ([0.0, 0.0], "accel-bias=8@landing"),
    ([0.0, 3.0], "imu-stuck@60"),
    ([0.0, 0.0], "imu-stuck@takeoff"),
    ([0.0, 0.0], "imu-silent@landing"),
    ([0.0, 0.0], "elevator-jammed=1@60"),
    ([0.0, 2.0], "elevator-jammed=-1@60"),
    ([0.0, 0.0], "elevator-jammed=1@takeoff"),
    ([0.0, 0.0], "elevator-jammed=0.5@landing"),
    ([0.0, 0.0], "rudder-jammed=1@spool"),
    ([0.0, 2.0], "rudder-jammed=-1@60"),
    ([0.0, 3.0], "propeller-lost@60"),
    ([0.0, 0.0], "propeller-lost@takeoff"),
    ([6.0, 6.0], "gnss-lost@60 pitot-blocked@60"),
];

fn flight((wind, faults): ([f32; 2], &str), seed: u64) -> Flown {
    let fault = faults.split_whitespace().map(Into::into).collect();
    Flown::with(&Options { wind: Some(wind), fault, ..Options::default() }, seed)
}

/// Is a part on the ground that does not carry it: propeller, spinner, fin, a wing tip?
fn scrapes(truth: &Truth) -> bool {
    let p = PLANT;
    let down = |x: f64, y: f64, z: f64| (truth.position + truth.attitude * Vec3::new(x as f32, y as f32, z as f32)).z;
    let nose = (truth.attitude * Vec3::x()).z;
    let below = 0.5 * p.propeller_diameter as f32 * math::sqrt((1.0 - nose * nose).max(0.0));
    let half = 0.5 * p.wing_span;
    let lowest = [
        down(p.propeller_ahead, 0.0, p.propeller_below) + below,
        down(-p.tail_behind, 0.0, -p.fin_above),
        down(0.0, half, -p.tips_above),
        down(0.0, -half, -p.tips_above),
    ];
    // Springs give way.
    lowest.into_iter().any(|depth| depth > 0.005)
}

/// When the truth says that it has crashed: on a part that does not carry it, at an attitude in
/// which it does not stand, or with more sink than its wheels bear.
pub fn crash(flown: &Flown) -> Option<Instant> {
    let mut before: Option<&Row> = None;
    flown
        .rows
        .iter()
        .find(|row| {
            let [touched, sink] =
                before.map_or([0.0; 2], |before| [f32::from(u8::from(before.truth.contact)), before.truth.velocity.z]);
            before = Some(row);
            let truth = &row.truth;
            let [bank, pitch, _] = frame::roll_pitch_yaw(&truth.attitude);
            let lies = truth.contact && (bank.abs() > 0.6 || pitch < -0.7);
            flown.outcome.armed && (scrapes(truth) || lies || truth.contact && touched == 0.0 && sink > 2.5)
        })
        .map(|row| row.at)
}

/// For how long the propeller was told to turn after this, the last time that it was.
pub fn turned_after(flown: &Flown, crash: Instant) -> Duration {
    let last = flown.motor.iter().rfind(|(_, output)| output.duty[0] > 0.0);
    last.map_or(Duration::ZERO, |(at, _)| at.since(crash))
}

#[test]
fn a_second_after_a_crash_the_propeller_is_off() {
    let seeds: u64 = std::env::var("FLIGHTS").map_or(1, |text| text.parse().expect("FLIGHTS is a number"));
    let half = |first: usize| {
        move || {
            let mut lines = Vec::new();
            for kind in KINDS.iter().skip(first).step_by(2) {
                let (mut crashes, mut longest) = (0, 0.0f64);
                for seed in 1..=seeds {
                    let flown = flight(*kind, seed);
                    let Some(crash) = crash(&flown) else {
                        println!("{kind:?} seed {seed}: {}", flown.outcome.sentence());
                        continue;
                    };
                    crashes += 1;
                    longest = longest.max(turned_after(&flown, crash).seconds_f64());
                    let (class, sentence) = (flown.outcome.class(), flown.outcome.sentence());
                    let judged = matches!(class, Class::Crashed | Class::FlownAway | Class::Cut);
                    assert!(judged && !flown.outcome.reason().is_empty(), "{kind:?} seed {seed}: {sentence}");
                    // Some seconds after it lies there is nothing more to see.
                    let end = flown.rows.last().expect("it flew").at;
                    assert!(end.since(crash).seconds() < 15.0, "{kind:?} seed {seed}: {:?}", end.since(crash));
                }
                println!("{kind:?}: {crashes} of {seeds} crash, off after {longest:.3} s at most");
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
    assert!(crashes > 8 * seeds, "{crashes} crashes are too few to say anything");
    let late: Vec<_> = lines.iter().filter(|(_, _, longest)| *longest > 1.0).collect();
    assert!(late.is_empty(), "{late:?}");
}

/// It used to fly on its back until somebody looked: armed, with its propeller turning, for eleven
/// minutes.
#[test]
fn the_flights_that_used_to_run_on_after_their_crash_end() {
    for (wind, faults, seed) in [([12.0, 0.0], "", 880_700), ([3.0, 3.0], "gyro-bias=0.1@40", 880_720)] {
        let flown = flight((wind, faults), seed);
        let crash = crash(&flown).expect("it still crashes");
        assert!(turned_after(&flown, crash).seconds() <= 1.0, "{:?}", turned_after(&flown, crash));
        let end = flown.rows.last().expect("it flew").at;
        assert!(end.since(crash).seconds() < 15.0 && !flown.outcome.succeeded(), "{}", flown.outcome.sentence());
        assert_eq!(flown.outcome.class(), Class::Crashed, "{}", flown.outcome.sentence());
    }
}
