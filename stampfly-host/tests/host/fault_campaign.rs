//! Campaigns of faults: the same flights however they are divided, files that are whole or missing, the smallest form of a
//! failure, and a flight again from its row.

use proptest::prelude::*;
use serde_json::Value;
use stampfly_board::simulation::StampFly;
use stampfly_host::campaign::case::{Case, Cases, Plan};
use stampfly_host::campaign::flight::fly_case;
use stampfly_host::campaign::rate::Rate;
use stampfly_host::campaign::row::{Column, IDLE, Kind, NEEDLESS_CUT, PASSED, Row};
use stampfly_host::campaign::shard::Shard;
use stampfly_host::campaign::shrink::shrink;
use stampfly_host::campaign::summary::Summary;
use stampfly_host::campaign::{file, parallel};
use stampfly_sim::fault::{Fault, FaultValue, Moment};
use stampfly_sim::vehicle::{Options, Vehicle};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A mission that is over soon.
const HOP: &str = "arm; takeoff 0.3; land";

fn plan(flights: u64, pairs: bool) -> Plan {
    Plan { seed: 7, flights, pairs, drawn: false, only: Vec::new(), options: Options::default() }
}

fn cases(plan: &Plan) -> Cases {
    Cases::new::<StampFly>(plan).expect("a campaign")
}

/// The moments that come in some mission of a campaign, in each mode.
fn comes(options: &Options) -> Vec<Vec<Moment>> {
    let modes = [None].into_iter().chain(StampFly::VARIETY.modes.iter().copied().map(Some));
    let variety = StampFly::VARIETY;
    let missions: Vec<Option<&str>> = match options.mission {
        Some(_) => vec![None],
        None => variety.missions.iter().chain(variety.occasions).copied().map(Some).collect(),
    };
    let of_mode = |mode: Option<&str>| {
        let comes = missions.iter().flat_map(|mission| {
            let mission = mission.map(str::to_owned).or_else(|| options.mission.clone());
            StampFly::moments(&Options { mission, pilot: mode.map(str::to_owned), ..Options::default() }, 1)
        });
        let comes: Vec<_> = comes.collect();
        Moment::ALL.into_iter().filter(|moment| comes.contains(moment)).collect()
    };
    modes.map(of_mode).collect()
}

/// An empty folder of this test's own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fault_campaign").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the target folder can be written");
    folder
}

struct Ran {
    code: i32,
    out: String,
    err: String,
}

fn stampfly(folder: &Path, line: &[&str]) -> Ran {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stampfly"));
    for (name, _) in stampfly_host::campaign::shard::VARIABLES {
        command.env_remove(name);
    }
    let output = command.current_dir(folder).args(line).output().expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    Ran { code: output.status.code().expect("an exit code"), out: text(output.stdout), err: text(output.stderr) }
}

fn json(ran: &Ran) -> Value {
    serde_json::from_str(&ran.out).unwrap_or_else(|_| panic!("{}{}", ran.out, ran.err))
}

#[test]
fn the_first_flights_are_every_fault_at_every_moment_in_every_mode() {
    let cases = cases(&plan(0, false));
    let all = cases.cells();
    let cell = |index| {
        let Options { fault, pilot, mission, .. } = cases.case(index as u64).options;
        (fault, pilot, mission)
    };
    let cells: BTreeSet<_> = (0..all).map(cell).collect();
    assert_eq!(cells.len(), all, "no cell twice");
    let comes = comes(&Options::default());
    let faulted = cells.iter().filter(|(fault, ..)| !fault.is_empty()).count();
    assert_eq!(faulted, StampFly::FAULTS.len() * comes.iter().map(Vec::len).sum::<usize>());
    assert_eq!(comes.concat().iter().map(|moment| moment.name()).collect::<BTreeSet<_>>().len(), Moment::ALL.len());
    // First every mission without a fault, in every mode.
    let nominal = (0..all).take_while(|index| cell(*index).0.is_empty()).count();
    assert_eq!((nominal + faulted, (10..40).contains(&nominal)), (all, true), "{nominal}");
    // A campaign that is cut short has seen every fault and every moment of a program's flights.
    let soon: Vec<_> =
        (nominal..nominal + StampFly::FAULTS.len()).map(|index| Row::of(&cases.case(index as u64))).collect();
    assert_eq!(soon.iter().map(|row| &row.fault).collect::<BTreeSet<_>>().len(), StampFly::FAULTS.len());
    assert_eq!(soon.iter().map(|row| &row.phase).collect::<BTreeSet<_>>().len(), comes[0].len());
}

