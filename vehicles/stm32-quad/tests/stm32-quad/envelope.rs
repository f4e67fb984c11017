//! No protection speaks while a sound vehicle flies, whatever is flown with it. `FLIGHTS=50` flies
//! as many seeds of each kind.

use crate::recorded::Flown;
use stampfly_sim::vehicle::{Options, Verdict};
use stampfly_types::messages::Alerts;
use std::thread;

/// Mode, mission, wind and gusts, m/s, strength of vibration.
const KINDS: [(&str, &str, f32, f32, f64); 12] = [
    ("angle", "hover", 0.0, 0.0, 0.3),
    ("angle", "square", 2.0, 0.0, 0.3),
    ("acro", "square", 0.0, 0.0, 0.3),
    ("acro", "hover", 2.0, 0.5, 0.3),
    ("angle", "square", 2.0, 1.0, 1.0),
    ("angle", "drop", 0.0, 0.0, 0.3),
    ("acro", "drop", 1.0, 0.5, 0.3),
    ("angle", "freestyle", 0.0, 0.0, 0.3),
    ("angle", "freestyle", 2.0, 0.5, 0.3),
    ("angle", "freestyle", 4.0, 1.0, 1.0),
    ("acro", "0,0,1,2; 8,0,1,1; 0,8,4,1", 2.0, 1.0, 0.3),
    ("angle", "0,0,0.3,1; 1,0,0.3,1", 1.0, 0.5, 0.3),
];

#[test]
fn no_protection_speaks_while_everything_is_sound() {
    let seeds: u64 = std::env::var("FLIGHTS").map_or(2, |text| text.parse().expect("FLIGHTS is a number"));
    let half = |first: usize| {
        move || {
            let mut wrong = Vec::new();
            for (mode, mission, wind, gust, vibration) in KINDS.into_iter().skip(first).step_by(2) {
                let options = Options {
                    pilot: Some(mode.into()),
                    mission: Some(mission.into()),
                    wind: Some([0.7 * wind, 0.7 * wind]),
                    gust: Some(gust),
                    vibration: Some(vibration),
                    ..Options::default()
                };
                let before = wrong.len();
                for seed in 1..=seeds {
                    let flown = Flown::with(&options, seed);
                    if flown.alerted() != Alerts::NONE || flown.outcome.cut {
                        let alerts: Vec<_> = flown.alerted().names().collect();
                        wrong.push(format!("{mode} {mission} seed {seed}: {alerts:?}, {}", flown.outcome.sentence()));
                    }
                }
                println!("{mode} {mission} wind {wind} gust {gust}: {} of {seeds} alert", wrong.len() - before);
            }
            wrong
        }
    };
    let wrong = thread::scope(|scope| {
        let halves = [0, 1].map(|first| scope.spawn(half(first)));
        halves.into_iter().flat_map(|half| half.join().expect("no panic")).collect::<Vec<_>>()
    });
    assert!(wrong.is_empty(), "{wrong:#?}");
}
