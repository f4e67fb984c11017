//! How flights without a fault end: one judgement for `fly`, `campaign` and `hil`, in text, JSON and exit code.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A flight: options, how it ends, and words of the reason.
struct Case {
    options: &'static [&'static str],
    outcome: &'static str,
    words: &'static str,
}

const CASES: [Case; 5] = [
    Case {
        options: &["--seed", "4", "--mission", "arm; takeoff 0.5; hover 2; land", "--wind", "12,0"],
        outcome: "flown-away",
        words: "beside the path that was commanded",
    },
    Case {
        options: &["--seed", "4", "--mission", "arm; takeoff 0.5; hover 2; land", "--plant", "mass=0.07"],
        outcome: "landed",
        words: "never left the ground: NO_LIFT",
    },
    Case {
        options: &[
            "--seed",
            "880641",
            "--mission",
            "arm; takeoff 0.5; hover 2; land",
            "--gust",
            "1",
            "--plant",
            "battery_resistance=0.3",
        ],
        outcome: "landed",
        words: "never left the ground: NO_LIFT",
    },
    // Rotors of a bad bag: it turns over as it takes off.
    Case {
        options: &["--seed", "5", "--mission", "arm; takeoff 0.5; hover 2; land", "--plant", "manufacturing_spread=5"],
        outcome: "crashed",
        words: "TUMBLED",
    },
    // Gusts that nothing of its weight holds.
    Case {
        options: &["--seed", "880303", "--mission", "arm; takeoff 0.5; hover 2; goto 1 0 0.7; land", "--gust", "6"],
        outcome: "flown-away",
        words: "beside the path",
    },
];

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("verdicts").join(name);
    std::fs::create_dir_all(&folder).expect("the target folder can be written");
    folder
}

/// Exit code, and what it printed.
fn run(folder: &Path, arguments: &[&[&str]]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stampfly"));
    let output = command.current_dir(folder).args(arguments.concat()).output().expect("the program starts");
    (output.status.code(), String::from_utf8(output.stdout).expect("text"))
}

fn says(flight: &Value, case: &Case) {
    let Case { options, outcome, words } = case;
    assert_eq!(
        (&flight["outcome"], &flight["as_expected"]),
        (&Value::from(*outcome), &Value::from(false)),
        "{options:?}"
    );
    assert!(flight["reason"].as_str().is_some_and(|reason| reason.contains(words)), "{options:?}: {flight}");
}

/// The report that was written last says how it ended and why, and marks it as failed.
fn on_its_page(folder: &Path, case: &Case) {
    let page = std::fs::read_to_string(folder.join("flight.html")).expect("a report");
    let head = "<tr class=\"failed\"><th scope=\"row\">verdict</th><td><b>";
    let verdict = page.split_once(head).and_then(|(_, rest)| rest.split_once("</b>"));
    let (verdict, _) = verdict.unwrap_or_else(|| panic!("{:?}: no failed verdict", case.options));
    let begins = format!("{}: ", case.outcome.to_uppercase());
    assert!(verdict.starts_with(&begins) && verdict.contains(case.words), "{:?}: {verdict}", case.options);
}

#[test]
fn a_flight_that_ends_badly_without_a_fault_has_failed_and_says_why() {
    let folder = folder("bad");
    for case in &CASES {
        for command in [&["fly"][..], &["hil", "--emulated"]] {
            let (code, out) = run(&folder, &[command, case.options, &["--json"]]);
            assert_eq!(code, Some(1), "{command:?} {:?}", case.options);
            says(&serde_json::from_str(&out).expect("JSON"), case);
            on_its_page(&folder, case);
        }
        let (code, out) = run(&folder, &[&["campaign", "--flights", "1"], case.options, &["--json"]]);
        let campaign: Value = serde_json::from_str(&out).expect("JSON");
        assert_eq!((code, &campaign["succeeded"]), (Some(1), &Value::from(0)), "{:?}", case.options);
        says(&campaign["each"][0], case);
        let sentence = format!("{}: ", case.outcome.to_uppercase());
        for command in [&["fly"][..], &["campaign", "--flights", "1"]] {
            let (_, out) = run(&folder, &[command, case.options]);
            let line = out.lines().find(|line| line.contains(&sentence)).unwrap_or_default();
            assert!(line.contains(case.words), "{command:?} {:?}: {out}", case.options);
        }
    }
}

/// The others have no judge of their own: who looks from beside the field sees the same.
const OTHERS: [Case; 4] = [
    Case {
        options: &["--vehicle", "plane", "--seed", "880700", "--wind", "12,0"],
        outcome: "crashed",
        words: "m/s; its motors turned for 0.",
    },
    Case {
        options: &["--vehicle", "stm32-quad", "--seed", "1", "--param", "roll.p=2.0", "--param", "pitch.p=2.0"],
        outcome: "flown-away",
        words: "m from where it was to be",
    },
    Case {
        options: &["--vehicle", "stm32-quad", "--seed", "1", "--wind", "9,0"],
        outcome: "flown-away",
        words: "m from where it was to be",
    },
    Case {
        options: &["--vehicle", "plane", "--seed", "1", "--mission", "hop", "--plant", "propeller_diameter=0.15"],
        outcome: "landed",
        words: "it landed before the mission was over",
    },
];

#[test]
fn a_flight_of_another_vehicle_that_ends_badly_has_failed_and_says_why() {
    let folder = folder("others");
    for case in &OTHERS {
        let (code, out) = run(&folder, &[&["fly"], case.options, &["--json"]]);
        assert_eq!(code, Some(1), "{:?}", case.options);
        says(&serde_json::from_str(&out).expect("JSON"), case);
    }
}

#[test]
fn a_flight_that_ends_well_has_succeeded_with_every_vehicle() {
    let folder = folder("good");
    for vehicle in ["stampfly", "rover", "stm32-quad", "plane"] {
        let (code, out) = run(&folder, &[&["fly", "--vehicle", vehicle, "--json"]]);
        let flight: Value = serde_json::from_str(&out).expect("JSON");
        assert_eq!(code, Some(0), "{vehicle}: {flight}");
        assert_ne!(flight["as_expected"], Value::from(false), "{vehicle}: {flight}");
    }
}