#[test]
fn every_flight_has_a_mission_in_which_its_moments_come() {
    let cells = cases(&plan(0, true));
    let drawn = cases(&Plan { drawn: true, ..plan(0, true) });
    let all = (0..cells.cells() as u64).map(|index| cells.case(index));
    for case in all.chain((0..2_000).map(|index| drawn.case(index))) {
        let comes = StampFly::moments(&case.options, case.seed);
        for phase in Row::of(&case).phase.split('+').filter(|phase| !["", "time"].contains(phase)) {
            assert!(comes.iter().any(|moment| moment.name() == phase), "{}", case.line());
        }
    }
}

#[test]
fn a_campaign_with_a_mission_has_the_moments_of_that_one() {
    let options = Options { mission: Some("arm; takeoff 1.5; hover 2; flip left; land".into()), ..Options::default() };
    let cases = cases(&Plan { options: options.clone(), ..plan(0, false) });
    let phases: BTreeSet<_> = (0..cases.cells()).map(|index| Row::of(&cases.case(index as u64)).phase).collect();
    assert!(phases.contains("flip") && !phases.contains("chop") && !phases.contains("move"), "{phases:?}");
    let faults: usize = comes(&options).iter().map(|moments| moments.len() * StampFly::FAULTS.len()).sum();
    assert_eq!(cases.cells(), faults + 1 + StampFly::VARIETY.modes.len());
}

#[test]
fn confined_to_two_faults_all_flights_walk_through_their_cells_again_and_again() {
    let only = ["tof-stuck=0.03", "flow-bias"].map(String::from).to_vec();
    let cases = cases(&Plan { only, ..plan(0, false) });
    let round = 2 * comes(&Options::default()).iter().map(Vec::len).sum::<usize>();
    assert_eq!(cases.cells(), round);
    let cell = |index: usize| {
        let case = cases.case(index as u64);
        (case.options.fault[0].clone(), case.options.pilot, case.seed)
    };
    let first: BTreeSet<_> = (0..round).map(cell).map(|(fault, pilot, _)| (fault, pilot)).collect();
    assert_eq!(first.len(), round, "no cell twice");
    assert!(first.contains(&("tof-stuck=0.03@hover".into(), Some("acro".into()))), "{first:?}");
    let ((fault, pilot, seed), (again, too, another)) = (cell(3), cell(3 + round));
    assert_eq!((fault, pilot), (again, too));
    assert_ne!(seed, another);
    let line = ["campaign", "--faults", "--flights", "4", "--only", "tof-stuck,nothing"];
    let wrong = stampfly(&folder("only"), &line);
    assert!(wrong.code != 0 && wrong.err.contains("nothing"), "{}", wrong.err);
}

#[test]
fn random_flights_can_be_confined_to_faults_of_some_kinds() {
    let only = ["tof-stuck", "flow-bias"].map(String::from).to_vec();
    let cases = cases(&Plan { drawn: true, only, ..plan(0, false) });
    assert_eq!(cases.cells(), 0);
    let faults: Vec<_> = (0..200).flat_map(|index| cases.case(index).options.fault).collect();
    let count = |name: &str| faults.iter().filter(|fault| fault.starts_with(name)).count();
    let (stuck, bias) = (count("tof-stuck"), count("flow-bias"));
    assert_eq!(stuck + bias, faults.len());
    assert!(stuck > 60 && bias > 60 && faults.len() < 200, "{stuck} and {bias}, and some without one");
    let line = ["campaign", "--faults", "--flights", "4", "--drawn", "--only", "tof-stuck=0.03"];
    let wrong = stampfly(&folder("drawn-only"), &line);
    assert!(wrong.code != 0 && wrong.err.contains("sizes are drawn"), "{}", wrong.err);
}

