//! Flies one flight of a campaign and makes its row.

use super::case::Case;
use super::row::{IDLE, NEEDLESS_CUT, PANICKED, PASSED, Row, UNJUDGED, moment_of};
use crate::flown::{Flown, fly};
use crate::recorder::Recorder;
use serde::Deserialize;
use serde_json::Value;
use stampfly_log::FlightHash;
use stampfly_sim::fault::{Class, FAULT_ACTED};
use stampfly_sim::vehicle::{Options, SetupError, Vehicle, Verdict};
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
    #[serde(default)]
    reason: String,
    cut_in_air: Option<String>,
    /// Objects with the fault's text and when it began, or texts where that is not told.
    #[serde(default)]
    faults: Vec<Value>,
}

#[derive(Clone, Debug, Default, Deserialize)]
struct Named {
    name: String,
}

/// Flies it. A flight that panics is one that failed. The motors' cut in the air, if there is one,
/// [is judged](with_cut_judged).
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
        Ok((flown, hash)) => with_cut_judged::<V>(finished(row, &flown, hash), case),
        Err(_) => Row { verdict: PANICKED.into(), outcome: PANICKED.into(), ..row },
    })
}

/// The row, with its cut judged: a flight whose motors a protection stopped in the air is flown on
/// from there, and the end of that says whether the protection was right.
#[must_use]
pub fn with_cut_judged<V: Vehicle>(row: Row, case: &Case) -> Row {
    let flown_on = row.cut_by.as_ref().and_then(|_| fly_on::<V>(case));
    judged(row, flown_on)
}

/// How the flight ends that flies on where a protection stops the motors in the air. `None` when
/// the vehicle does not offer it, or flies so already.
fn fly_on<V: Vehicle>(case: &Case) -> Option<String> {
    let options = Options { flies_on: true, ..case.options.clone() };
    let setup = V::setup(&options, case.seed).ok().filter(|_| !case.options.flies_on)?;
    let flown = catch_unwind(AssertUnwindSafe(|| fly::<V>(&setup, &mut (), &mut |_, _| {})));
    Some(match flown {
        Ok(flown) => told(&flown.outcome)?.outcome,
        Err(_) => PANICKED.into(),
    })
}

/// The row with the end of the flight that flew on, and what that means for the verdict.
fn judged(row: Row, flown_on: Option<String>) -> Row {
    let acceptable = |end: &String| Class::ALL.iter().any(|class| class.name() == *end && class.may_be_acceptable());
    let verdict = match &flown_on {
        Some(end) if acceptable(end) && row.failed() => format!("{} {NEEDLESS_CUT}", row.verdict),
        Some(end) if acceptable(end) => NEEDLESS_CUT.to_owned(),
        _ => row.verdict.clone(),
    };
    Row { verdict, flown_on, ..row }
}

/// What a vehicle says of a flight. `None` when it does not judge it.
fn told<O: Verdict>(outcome: &O) -> Option<Findings> {
    // Numbers and texts always have a JSON form.
    let findings = serde_json::to_value(outcome.findings()).unwrap_or_default();
    serde_json::from_value(findings).ok()
}

/// The row of a flight that has been flown, with what came of it.
#[must_use]
pub fn finished<O: Verdict>(row: Row, flown: &Flown<O>, hash: u64) -> Row {
    let Some(findings) = told(&flown.outcome) else {
        return Row { verdict: UNJUDGED.into(), ..row };
    };
    let names: Vec<_> = findings.alerts.iter().map(|alert| alert.name.as_str()).collect();
    let never = findings.faults.iter().filter(|fault| fault.get("since").is_some_and(Value::is_null));
    let never: Vec<_> = never.filter_map(|fault| fault.get("fault")?.as_str().map(moment_of)).collect();
    Row {
        verdict: verdict(&findings),
        violations: findings.violations.join(" "),
        outcome: findings.outcome,
        reason: Some(findings.reason).filter(|reason| !reason.is_empty()),
        never_began: (!never.is_empty()).then(|| never.join("+")),
        cut_by: findings.cut_in_air,
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
