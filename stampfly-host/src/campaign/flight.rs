//! Flies one flight of a campaign and makes its row.

use super::case::Case;
use super::row::{IDLE, PANICKED, PASSED, Row, UNJUDGED};
use crate::flown::{Flown, fly};
use crate::recorder::Recorder;
use serde::Deserialize;
use stampfly_log::FlightHash;
use stampfly_sim::fault::FAULT_ACTED;
use stampfly_sim::vehicle::{SetupError, Vehicle, Verdict};
use stampfly_types::Instant;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a vehicle says of a flight with faults: the fields of [`Verdict::findings`] that campaigns know.
/// Without the first four there is no judgement.
#[derive(Clone, Debug, Deserialize)]
struct Findings {
    outcome: String,
    expected: Option<String>,
    as_expected: bool,
    violations: Vec<String>,
    max_height_m: Option<f64>,
    max_distance_m: Option<f64>,
    touch_speed_mps: Option<f64>,
    cut_after_s: Option<f64>,
    cut_height_m: Option<f64>,
    #[serde(default)]
    alerts: Vec<Named>,
}

#[derive(Clone, Debug, Default, Deserialize)]
struct Named {
    name: String,
}

/// Flies it. A flight that panics is one that failed.
///
/// # Errors
/// When the vehicle has no such flight.
pub fn fly_case<V: Vehicle>(case: &Case) -> Result<Row, SetupError> {
    let setup = V::setup(&case.options, case.seed)?;
    let row = Row { parameter_digest: digest::<V>(&setup), version: env!("CARGO_PKG_VERSION").into(), ..Row::of(case) };
    // Everything that a flight uses is its own: what a panic leaves behind is dropped.
    let flown = catch_unwind(AssertUnwindSafe(|| {
        let mut recorder = Recorder::<V>::hash_only();
        let flown = fly::<V>(&setup, &mut recorder, &mut |_, _| {});
        (flown, recorder.hash())
    }));
    Ok(match flown {
        Ok((flown, hash)) => finished(row, &flown, hash),
        Err(_) => Row { verdict: PANICKED.into(), outcome: PANICKED.into(), ..row },
    })
}

/// The row of a flight that has been flown, with what came of it.
#[must_use]
pub fn finished<O: Verdict>(row: Row, flown: &Flown<O>, hash: u64) -> Row {
    // Numbers and texts always have a JSON form.
    let findings = serde_json::to_value(flown.outcome.findings()).unwrap_or_default();
    let Ok(findings) = serde_json::from_value::<Findings>(findings) else {
        return Row { verdict: UNJUDGED.into(), ..row };
    };
    let names: Vec<_> = findings.alerts.iter().map(|alert| alert.name.as_str()).collect();
    Row {
        verdict: verdict(&findings),
        violations: findings.violations.join(" "),
        outcome: findings.outcome,
        expected: findings.expected.unwrap_or_default(),
        as_expected: findings.as_expected,
        max_height_m: findings.max_height_m,
        max_distance_m: findings.max_distance_m,
        touch_speed_mps: findings.touch_speed_mps,
        cut_after_s: findings.cut_after_s,
        cut_height_m: findings.cut_height_m,
        alerts: names.join(" "),
        duration_s: flown.duration.seconds_f64(),
        log_hash: format!("{hash:016x}"),
        figures: flown.outcome.figures().iter().map(|figure| (figure.name.into(), figure.value)).collect(),
        ..row
    }
}

fn verdict(findings: &Findings) -> String {
    let Findings { outcome, as_expected, violations, .. } = findings;
    let mut wrong: Vec<&str> = if *as_expected { Vec::new() } else { vec![outcome] };
    wrong.extend(violations.iter().map(String::as_str).filter(|name| *name != FAULT_ACTED));
    match (wrong.is_empty(), violations.is_empty()) {
        (false, _) => wrong.join(" "),
        (true, false) => IDLE.into(),
        (true, true) => PASSED.into(),
    }
}

/// Hash over every parameter of the flight stack and every number of the simulated vehicle.
#[must_use]
pub fn digest<V: Vehicle>(setup: &V::Setup) -> String {
    let mut hash = FlightHash::new();
    for (topic, settings) in [V::parameters(V::config(setup)), V::plant(setup)].iter().enumerate() {
        for (place, setting) in settings.iter().enumerate() {
            let bits = setting.value.to_bits();
            let mut words = vec![bits as u32, (bits >> 32) as u32];
            words.extend(setting.name.bytes().map(u32::from));
            hash.publish(topic as u16, place as u32, Instant::ZERO, &words);
        }
    }
    format!("{:016x}", hash.finish())
}