#[test]
fn random_flights_can_be_flown_and_vary() {
    let cases = cases(&plan(0, true));
    let drawn: Vec<_> = (0..2_000).map(|index| cases.case(cases.cells() as u64 + index)).collect();
    for case in &drawn {
        StampFly::setup(&case.options, case.seed).expect("a flight");
    }
    let share = |holds: &dyn Fn(&Case) -> bool| drawn.iter().filter(|case| holds(case)).count() as f64 / 2_000.0;
    let near = |share: f64, expected: f64| (share - expected).abs() < 0.05;
    assert!(near(share(&|case| case.options.fault.is_empty()), 0.1));
    assert!(near(share(&|case| case.options.fault.len() == 2), 0.45));
    assert!(near(share(&|case| case.options.pilot.is_none()), 0.2));
    let missions = StampFly::VARIETY.missions.len() + StampFly::VARIETY.occasions.len();
    assert!(near(share(&|case| case.options.mission.as_deref() == Some("random")), 1.0 / missions as f64));
    assert!(near(share(&|case| case.options.fault.first().is_some_and(|fault| fault.contains('+'))), 0.45));
    let lone = self::cases(&plan(0, false));
    assert!((0..500).all(|index| lone.case(lone.cells() as u64 + index).options.fault.len() <= 1));
    // A campaign of drawn flights has the same from its first on.
    let all = self::cases(&Plan { drawn: true, ..plan(0, true) });
    assert_eq!(all.cells(), 0);
    let first = Plan { seed: 7 + cases.cells() as u64, drawn: true, ..plan(0, true) };
    assert_eq!(self::cases(&first).case(0).arguments(), drawn[0].arguments());
}

/// Sizes of each fault in drawn flights, as shares of the logarithm of its range.
fn shares(flights: u64) -> BTreeMap<&'static str, Vec<f64>> {
    let cases = cases(&Plan { drawn: true, ..plan(0, true) });
    let mut shares: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for text in (0..flights).flat_map(|index| cases.case(index).options.fault) {
        let fault = Fault::parse(&text, StampFly::FAULTS).expect("a fault");
        let (Some(sizes), Some(value)) = (fault.kind.sizes, fault.value) else { continue };
        let [low, high] = sizes.range;
        // Three digits, and a reciprocal of them.
        let size = sizes.measure.size(value);
        assert!((low * 0.99..=high * 1.01).contains(&size), "{text}");
        shares.entry(fault.kind.name).or_default().push((size / low).ln() / (high / low).ln());
    }
    shares
}

#[test]
fn sizes_are_drawn_evenly_in_their_logarithm() {
    let shares = shares(20_000);
    let sized = StampFly::FAULTS.iter().filter(|kind| kind.sizes.is_some()).count();
    assert_eq!(shares.len(), sized);
    for (fault, mut shares) in shares.clone() {
        shares.sort_by(f64::total_cmp);
        let n = shares.len() as f64;
        let apart = shares.iter().enumerate().map(|(place, share)| (share - (place as f64 + 0.5) / n).abs());
        let apart = apart.fold(0.0, f64::max);
        // Kolmogorov and Smirnov: by chance one fault in a hundred is beyond 1.63/√n, and one in eight
        // thousand beyond 2.2/√n.
        assert!(n > 100.0 && apart < 2.2 / n.sqrt(), "{fault}: {apart} with {n} sizes");
    }
    // All together, by tenths.
    let all: Vec<_> = shares.into_values().flatten().collect();
    for tenth in 0..10 {
        let count = all.iter().filter(|share| ((**share * 10.0) as usize).min(9) == tenth).count() as f64;
        assert!((0.9..1.1).contains(&(count * 10.0 / all.len() as f64)), "{tenth}: {count} of {}", all.len());
    }
}

