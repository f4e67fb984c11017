//! The printed figures, computed again from the log, by their documentation and nothing else.
//!
//! Works on the columns a plot would show: `truth`, `setpoint`, `estimate_state` and `flight_status` of the parsed ULog.

use crate::thorough::thorough;
use stampfly_board::simulation::metrics::FIGURES;
use stampfly_board::simulation::mission::{HOVER, Mission, REFERENCE};
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_host::flown::fly;
use stampfly_host::recorder::Recorder;
use stampfly_host::{Flight, flight::Series, flight_log};
use stampfly_types::{Duration, Instant};
use std::collections::BTreeMap;

const TAKE_OFF: f64 = 4.0;
const FLYING: f64 = 5.0;
const LANDING: f64 = 6.0;
const IDLE_GROUND: f64 = 1.0;
const POS_HOLD: f64 = 3.0;

/// What the four topics say at one instant.
struct Row {
    at: Instant,
    truth: [f64; 3],
    sink: f64,
    tilt_deg: f64,
    contact: bool,
    goal: [f64; 3],
    at_rest: bool,
    estimate: [f64; 3],
    phase: f64,
    mode: f64,
    armed: bool,
}

impl Row {
    fn holds_place(&self) -> bool {
        self.phase == FLYING && self.mode == POS_HOLD
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

fn column<'a>(series: &'a Series, name: &str) -> &'a [f64] {
    series.column(name).unwrap_or_else(|| panic!("no column {name}"))
}

fn vector(series: &Series, field: &str, index: usize) -> [f64; 3] {
    series.columns_of::<3>(field).expect("three of them").map(|column| column[index])
}

/// One row per sample of the truth, which is taken whenever there is a new set-point.
fn rows(flight: &Flight) -> Vec<Row> {
    let [truth, setpoint, estimate, mode] =
        ["truth", "setpoint", "estimate_state", "flight_status"].map(|topic| &flight.topics[topic]);
    let row = |(index, at): (usize, &Instant)| {
        let [s, e, m] = [setpoint, estimate, mode].map(|series| series.index_at(*at).expect("published before"));
        // The angle between body z and world z, from the third diagonal element of the rotation matrix.
        let [x, y] = ["attitude[1]", "attitude[2]"].map(|name| column(truth, name)[index]);
        let tilt_deg = 2.0 * x.hypot(y).asin().to_degrees();
        let velocity = vector(setpoint, "velocity", s);
        Row {
            at: *at,
            truth: vector(truth, "position", index),
            sink: vector(truth, "velocity", index)[2],
            tilt_deg,
            contact: column(truth, "contact")[index] != 0.0,
            goal: vector(setpoint, "position", s),
            at_rest: distance(velocity, [0.0; 3]) < 1e-3 && column(setpoint, "yaw_rate")[s].abs() < 1e-3,
            estimate: vector(estimate, "position", e),
            phase: column(mode, "phase")[m],
            mode: column(mode, "mode")[m],
            armed: column(mode, "armed")[m] != 0.0,
        }
    };
    truth.at.iter().enumerate().map(row).collect()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = values.map(|value| value * value).collect();
    assert!(!squares.is_empty());
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

fn highest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::NEG_INFINITY, f64::max)
}

/// Distance in the horizontal plane.
fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Every figure, by the table in the documentation of `metrics`.
fn recompute(rows: &[Row]) -> BTreeMap<&'static str, f64> {
    let holding = || rows.iter().filter(|row| row.holds_place());
    let mut figures = BTreeMap::new();
    figures.insert("pos_rms_m", rms(holding().map(|row| distance(row.truth, row.goal))));
    figures.insert("est_pos_rms_m", rms(holding().map(|row| distance(row.truth, row.estimate))));
    figures.insert("alt_rms_m", rms(holding().map(|row| row.truth[2] - row.goal[2])));

    // "highest truth above the take-off height, from take-off to three seconds into flight"
    let flying = rows.iter().find(|row| row.phase == FLYING).expect("it flew").at;
    let climbing =
        |row: &&Row| row.phase == TAKE_OFF || row.phase == FLYING && row.at.since(flying) < Duration::from_secs(3);
    let goal = rows.iter().rfind(|row| row.phase == TAKE_OFF).expect("it took off").goal[2];
    let goal =
        rows.iter().filter(|row| row.phase == FLYING).filter(climbing).map(|row| row.goal[2]).fold(goal, f64::min);
    let top = highest(rows.iter().filter(climbing).map(|row| -row.truth[2]));
    figures.insert("takeoff_overshoot_m", (top + goal).max(0.0));

    // "true sink rate at the last instant before the first contact of the landing"
    let touch = rows.windows(2).find(|pair| pair[1].phase == LANDING && pair[1].contact && !pair[0].contact);
    figures.insert("touchdown_speed_mps", touch.expect("it landed")[0].sink);

    // Stretches in which the set-point rested while in POS_HOLD.
    let rests: Vec<&[Row]> = rows
        .chunk_by(|a, b| (a.holds_place() && a.at_rest) == (b.holds_place() && b.at_rest))
        .filter(|stretch| stretch[0].holds_place() && stretch[0].at_rest)
        .collect();
    let settled =
        rests.iter().flat_map(|rest| rest.iter().filter(|row| row.at.since(rest[0].at) >= Duration::from_secs(1)));
    figures.insert("hover_tilt_max_deg", highest(settled.map(|row| row.tilt_deg)));
    let longest = rests.iter().max_by_key(|rest| rest[rest.len() - 1].at.since(rest[0].at)).expect("it rested");
    figures.insert("hover_drift_m", highest(longest.iter().map(|row| apart(row.truth, longest[0].truth))));

    let end = &rows[rows.len() - 1];
    assert!(end.phase == IDLE_GROUND && end.contact && !end.armed);
    figures.insert("land_error_m", apart(end.truth, [0.0; 3]));
    figures
}

fn check(mission: &str, seed: u64, change: impl Fn(&mut Setup)) {
    let mut setup = Setup::reference(seed);
    setup.mission = Mission::parse(mission).expect("a mission");
    change(&mut setup);
    let mut recorder = Recorder::<StampFly>::with_log(&setup, &[]);
    let flown = fly::<StampFly>(&setup, &mut recorder, &mut |_, _| {});
    let metrics = flown.outcome.metrics;
    assert!(metrics.landed && metrics.disarmed && flown.log_lost == 0);

    let log = flight_log::parse(recorder.log()).expect("a log");
    assert_eq!(log.omissions, []);
    let again = recompute(&rows(&log.flight));
    assert_eq!(again.len(), FIGURES.len(), "no figure is left out");
    for (name, _, printed) in FIGURES {
        let (printed, again) = (printed(&metrics).expect("the flight has it"), again[name]);
        assert!(
            (printed - again).abs() <= 1e-5 * again.abs().max(1e-3),
            "seed {seed}: {name} is printed as {printed}, the log says {again}"
        );
    }
}

#[test]
fn figures_of_the_square_are_what_the_log_says() {
    for seed in 1..=thorough(1, 4) {
        check(REFERENCE, seed, |_| {});
    }
}

#[test]
fn figures_of_a_hover_are_what_the_log_says() {
    check(HOVER, 5, |setup| setup.simulation.wind.gust = 0.8);
}

#[test]
fn figures_of_a_late_executor_are_what_the_log_says() {
    check(REFERENCE, 6, |setup| setup.jitter = Some(6));
}
