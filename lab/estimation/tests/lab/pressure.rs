//! The simulated wander of the pressure against that of StampFlys that lay still.
//!
//! Needs the recorded data; see `build.rs` for how they are found.

use stampfly_drivers::Barometer;
use stampfly_sim::plant::WindConfig;
use stampfly_sim::time::block_on;
use stampfly_sim::{Conditions, Simulation, SimulationConfig};
use stampfly_types::Instant;

/// Set by the build script.
const FOLDER: &str = env!("STAMPFLY_DATA_FOLDER");

const STILL: [&str; 4] = ["static_test7", "static_low_ba", "static_comparison", "test_400hz_static"];
/// As long as the shortest of them.
const SECONDS: usize = 20;

/// How far apart the means of a second are within 20 s, and the largest change within 2 s, m.
fn wander(altitudes: &[(f64, f64)]) -> [f64; 2] {
    let means: Vec<f64> = (0..SECONDS)
        .map(|second| {
            let within = altitudes.iter().filter(|(time, _)| *time as usize == second);
            let values: Vec<f64> = within.map(|(_, altitude)| *altitude).collect();
            values.iter().sum::<f64>() / values.len() as f64
        })
        .collect();
    let (low, high) = means.iter().fold((f64::MAX, f64::MIN), |(low, high), mean| (low.min(*mean), high.max(*mean)));
    let change = means.windows(3).map(|three| (three[2] - three[0]).abs()).fold(0.0, f64::max);
    [high - low, change]
}

fn recorded(name: &str) -> Vec<(f64, f64)> {
    let text = std::fs::read_to_string(format!("{FOLDER}/stampfly_logs/{name}.csv")).expect("a recording");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let place = |column: &str| header.iter().position(|name| *name == column).expect("a column of this name");
    let (time, altitude) = (place("timestamp_ms"), place("raw_baro_alt"));
    let rows = lines.map(|line| {
        let values: Vec<&str> = line.split(',').collect();
        (values[time].parse::<f64>().expect("ms") * 1e-3, values[altitude].parse::<f64>().expect("m"))
    });
    let rows: Vec<_> = rows.collect();
    rows.iter().map(|(at, altitude)| (at - rows[0].0, *altitude)).collect()
}

fn simulated(seed: u64, conditions: &Conditions) -> Vec<(f64, f64)> {
    let plant = stampfly_board::simulation::PLANT;
    let conditions = conditions.clone();
    let config = SimulationConfig { seed, wind: WindConfig::CALM, conditions, ..SimulationConfig::new(plant) };
    let Simulation { clock, mut sensors, .. } = Simulation::new(&config);
    let mut altitudes = Vec::new();
    while clock.now() < Instant::from_secs(SECONDS as u64) {
        let Ok(sample) = block_on(&clock, sensors.baro.next());
        altitudes.push((sample.at.since(Instant::ZERO).seconds_f64(), f64::from(sample.data.altitude)));
    }
    altitudes
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn the_pressure_wanders_as_recorded_in_the_harsh_world() {
    let of_still = STILL.map(|name| wander(&recorded(name)));
    let conditions = Conditions { baro_wander: 1.0, ..Conditions::GENTLE };
    let simulated: Vec<_> = (0..100).map(|seed| wander(&simulated(seed, &conditions))).collect();
    for (what, name) in ["range", "change"].into_iter().enumerate() {
        let mut values: Vec<f64> = simulated.iter().map(|figures| figures[what]).collect();
        values.sort_by(f64::total_cmp);
        let mut recorded = of_still.map(|figures| figures[what]);
        recorded.sort_by(f64::total_cmp);
        // Each recording is one that could have been simulated, and their middle is in the middle.
        for value in recorded {
            assert!((values[1]..values[98]).contains(&value), "{name}: {value} m of {} to {}", values[1], values[98]);
        }
        let middle = 0.5 * (recorded[1] + recorded[2]);
        assert!((values[20]..values[80]).contains(&middle), "{name}: {middle} m of {} to {}", values[20], values[80]);
    }
}