#[test]
fn every_fault_with_a_number_has_plausible_sizes() {
    let mut noise = stampfly_sim::Noise::new(1, 1);
    for table in
        [StampFly::FAULTS, stampfly_stm32_quad::simulation::faults::FAULTS, stampfly_plane::simulation::faults::FAULTS]
    {
        for kind in table {
            let (Some([low, high]), Some(sizes)) = (kind.value.range(), kind.sizes) else {
                assert_eq!((kind.value, kind.sizes), (FaultValue::None, None), "{}", kind.name);
                continue;
            };
            let [smallest, largest] = sizes.range;
            assert!(0.0 < smallest && smallest < largest && sizes.reason.contains(" to "), "{}", kind.name);
            for _ in 0..200 {
                let value = sizes.draw(&mut noise);
                assert!((low..=high).contains(&value), "{}: {value}", kind.name);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_flight_does_not_depend_on_how_the_campaign_is_divided(count in 1u64..50, index in 0u64..100_000) {
        let one = cases(&plan(100_000, true));
        // Another plan in the number of flights is the same flight, too.
        let other = cases(&plan(index + 1, true));
        let shard = Shard::new(index % count, count).expect("a shard");
        prop_assert!(shard.flights(100_000).any(|flight| flight == index));
        prop_assert_eq!(one.case(index).arguments(), other.case(index).arguments());
    }

    #[test]
    fn a_case_survives_its_row(index in 0u64..100_000, cameras: bool, wind in prop::option::of((-5f32..5.0, -5f32..5.0))) {
        let options = Options {
            cameras,
            wind: wind.map(|(north, east)| [north, east]),
            plant: vec!["mass=0.04".into()],
            ..Options::default()
        };
        let cases = cases(&Plan { options, ..plan(0, true) });
        let case = cases.case(index);
        let again = Row::of(&case).case().expect("a case");
        prop_assert_eq!(again.arguments(), case.arguments());
        prop_assert_eq!((again.index, again.seed), (case.index, case.seed));
    }
}

#[test]
fn rows_survive_a_file() {
    let path = folder("rows").join("rows.parquet");
    let cases = cases(&plan(0, true));
    let rows: Vec<Row> = (0..500)
        .map(|index| Row {
            seed: u64::MAX - index,
            as_expected: index % 3 == 0,
            verdict: "fell «hard»".into(),
            max_height_m: (index % 2 == 0).then_some(0.1 + index as f64),
            duration_s: f64::from_bits(index),
            figures: vec![("a_m".into(), Some(index as f64)), ("b_m".into(), None)],
            ..Row::of(&cases.case(17 * index))
        })
        .collect();
    file::write(&path, "identity", &rows).expect("written");
    let read = file::read(&path).expect("read");
    assert_eq!((read.identity.as_str(), read.rows.len()), ("identity", 500));
    assert_eq!(read.rows, rows);
    file::write(&path, "nothing", &[]).expect("written");
    assert_eq!(file::read(&path).expect("read").rows, []);
    let left: Vec<_> = fs::read_dir(path.parent().expect("a folder")).expect("a folder").collect();
    assert_eq!(left.len(), 1, "no other file is left");
}

/// Columns that may be empty, and that files of version 0.2 do not have.
#[test]
fn rows_of_an_earlier_version_are_read() {
    let row = Row { seed: 3, reason: Some("it fell".into()), flown_on: Some("landed".into()), ..Row::default() };
    let without = |missing: &[&str]| {
        let named = Row::common().into_iter().map(|column| column.name).zip(row.values());
        Row::from_values(named.filter(|(name, _)| !missing.contains(&name.as_str())))
    };
    let new = ["reason", "never_began", "cut_by", "flown_on"];
    assert_eq!(without(&new), Ok(Row { seed: 3, ..Row::default() }));
    assert_eq!(without(&[]), Ok(row.clone()));
    assert_eq!(without(&["outcome"]), Err("there is no column outcome".into()));
}

#[test]
fn damaged_files_are_refused_with_their_name() {
    let path = folder("damaged").join("rows.parquet");
    file::write(&path, "identity", &[Row::default()]).expect("written");
    let whole = fs::read(&path).expect("read");
    for length in [0, 1, 8, whole.len() / 2, whole.len() - 1] {
        fs::write(&path, &whole[..length]).expect("written");
        let error = file::read(&path).expect_err("damaged");
        assert!(
            !error.is_missing() && error.to_string().contains("rows.parquet is no complete Parquet file"),
            "{error}"
        );
    }
    assert!(file::read(&path.with_extension("none")).expect_err("nothing there").is_missing());
    assert!(file::write(&path.join("x/y"), "", &[]).expect_err("no folder").to_string().contains("cannot be written"));
}

/// A flight that passes, for a failure that is made up.
fn passing() -> Case {
    let options = Options {
        fault: vec!["baro-silent@takeoff+2.5".into(), "tof-outliers=0.07@3.25+1".into()],
        pilot: Some("poshold".into()),
        gust: Some(0.4),
        jitter: Some(5),
        ..Options::default()
    };
    Case { vehicle: "stampfly".into(), index: 0, seed: 31, options }
}

#[test]
fn a_failure_shrinks_to_what_it_needs() {
    // Impossible to satisfy: no flight with a silent barometer may climb.
    let fails = |case: &Case| {
        let row = fly_case::<StampFly>(case).expect("a flight");
        row.fault.contains("baro-silent") && row.max_height_m.is_some_and(|height| height > 0.2)
    };
    let mut flights = 0;
    let smallest = shrink::<StampFly>(&passing(), &mut |case| {
        flights += 1;
        fails(case)
    });
    assert!(fails(&smallest));
    assert_eq!(
        smallest.line(),
        "stampfly fly --seed 1 --mission 'arm; takeoff 0.5; land' --fault baro-silent@takeoff+0.05 --gust 0 --vibration 0"
    );
    assert!(flights <= 60, "{flights}");
}

#[test]
fn what_is_needed_stays() {
    // Every part is needed: nothing is made smaller.
    let case = passing();
    let mut fails = |smaller: &Case| smaller.arguments() == case.arguments();
    assert_eq!(shrink::<StampFly>(&case, &mut fails).arguments(), case.arguments());
    // Only the value is.
    let value = |case: &Case| {
        let faults = case.options.fault.iter().filter_map(|text| Fault::parse(text, StampFly::FAULTS).ok());
        faults.filter_map(|fault| fault.value).next()
    };
    let smallest = shrink::<StampFly>(&case, &mut |case| value(case) == Some(0.07));
    assert_eq!(smallest.options.fault, ["tof-outliers=0.07@calibration+0.05"]);
}

#[test]
fn failures_are_grouped_and_cells_counted() {
    let row = |fault: &str, phase: &str, verdict: &str, outcome: &str| Row {
        fault: fault.into(),
        phase: phase.into(),
        faults: format!("{fault}@{phase}"),
        verdict: verdict.into(),
        outcome: outcome.into(),
        as_expected: verdict != outcome,
        violations: if verdict.contains("I7") { "I7".into() } else { String::new() },
        ..Row::default()
    };
    let rows = [
        row("imu-silent", "hover", PASSED, "landed"),
        row("imu-silent", "hover", "kept-on", "kept-on"),
        row("imu-silent", "hover", "kept-on", "kept-on"),
        row("imu-silent", "move", "I7", "cut"),
        row("hand", "ground", IDLE, "transparent"),
        row("hand+wall", "hover+move", PASSED, "landed"),
    ];
    let summary = Summary::of(&rows);
    let all = &summary.all;
    assert_eq!((all.flights, all.failed, all.wrong, all.violated, all.idle), (6, 3, 2, 1, 1));
    let kinds: Vec<_> = summary.failures.iter().map(|failure| (failure.verdict.as_str(), failure.flights)).collect();
    assert_eq!(kinds, [("kept-on", 2), ("I7", 1)]);
    assert!(summary.failures[0].line.ends_with("--fault imu-silent@hover"));
    assert_eq!(summary.pairs.len(), 1);
    let csv = summary.csv(StampFly::FAULTS);
    assert!(csv.contains("imu-silent,hover,3,0,2,0,2,kept-on,0,0,") && csv.lines().count() == 4, "{csv}");
}

#[test]
fn flights_without_a_fault_and_cuts_are_counted_apart() {
    let row = |fault: &str, verdict: &str, cut_by: Option<&str>, flown_on: Option<&str>| Row {
        fault: fault.into(),
        phase: if fault.is_empty() { String::new() } else { "hover".into() },
        faults: if fault.is_empty() { String::new() } else { format!("{fault}@hover") },
        verdict: verdict.into(),
        outcome: "cut".into(),
        as_expected: true,
        cut_by: cut_by.map(str::to_owned),
        flown_on: flown_on.map(str::to_owned),
        never_began: (verdict == IDLE).then(|| "flip".into()),
        ..Row::default()
    };
    let rows = [
        row("", PASSED, None, None),
        row("", "landed", None, None),
        row("wall", PASSED, Some("IMPACT"), Some("crashed")),
        row("wall", NEEDLESS_CUT, Some("IMPACT"), Some("landed")),
        row("wall", PASSED, Some("IMPACT"), None),
        row("hand", IDLE, None, None),
    ];
    let summary = Summary::of(&rows);
    assert_eq!((summary.nominal.flights, summary.nominal.failed), (2, 1));
    assert_eq!(summary.nominal.failing(), Rate::of(1, 2));
    assert_eq!((summary.faulted.flights, summary.faulted.idle, summary.faulted.failing()), (4, 1, Rate::of(1, 3)));
    assert_eq!(summary.all.needless_cuts(), Rate::of(1, 2), "of the third nothing is known");
    assert_eq!(summary.cuts["IMPACT"].needless_cuts(), Rate::of(1, 2));
    assert_eq!(summary.needless_by_fault()["wall"], Rate::of(1, 2));
    assert_eq!(summary.never_began["flip"], 1);
    assert!(!summary.cells.contains_key(&(String::new(), String::new())), "no fault is none of the table");
    assert!(summary.csv(StampFly::FAULTS).contains("\nnone,,2,0,0,0,1,"));
}

#[test]
fn shards_and_one_run_give_the_same_rows() {
    let here = folder("shards");
    let rows = |arguments: &[&str], out: &str| {
        let common = ["campaign", "--faults", "--flights", "9", "--mission", HOP, "--json", "--out", out];
        let ran = stampfly(&here, &[&common, arguments].concat());
        assert!(ran.code < 2, "{}", ran.err);
        json(&ran)
    };
    rows(&["--threads", "1"], "one");
    for index in ["0/4", "1/4", "2/4", "3/4"] {
        rows(&["--shard", index], "four");
    }
    let all = |out: &str| {
        let files = fs::read_dir(here.join(out)).expect("a folder").filter_map(|entry| Some(entry.ok()?.path()));
        let files = files.filter(|path| path.extension().is_some_and(|extension| extension == "parquet"));
        let rows = files.flat_map(|path| file::read(&path).expect("rows").rows);
        rows.map(|row| (row.index, row)).collect::<BTreeMap<_, _>>()
    };
    let (one, four) = (all("one"), all("four"));
    assert_eq!((one.len(), &one), (9, &four));
    assert!(one.values().all(|row| row.log_hash.len() == 16 && row.figures.len() >= 8));

    // Whole files are kept; a damaged one is flown again, and only that.
    let damaged = here.join("four/shard-2-of-4.parquet");
    let whole = fs::read(&damaged).expect("a shard");
    fs::write(&damaged, &whole[..whole.len() / 2]).expect("written");
    let summary = rows(&["--shards", "4"], "four");
    assert_eq!((summary["kept"].as_u64(), summary["flights"].as_u64()), (Some(7), Some(9)));
    assert_eq!(all("four"), one);
    assert_eq!(fs::read(&damaged).expect("a shard"), whole);
    for name in ["campaign.html", "campaign.csv"] {
        assert!(fs::read_to_string(here.join("four").join(name)).expect("a table").contains("imu-silent"), "{name}");
    }

    // Nothing of another campaign is overwritten.
    let other = stampfly(&here, &["campaign", "--faults", "--flights", "9", "--seed", "2", "--out", "one"]);
    assert!(other.code == 2 && other.err.contains("is of another campaign: plan"), "{}", other.err);

    // A flight again from its row; a row that was changed is noticed.
    let again =
        |file: &str, row: &str| stampfly(&here, &["fly", "--from", file, "--row", row, "--json", "--out", "again"]);
    let same = again("four/shard-1-of-4.parquet", "1");
    assert_eq!((same.code, json(&same)["same"].as_bool()), (0, Some(true)), "{}", same.err);
    assert_eq!(json(&same)["log_hash"].as_str(), Some(one[&5].log_hash.as_str()));
    let mut contents = file::read(&here.join("four/shard-1-of-4.parquet")).expect("rows");
    contents.rows[1].log_hash = "0123456789abcdef".into();
    file::write(&here.join("changed.parquet"), &contents.identity, &contents.rows).expect("written");
    let changed = again("changed.parquet", "1");
    assert_eq!((changed.code, json(&changed)["same"].as_bool()), (1, Some(false)));
    let beyond = again("changed.parquet", "3");
    assert!(beyond.code == 2 && beyond.err.contains("has rows 0 to 1"), "{}", beyond.err);
}

#[test]
fn rows_do_not_depend_on_threads() {
    let cases = cases(&Plan { options: Options { mission: Some(HOP.into()), ..Options::default() }, ..plan(6, false) });
    let rows = |threads| parallel::each(6, threads, &|index| fly_case::<StampFly>(&cases.case(index as u64)).ok());
    assert_eq!(rows(1), rows(3));
    assert_eq!(parallel::workers(5, NonZero::new(2)), 2);
}

/// Lets bash run one task of a Slurm script, as Slurm does. Slurm runs on no Windows.
#[cfg(unix)]
fn task(script: &str, index: &str) -> std::process::Output {
    let mut bash = Command::new("bash");
    bash.arg(script).env("SLURM_ARRAY_TASK_ID", index).env_remove("HQ_TASK_ID").output().expect("bash starts")
}

#[test]
fn a_slurm_script_has_a_task_for_each_shard() {
    let here = folder("slurm_script");
    let ran = stampfly(&here, &["campaign", "--faults", "--shards", "3", "--engine", "slurm", "--json"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let text = fs::read_to_string(json(&ran)["script"].as_str().expect("a script")).expect("a script");
    assert!(text.contains("\n#SBATCH --array=0-2\n"), "{text}");
}

#[test]
#[cfg(unix)]
fn a_slurm_script_flies_a_shard() {
    let here = folder("slurm");
    let line = ["campaign", "--faults", "--flights", "4", "--shards", "3", "--mission", HOP, "--out", "out dir"];
    let ran = stampfly(&here, &[&line[..], &["--engine", "slurm", "--json"]].concat());
    assert_eq!(ran.code, 0, "{}", ran.err);
    let script = json(&ran)["script"].as_str().expect("a script").to_owned();
    for index in ["0", "1", "2"] {
        let task = task(&script, index);
        assert!(task.status.success(), "{}", String::from_utf8_lossy(&task.stderr));
    }
    let summary = json(&stampfly(&here, &[&line[..], &["--json"]].concat()));
    assert_eq!((summary["kept"].as_u64(), summary["flights"].as_u64()), (Some(4), Some(4)));
}

#[test]
#[cfg(unix)]
fn tasks_of_an_engine_are_confined_to_the_same_faults() {
    let here = folder("only_slurm");
    let line = ["campaign", "--faults", "--flights", "2", "--only", "tof-stuck=0.03,flow-bias", "--mission", HOP];
    let ran = stampfly(&here, &[&line[..], &["--engine", "slurm", "--json"]].concat());
    assert_eq!(ran.code, 0, "{}", ran.err);
    let script = json(&ran)["script"].as_str().expect("a script").to_owned();
    assert!(task(&script, "0").status.success());
    let rows = file::read(&here.join("campaign/shard-0-of-1.parquet")).expect("rows").rows;
    let faults: Vec<_> = rows.iter().map(|row| row.faults.split('@').next().unwrap_or_default()).collect();
    assert_eq!(faults, ["tof-stuck=0.03", "flow-bias"]);
}

/// Stands in for HyperQueue's program, which runs on no Windows: notes how it is called, and runs
/// the tasks of the array one after the other.
#[cfg(unix)]
const STAND_IN: &str = r#"#!/bin/bash
echo "$@" > called
while [ "$1" != --array ]; do shift; done
array=$2
while [ "$1" != -- ]; do shift; done
shift
for part in ${array//,/ }; do
    for HQ_TASK_ID in $(seq ${part%-*} ${part#*-}); do
        export HQ_TASK_ID
        "$@" >/dev/null
    done
done
"#;

#[test]
#[cfg(unix)]
fn hyperqueue_flies_the_shards_that_are_missing() {
    use std::os::unix::fs::PermissionsExt;
    let here = folder("hyperqueue");
    let line = ["campaign", "--faults", "--flights", "5", "--mission", HOP, "--json", "--out", "out"];
    stampfly(&here, &[&line[..], &["--shard", "2/5"]].concat());
    let program = here.join("hq");
    fs::write(&program, STAND_IN).expect("written");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("may be run");
    let path = format!("{}:{}", here.display(), std::env::var("PATH").unwrap_or_default());
    let mut command = Command::new(env!("CARGO_BIN_EXE_stampfly"));
    command.current_dir(&here).env("PATH", path).args(line).args(["--shards", "5", "--engine", "hq"]);
    let output = command.output().expect("the program starts");
    let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((summary["kept"].as_u64(), summary["flights"].as_u64()), (Some(1), Some(5)));
    let called = fs::read_to_string(here.join("called")).expect("called");
    assert!(called.contains("--array 0-1,3-4 ") && called.contains("--shard auto/5"), "{called}");

    // One that flies nothing is not believed.
    fs::write(&program, "#!/bin/bash\necho no server >&2\n").expect("written");
    let output = command.args(["--again"]).output().expect("the program starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.code() == Some(1) && said.contains("5 of 5 shards missing") && said.contains("no server"),
        "{said}"
    );
}

#[test]
fn mistakes_are_named() {
    let here = folder("mistakes");
    let check = |line: &[&str], code: i32, says: &str| {
        let ran = stampfly(&here, line);
        assert!(ran.code == code && ran.err.contains(says), "{line:?}: {} {}", ran.code, ran.err);
    };
    // Each system says it in its own words.
    let missing = fs::read(here.join("none")).expect_err("no file").to_string();
    check(&["campaign", "--faults", "--shard", "3"], 2, "'3' is no shard: I/N, with I from 0 to N - 1");
    check(&["campaign", "--faults", "--shard", "4/4"], 2, "there is no shard 4 of 4");
    check(&["campaign", "--faults", "--shard", "auto/4"], 2, "this is no task of an array");
    check(&["campaign", "--shards", "4"], 2, "--faults");
    check(&["campaign", "--faults", "--fault", "hand@hover"], 2, "cannot be used with");
    check(&["campaign", "--faults", "--mission", "none"], 2, &format!("mission none: {missing}"));
    check(&["campaign", "--faults", "--vehicle", "rover"], 2, "nothing can go wrong in a flight of rover");
    check(&["fly", "--from", "x.parquet"], 2, "--row");
    let says = format!("x.parquet cannot be read: {missing}");
    check(&["fly", "--from", "x.parquet", "--row", "0"], 2, &says);
    fs::write(here.join("file"), "PAR1 no PAR1").expect("written");
    check(&["fly", "--from", "file", "--row", "0"], 2, "file is no complete Parquet file");
    check(&["campaign", "--faults", "--flights", "1", "--out", "file"], 2, "--out file: ");
    let mut alone = Command::new(env!("CARGO_BIN_EXE_stampfly"));
    alone.current_dir(&here).env("PATH", &here).args(["campaign", "--faults", "--flights", "1", "--engine", "hq"]);
    let alone = alone.output().expect("the program starts");
    let said = String::from_utf8_lossy(&alone.stderr).into_owned();
    assert!(alone.status.code() == Some(2) && said.contains("--engine hq needs HyperQueue in PATH"), "{said}");
}

#[test]
fn the_document_lists_the_columns() {
    let document = include_str!("../../../docs/guide/campaigns.md");
    for Column { name, kind, is_optional, meaning } in Row::common() {
        let kind = match kind {
            Kind::Integer => "UBIGINT",
            Kind::Number => "DOUBLE",
            Kind::Flag => "BOOLEAN",
            Kind::Text => "VARCHAR",
        };
        let empty = if is_optional { ", may be empty" } else { "" };
        let line = format!("| `{name}` | {kind}{empty} | {meaning} |\n");
        assert!(document.contains(&line), "docs/guide/campaigns.md lacks\n{line}");
    }
    for (name, _) in stampfly_host::campaign::shard::VARIABLES {
        assert!(document.contains(&format!("| `{name}` |")), "{name}");
    }
}
