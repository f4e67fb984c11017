//! No protection speaks while a sound aircraft flies, rolls, lands hard or waits, and none when
//! something is wrong that is no crash. `FLIGHTS=50` flies as many seeds of each kind.

use crate::recorded::Flown;
use stampfly_fixed_wing::messages::Troubles;
use stampfly_sim::vehicle::{Options, Verdict};
use stampfly_types::math;
use stampfly_types::messages::Alerts;
use std::thread;

/// Mission, wind and gusts, m/s, other parameters, and faults in spite of which it lands.
const KINDS: [(&str, f32, f32, &str, &str); 16] = [
    ("round", 0.0, 0.3, "", ""),
    ("twice", 5.0, 0.3, "", ""),
    ("hop", 3.0, 1.5, "", ""),
    ("round", 8.0, 1.0, "", ""),
    // Hard landings: hardly a flare.
    ("hop", 0.0, 0.3, "flare.time=0.5 flare.sink=1.5", ""),
    ("hop", 4.0, 0.3, "flare.time=0.7 flare.sink=1.2", ""),
    // Steep turns, steep climbs, fast.
    ("round", 3.0, 0.5, "path.bank_max=1.0 path.radius=40 speed.cruise=24", ""),
    ("hop", 2.0, 0.5, "climb.pitch=0.5 climb.rate_max=6 climb.sink_max=6", ""),
    ("twice", 2.0, 0.3, "speed.taxi=6", ""),
    ("round", 2.0, 0.3, "", "gnss-lost@60+60"),
    ("round", 4.0, 0.3, "", "gnss-silent@60"),
    ("round", 2.0, 0.3, "", "pitot-blocked@60"),
    ("round", 2.0, 0.3, "", "pitot-blocked@0"),
    ("round", 2.0, 0.3, "", "baro-silent@60"),
    ("round", 2.0, 0.3, "", "mag-silent@0"),
    ("round", 3.0, 0.3, "", "link-lost@45"),
];

fn options((mission, wind, gust, params, faults): (&str, f32, f32, &str, &str), seed: u64) -> Options {
    let words = |text: &str| text.split_whitespace().map(Into::into).collect();
    // From another side with each seed.
    let (sin, cos) = math::sin_cos(seed as f32 * 2.399_963);
    Options {
        mission: Some(mission.into()),
        wind: Some([wind * cos, wind * sin]),
        gust: Some(gust),
        param: words(params),
        fault: words(faults),
        ..Options::default()
    }
}

#[test]
fn no_protection_speaks_while_nothing_has_crashed() {
    let seeds: u64 = std::env::var("FLIGHTS").map_or(1, |text| text.parse().expect("FLIGHTS is a number"));
    let said = Alerts::IMPACT
        | Alerts::STRUCK
        | Alerts::ACCEL_FAULTY
        | Alerts::GYRO_ANOMALY
        | Alerts::TUMBLED
        | Alerts::IMU_FAULTY
        | Alerts::IMU_NOISY
        | Alerts::IMU_LOST
        | Alerts::ESTIMATE_DIVERGED
        | Alerts::POWER_IMPLAUSIBLE;
    let half = |first: usize| {
        move || {
            let mut wrong = Vec::new();
            for kind in KINDS.iter().skip(first).step_by(2) {
                let before = wrong.len();
                for seed in 1..=seeds {
                    let flown = Flown::with(&options(*kind, seed), seed);
                    let alerts: Vec<_> =
                        flown.alerts.names().filter(|name| said.names().any(|other| other == *name)).collect();
                    let crash = flown.first(|row| row.troubled(Troubles::CRASH) || row.troubled(Troubles::HEIGHT));
                    if crash.is_some() || !alerts.is_empty() || flown.outcome.crash.is_some() {
                        wrong.push(format!("{kind:?} seed {seed}: {crash:?} {alerts:?}, {}", flown.outcome.sentence()));
                    }
                }
                println!("{kind:?}: {} of {seeds} alert", wrong.len() - before);
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
