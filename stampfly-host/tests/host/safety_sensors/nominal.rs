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

/// Flow was convicted in three of these, because the comparison began with a reading of two frames (D-073).
#[test]
fn random_missions_at_twice_the_vibration_raise_no_alert() {
    let mut campaign = std::process::Command::new(env!("CARGO_BIN_EXE_stampfly"));
    campaign.args(["campaign", "--mission", "random", "--gust", "0", "--vibration", "2", "--json"]);
    let output = campaign.args(["--seed", "18", "--flights", "10"]).output().expect("it runs");
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let flights = report["each"].as_array().expect("flights");
    assert_eq!(flights.len(), 10);
    for flight in flights {
        let names = flight["alerts"].as_array().expect("alerts").iter().map(|alert| &alert["name"]);
        let found: Vec<_> =
            names.filter(|name| !["COMM_LOST", "LOW_BATTERY"].map(Into::into).contains(*name)).collect();
        assert!(found.is_empty() && flight["outcome"] == "transparent", "seed {}: {found:?}", flight["seed"]);
    }
}
