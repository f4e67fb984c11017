//! No detector speaks up while every sensor measures.

use super::*;

#[test]
fn sensors_that_measure_raise_no_alert() {
    let flights: u64 = std::env::var("FLIGHTS").ok().and_then(|flights| flights.parse().ok()).unwrap_or(4);
    let mut found = Vec::new();
    for seed in 1..=flights {
        let windy = |simulation: &mut SimulationConfig| {
            simulation.wind.gust = 2.0;
            simulation.vibration = 2.0;
        };
        let (seen, _) = fly_in(windy, seed, 35.0, Onset::PowerOn, Lies::default());
        let all = seen.alerts.iter().fold(Alerts::NONE, |all, (_, alerts)| all | *alerts);
        // Nobody is heard until the first command.
        let all = all.without(Alerts::COMM_LOST | Alerts::IMU_DEGRADED);
        if !all.is_empty() || !seen.end().1.contact {
            found.push((seed, all));
        }
    }
    assert!(found.is_empty(), "{} of {flights} flights: {found:?}", found.len());
}
