//! No detector speaks up while every sensor measures.

use super::*;

#[test]
fn sensors_that_measure_raise_no_alert() {
    let flights = crate::thorough::flights(2, 4);
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

/// Flies random missions at twice the recorded vibration: no alert but an empty battery's, and these ends.
fn fly_at_random(arguments: &[&str], flights: u64, ends: &[&str]) {
    let mut campaign = std::process::Command::new(env!("CARGO_BIN_EXE_stampfly"));
    campaign.args(["campaign", "--mission", "random", "--vibration", "2", "--json"]).args(arguments);
    let output = campaign.args(["--flights", &flights.to_string()]).output().expect("it runs");
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let each = report["each"].as_array().expect("flights");
    assert_eq!(each.len() as u64, flights);
    for flight in each {
        let names = flight["alerts"].as_array().expect("alerts").iter().map(|alert| &alert["name"]);
        let found: Vec<_> =
            names.filter(|name| !["COMM_LOST", "LOW_BATTERY"].map(Into::into).contains(*name)).collect();
        let ends_well = flight["outcome"].as_str().is_some_and(|outcome| ends.contains(&outcome));
        assert!(
            found.is_empty() && ends_well,
            "seed {} {arguments:?}: {found:?} {}",
            flight["seed"],
            flight["outcome"]
        );
    }
}

/// In three of these flow was once reported as faulty: the comparison began with a reading of two frames.
#[test]
fn random_missions_at_twice_the_vibration_raise_no_alert() {
    fly_at_random(&["--gust", "0", "--seed", "18"], 10, &["transparent"]);
}

/// How any random mission in gusts ends without a fault: beside the path where nobody holds the place, and in ACRO when the battery
/// is low, since the simulated pilot is slow. Neither `refused`, `cut` nor `crashed`.
const ENDS: [&str; 4] = ["transparent", "degraded", "flown-away", "kept-on"];

/// Each of these seeds raised an alert when 5,000 were flown. `FLIGHTS=1000` flies as many for each way to fly, and takes some minutes.
#[test]
fn random_missions_in_gusts_raise_no_alert() {
    let flown: [(&str, &[&str]); 5] = [
        // Flow jumped near the floor, because vibration adds up to a velocity.
        ("program", &["368", "392", "956", "999"]),
        ("poshold", &["389"]),
        ("althold", &["392"]),
        // A range that repeats itself where the motors stop; a leg that sticks to the floor; a take-off that turns over a leg.
        ("stabilize", &["151", "213", "367", "476"]),
        ("acro", &["261", "564", "794"]),
    ];
    for (by, seeds) in flown {
        let pilot: &[&str] = if by == "program" { &[] } else { &["--pilot", "--mode", by] };
        let gusts = |seed| [&["--gust", "1", "--seed", seed], pilot].concat();
        seeds.iter().for_each(|seed| fly_at_random(&gusts(seed), 1, &["transparent", "degraded"]));
        if let Some(all) = crate::thorough::asked_for() {
            fly_at_random(&gusts("1"), all, &ENDS);
            println!("{by}: {all} flights, no alert but LOW_BATTERY, none refused");
        }
    }
}
