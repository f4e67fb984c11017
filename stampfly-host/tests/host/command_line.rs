//! The program as people and scripts meet it: what it prints where, and what it says when it is asked nonsense.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const FIGURES: [&str; 8] = [
    "pos_rms_m",
    "est_pos_rms_m",
    "alt_rms_m",
    "takeoff_overshoot_m",
    "touchdown_speed_mps",
    "hover_tilt_max_deg",
    "land_error_m",
    "hover_drift_m",
];

/// A mission that is over soon.
const HOP: &str = "arm\ntakeoff 0.3\nhover 2\nland\n";

/// An empty folder of this test's own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("command_line").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the target folder can be written");
    folder
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stampfly"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command
}

struct Ran {
    code: i32,
    out: String,
    err: String,
}

fn read(output: Output) -> Ran {
    let text = |bytes| String::from_utf8(bytes).expect("text");
    let ran =
        Ran { code: output.status.code().expect("an exit code"), out: text(output.stdout), err: text(output.stderr) };
    assert!(!ran.err.contains("panicked") && !ran.out.contains("panicked"), "{}", ran.err);
    ran
}

fn run(folder: &Path, arguments: &[&str]) -> Ran {
    read(command(folder, arguments).output().expect("the program starts"))
}

/// Standard output, which has to be one JSON object on one line, of a run that succeeded.
fn json(ran: &Ran) -> Value {
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert_eq!(ran.out.trim_end().lines().count(), 1, "{}", ran.out);
    let value: Value = serde_json::from_str(&ran.out).expect("JSON");
    assert!(value.is_object());
    value
}

#[test]
fn fly_prints_one_json_object_and_writes_log_and_report() {
    let folder = folder("fly");
    let value = json(&run(&folder, &["fly", "--seed", "3", "--json", "--out", "deep/er"]));
    assert_eq!((&value["landed"], &value["disarmed"]), (&Value::Bool(true), &Value::Bool(true)));
    assert_eq!((&value["finished"], &value["motors_sane"]), (&Value::Bool(true), &Value::Bool(true)));
    for name in FIGURES {
        assert!(value[name].as_f64().is_some_and(|figure| (0.0..10.0).contains(&figure)), "{name}: {value}");
    }
    assert!(value["realtime_factor"].as_f64().is_some_and(|factor| factor > 0.5), "{value}");
    let hash = value["log_hash"].as_str().expect("text");
    assert!(hash.len() == 16 && u64::from_str_radix(hash, 16).is_ok(), "{hash}");

    let log = std::fs::read(folder.join("deep/er/flight.ulg")).expect("a log");
    assert!(log.starts_with(b"ULog") && log.len() > 1_000_000);
    let page = std::fs::read_to_string(folder.join("deep/er/flight.html")).expect("a report");
    assert!(page.contains(hash) && page.contains("pos rms"));

    let again = json(&run(&folder, &["fly", "--seed", "3", "--json"]));
    assert_eq!(again["log_hash"], value["log_hash"]);
    let replayed = json(&run(&folder, &["replay", "--json", "deep/er/flight.ulg"]));
    assert_eq!((&replayed["identical"], &replayed["vehicle"]), (&Value::Bool(true), &Value::from("stampfly")));
    assert_eq!((&replayed["gaps"], &replayed["skipped"]), (&Value::from(0), &Value::from(0)));
    assert!(replayed["key_frames"].as_u64().is_some_and(|count| count > 20), "{replayed}");
    assert!(replayed["activations"].as_u64().is_some_and(|count| count > 50_000), "{replayed}");
}

#[test]
fn replay_tells_a_difference_by_its_exit_code() {
    let folder = folder("replay");
    std::fs::write(folder.join("hop"), HOP).expect("written");
    assert_eq!(run(&folder, &["fly", "--mission", "hop"]).code, 0);
    let same = run(&folder, &["replay", "flight.ulg"]);
    assert!(same.code == 0 && same.out.contains("identical"), "{}", same.out);

    let mut log = std::fs::read(folder.join("flight.ulg")).expect("a log");
    let name = b"position.pos.kp";
    let at = log.windows(name.len()).position(|window| window == name).expect("the log has parameters");
    log[at + name.len() + 1] ^= 0x10;
    std::fs::write(folder.join("changed.ulg"), &log).expect("written");
    let other = run(&folder, &["replay", "changed.ulg"]);
    assert!(other.code == 1 && other.out.contains("activation control"), "{}", other.out);
    let other = run(&folder, &["replay", "--json", "changed.ulg"]);
    let value: Value = serde_json::from_str(&other.out).expect("JSON");
    assert_eq!((other.code, &value["difference"]["activation"]), (1, &Value::from("control")));
}

#[test]
fn without_arguments_it_flies() {
    let folder = folder("nothing");
    let ran = run(&folder, &[]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    for part in ["flight\n", "IdleGround", "TakeOff", "figures", "landed and disarmed", "flight.ulg", "flight.html"] {
        assert!(ran.out.contains(part), "{part} is missing:\n{}", ran.out);
    }
    assert!(FIGURES.iter().all(|figure| ran.out.contains(figure)), "{}", ran.out);
    assert!(folder.join("flight.ulg").exists() && folder.join("flight.html").exists());
    let mut files: Vec<_> =
        std::fs::read_dir(&folder).expect("a folder").map(|file| file.expect("a file").file_name()).collect();
    files.sort();
    assert_eq!(files, ["flight.html", "flight.ulg"]);
}

#[test]
fn campaign_prints_spreads() {
    let folder = folder("campaign");
    let value = json(&run(&folder, &["campaign", "--flights", "3", "--seed", "7", "--json"]));
    assert_eq!((&value["flights"], &value["landed"]), (&Value::from(3), &Value::from(3)));
    for name in FIGURES {
        let [p50, p95, max] = ["p50", "p95", "max"].map(|part| value[name][part].as_f64().expect("a number"));
        assert!(0.0 < p50 && p50 <= p95 && p95 <= max, "{name}: {value}");
    }
    let text = run(&folder, &["campaign", "--flights", "2"]);
    assert!(text.code == 0 && text.out.contains("2 of 2 flights succeeded"), "{}", text.out);
    assert_eq!(std::fs::read_dir(&folder).expect("a folder").count(), 0, "a campaign writes no files");
}

#[test]
fn a_campaign_that_fails_says_so() {
    let folder = folder("failing");
    std::fs::write(folder.join("never"), "arm\ntakeoff 0.5\n").expect("written");
    let ran = run(&folder, &["campaign", "--flights", "1", "--seed", "9", "--mission", "never", "--json"]);
    let value: Value = serde_json::from_str(&ran.out).expect("JSON");
    assert_eq!((ran.code, &value["landed"]), (1, &Value::from(0)), "{value}");
    assert_eq!(value["failed_seeds"], serde_json::json!([9]));
}

#[test]
fn options_reach_the_flight() {
    let folder = folder("options");
    std::fs::write(folder.join("hop"), HOP).expect("written");
    let hash = |options: &[&str]| {
        let value = json(&run(&folder, &[&["fly", "--json", "--mission", "hop"], options].concat()));
        value["log_hash"].as_str().expect("text").to_owned()
    };
    let mut hashes = vec![
        hash(&[]),
        hash(&["--seed", "2"]),
        hash(&["--plant", "mass=0.037"]),
        hash(&["--param", "altitude.alt.kp=1.1"]),
        hash(&["--vibration", "0"]),
        hash(&["--gust", "0.1"]),
        hash(&["--wind", "-0.2,0.1"]),
        hash(&["--jitter", "1"]),
    ];
    hashes.sort();
    hashes.dedup();
    assert_eq!(hashes.len(), 8);
}

#[test]
fn topics_are_listed_as_text_json_and_markdown() {
    let folder = folder("topics");
    let value = json(&run(&folder, &["topics", "--json"]));
    let rows = value["topics"].as_array().expect("a list");
    assert_eq!(rows.len(), stampfly_board::topics::COUNT);
    for row in rows {
        for key in ["name", "type", "policy", "rate", "publisher", "doc"] {
            assert!(row[key].as_str().is_some_and(|text| !text.is_empty()), "{key}: {row}");
        }
        assert!(row["readers"].is_array() && row["depth"].as_u64() > Some(0));
        assert!(row["fields"].as_array().is_some_and(|fields| !fields.is_empty()));
    }
    let imu = rows.iter().find(|row| row["name"] == "sensor_imu").expect("the table has it");
    assert_eq!((&imu["type"], &imu["policy"], &imu["rate"]), (&"ImuData".into(), &"ring".into(), &"400 Hz".into()));

    let text = run(&folder, &["topics"]).out;
    let markdown = run(&folder, &["topics", "--markdown"]).out;
    assert!(
        markdown.starts_with("| topic |") && markdown.lines().all(|line| line.starts_with('|') && line.ends_with('|'))
    );
    assert_eq!(markdown.lines().count(), rows.len() + 2);
    for row in rows {
        let name = row["name"].as_str().expect("text");
        assert!(text.contains(name) && markdown.contains(&format!("| `{name}` |")), "{name}");
    }
}

#[test]
fn runnables_are_listed_with_their_response_times() {
    let folder = folder("schedule");
    let value = json(&run(&folder, &["schedule", "--json"]));
    let rows = value["activations"].as_array().expect("a list");
    assert_eq!(rows.len(), stampfly_board::schedule::COUNT);
    let (text, markdown) = (run(&folder, &["schedule"]).out, run(&folder, &["schedule", "--markdown"]).out);
    assert_eq!(markdown.lines().count(), rows.len() + 2);
    for row in rows {
        let name = row["name"].as_str().expect("text");
        assert!(text.contains(name) && markdown.contains(&format!("| `{name}` |")), "{name}");
        assert!(row["response_us"].as_u64() >= row["budget_us"].as_u64(), "{row}");
    }
    // From a sample to the motors within the period of the samples.
    let motors = rows.iter().find(|row| row["name"] == "actuation").expect("the table has it");
    assert!(motors["response_us"].as_u64() < Some(2_500), "{motors}");
}

#[test]
fn the_golden_flight_is_what_it_should_be() {
    let folder = folder("golden");
    let played = json(&run(&folder, &["golden", "--json"]));
    assert_eq!(played["verdict"], "identical");
    let again = run(&folder, &["golden", "--record", "again.bin"]);
    assert_eq!(again.code, 0, "{}", again.err);
    let recorded = std::fs::read(folder.join("again.bin")).expect("recorded");
    assert!(recorded == stampfly_board::golden::FLIGHT, "recorded differently: `cargo xtask golden --fix`");
    assert_eq!(run(&folder, &["golden", "--record", "no/such/folder"]).code, 2);
}

#[test]
fn help_is_everywhere() {
    let folder = folder("help");
    let top = run(&folder, &["--help"]);
    for command in ["fly", "replay", "topics", "schedule", "campaign", "golden"] {
        assert!(top.out.contains(command), "{}", top.out);
        let ran = run(&folder, &[command, "--help"]);
        assert!(ran.code == 0 && ran.out.contains("Usage: stampfly") && ran.err.is_empty(), "{command}: {}", ran.err);
    }
    assert!(run(&folder, &["--version"]).out.starts_with("stampfly "));
    let list = run(&folder, &["fly", "--list", "--param", "position.pos.kp=1.25"]);
    assert!(list.code == 0 && list.out.contains("position.pos.kp") && list.out.contains("1.25"));
    assert!(list.out.contains("mass") && list.out.contains("kg"));
    assert_eq!(std::fs::read_dir(&folder).expect("a folder").count(), 0, "nothing was flown");
}

/// Exit code 2, nothing on standard output, and all of these words on standard error.
fn refuses(folder: &Path, arguments: &[&str], words: &[&str]) {
    let ran = run(folder, arguments);
    assert_eq!(ran.code, 2, "{arguments:?}: {}{}", ran.out, ran.err);
    assert_eq!(ran.out, "", "{arguments:?}");
    for word in words {
        assert!(ran.err.contains(word), "{arguments:?}: no '{word}' in: {}", ran.err);
    }
    assert!(ran.err.lines().count() < 15, "{arguments:?}: too long: {}", ran.err);
}

#[test]
fn nonsense_is_refused_by_name() {
    let folder = folder("nonsense");
    for (name, text) in
        [("broken", "arm\ntakeoff 0.5\ngoto 1 2\nland\n"), ("empty", "# nothing\n"), ("high", "arm\ntakeoff 99\n")]
    {
        std::fs::write(folder.join(name), text).expect("written");
    }
    std::fs::write(folder.join("binary"), [0xff, 0xfe, 0x00]).expect("written");
    std::fs::write(folder.join("file"), "in the way").expect("written");
    let cases: &[(&[&str], &[&str])] = &[
        (&["flie"], &["flie"]),
        (&["fly", "--sed", "1"], &["--sed"]),
        (&["fly", "--seed", "minus one"], &["--seed", "minus one"]),
        (&["fly", "--seed", "-1"], &["-1"]),
        (&["fly", "--param", "position.pos.kq=1"], &["position.pos.kq", "no such parameter"]),
        (&["fly", "--param", "position.pos.kp=1000"], &["position.pos.kp", "from 0.1 to 5"]),
        (&["fly", "--param", "position.pos.kp=NaN"], &["position.pos.kp", "from 0.1 to 5"]),
        (&["fly", "--param", "position.pos.kp=fast"], &["position.pos.kp", "fast"]),
        (&["fly", "--param", "position.pos.kp"], &["position.pos.kp", "NAME=VALUE"]),
        (&["fly", "--plant", "colour=1"], &["colour"]),
        (&["fly", "--plant", "mass=-1"], &["mass", "0.01"]),
        (&["fly", "--plant", "mass=inf"], &["mass"]),
        (&["fly", "--plant", "mass=NaN"], &["mass"]),
        (&["fly", "--vibration", "NaN"], &["--vibration", "NaN"]),
        (&["fly", "--vibration", "-1"], &["-1"]),
        (&["fly", "--gust", "NaN"], &["--gust", "NaN"]),
        (&["fly", "--gust=-1"], &["--gust", "-1"]),
        (&["fly", "--gust", "1e30"], &["--gust"]),
        (&["fly", "--wind", "NaN,0"], &["--wind", "NaN"]),
        (&["fly", "--wind", "0,inf"], &["--wind", "inf"]),
        (&["fly", "--wind", "1"], &["--wind"]),
        (&["fly", "--wind", "1,2,3"], &["3"]),
        (&["fly", "--mission", "broken"], &["mission broken", "line 3", "height"]),
        (&["fly", "--mission", "empty"], &["mission empty", "no steps"]),
        (&["fly", "--mission", "high"], &["mission high", "line 2", "99"]),
        (&["fly", "--mission", "binary"], &["mission binary"]),
        (&["fly", "--mission", "nowhere.txt"], &["nowhere.txt"]),
        (&["fly", "--mission", "."], &["mission ."]),
        (&["fly", "--out", "file/below"], &["file/below"]),
        (&["fly", "--json", "--out", "file"], &["file"]),
        (&["fly", "--fault", "tof-late@hover"], &["tof-late", "tof-silent", "stall"]),
        (&["fly", "--fault", "tof-stuck=-1@hover"], &["tof-stuck", "'-1'", "from 0 to 10 m"]),
        (&["fly", "--fault", "imu-silent=1@hover"], &["imu-silent takes no value"]),
        (&["fly", "--fault", "imu-silent"], &["the moment is missing"]),
        (&["fly", "--fault", "imu-silent@noon"], &["'noon'", "ground, spool, takeoff"]),
        (&["campaign", "--fault", "imu-silent@hover+long"], &["'long'"]),
        (&["fly", "--vehicle", "rover", "--fault", "stall@hover"], &["this vehicle has no faults"]),
        (&["fly", "--vehicle", "rover", "--pilot"], &["no pilot"]),
        (&["fly", "--mode", "acro"], &["--pilot"]),
        (&["fly", "--pilot", "--mode", "loop"], &["'loop'", "stabilize, acro, althold, poshold"]),
        (&["campaign", "--flights", "0"], &["--flights", "0"]),
        (&["campaign", "--flights", "3", "--seed", "18446744073709551615"], &["--seed"]),
        (&["campaign", "--flights", "many"], &["--flights", "many"]),
        (&["campaign", "--mission", "broken"], &["line 3"]),
        (&["replay"], &["FILE"]),
        (&["replay", "nowhere.ulg"], &["nowhere.ulg"]),
        (&["replay", "broken"], &["broken", "not a ULog"]),
        (&["replay", "."], &["."]),
        (&["topics", "--json", "--markdown"], &["--markdown"]),
    ];
    for (arguments, words) in cases {
        refuses(&folder, arguments, words);
    }
}

#[test]
fn faults_are_listed_and_what_came_of_one_is_in_the_json() {
    let folder = folder("faults");
    std::fs::write(folder.join("hop"), HOP).expect("written");
    let table = json(&run(&folder, &["faults", "--json"]));
    let rows = table["faults"].as_array().expect("rows");
    let row = |name: &str| rows.iter().find(|row| row["name"] == name).expect("a row");
    assert_eq!((&row("stall")["default"], &row("stall")["unit"]), (&Value::from(20.0), &Value::from("ms")));
    assert_eq!((&row("tof-stuck")["default"], &row("imu-silent")["expected"]), (&Value::Null, &Value::from("cut")));
    let listed = run(&folder, &["faults"]).out;
    assert!(rows.iter().all(|row| listed.contains(row["name"].as_str().expect("a name"))), "{listed}");
    let none = json(&run(&folder, &["faults", "--vehicle", "rover", "--json"]));
    assert_eq!(none["faults"], Value::Array(Vec::new()));

    let fault = ["--mission", "hop", "--json", "--fault", "imu-silent@hover"];
    let value = json(&run(&folder, &[&["fly"][..], &fault].concat()));
    assert_eq!((&value["outcome"], &value["violations"]), (&Value::from("cut"), &Value::Array(Vec::new())));
    for name in ["max_height_m", "max_distance_m", "touch_speed_mps", "cut_after_s", "cut_height_m"] {
        assert!(value[name].as_f64().is_some_and(|number| (0.0..5.0).contains(&number)), "{name}: {value}");
    }
    let alert = &value["alerts"].as_array().expect("a list").iter().find(|alert| alert["name"] == "IMU_LOST");
    assert!(alert.is_some_and(|alert| alert["since"].as_f64().is_some()), "{value}");

    let campaign = json(&run(&folder, &[&["campaign", "--flights", "2"][..], &fault].concat()));
    let each = campaign["each"].as_array().expect("a list");
    assert_eq!(each.len(), 2);
    assert!(each.iter().all(|flight| flight["outcome"] == "cut" && flight["seed"].is_u64()), "{campaign}");

    let healthy = json(&run(&folder, &["fly", "--mission", "hop", "--json"]));
    assert_eq!((&healthy["outcome"], &healthy["cut_after_s"]), (&Value::from("transparent"), &Value::Null));
}

/// `stampfly … | head -0`: the reader is gone before the first line.
#[test]
fn a_reader_that_has_gone_is_no_panic() {
    let folder = folder("closed");
    std::fs::write(folder.join("hop"), HOP).expect("written");
    for arguments in [&["topics"][..], &["fly", "--mission", "hop"], &["fly", "--list"], &["--help"]] {
        let mut child =
            command(&folder, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
        drop(child.stdout.take());
        let ran = read(child.wait_with_output().expect("it ends"));
        assert_eq!(ran.err, "", "{arguments:?}");
    }
}

#[test]
fn the_doctor_says_what_it_found_by_its_exit_code_and_in_a_file() {
    let folder = folder("doctor");
    let sound = run(&folder, &["doctor", "--emulated"]);
    assert_eq!(sound.code, 0, "{}", sound.out);
    assert!(sound.out.contains("All passed."), "{}", sound.out);
    let broken = run(&folder, &["doctor", "--emulated=motor-1-dead", "--seed", "2", "--out", "broken.txt"]);
    assert_eq!(broken.code, 1, "{}", broken.out);
    let file = std::fs::read_to_string(folder.join("broken.txt")).expect("written");
    for part in ["FAIL motor-1-dead", "One thing is not", "> motor test 1 15", "Which motor turns?\n< none"] {
        assert!(file.contains(part), "{part} is missing:\n{file}");
    }
    assert!(folder.join("doctor.txt").exists());
    let faults = run(&folder, &["doctor", "--list-faults"]);
    assert!(faults.code == 0 && faults.out.lines().any(|line| line == "flow-axes-swapped"), "{}", faults.out);
    assert_eq!(run(&folder, &["doctor", "--emulated=gremlins"]).code, 2);
    assert_eq!(run(&folder, &["doctor", "--yes", "--port", "/nowhere", "--emulated"]).code, 2);
    // Nobody says that the propellers are off.
    assert_eq!(run(&folder, &["doctor", "--port", "/nowhere"]).code, 2);
}

#[test]
fn hardware_in_the_loop_is_the_same_flight_or_an_error() {
    let folder = folder("hil");
    std::fs::write(folder.join("hop"), HOP).expect("writable");
    let flown = |arguments: &[&str]| {
        let all = [arguments, &["--mission", "hop", "--seed", "3", "--json"]].concat();
        json(&run(&folder, &all))["log_hash"].clone()
    };
    assert_eq!(flown(&["hil", "--emulated"]), flown(&["fly"]));
    assert!(folder.join("flight.ulg").exists() && folder.join("flight.html").exists());
    let replayed = run(&folder, &["replay", "flight.ulg"]);
    assert_eq!(replayed.code, 0, "{}", replayed.err);
    let shown = run(&folder, &["hil", "--emulated", "--mission", "arm; takeoff 0.2; land", "--real-time"]);
    assert!(shown.code == 0 && shown.out.contains("round trip") && shown.out.contains("real time"), "{}", shown.out);

    // One ends at once, the other says nothing.
    let [ends, silent] = if cfg!(windows) { ["cmd /c exit", "findstr nothing"] } else { ["true", "sleep 60"] };
    let gone = run(&folder, &["hil", "--program", ends, "--mission", "hop"]);
    assert!(gone.code == 1 && gone.err.contains("the line to the vehicle is gone"), "{}", gone.err);
    let mute = run(&folder, &["hil", "--program", silent, "--mission", "hop"]);
    assert!(mute.code == 1 && mute.err.contains("does not answer"), "{}", mute.err);
    for usage in [&["hil", "--emulated", "--program", "true"][..], &["hil", "--emulated", "--from", "x", "--row", "0"]]
    {
        assert_eq!(run(&folder, usage).code, 2, "{usage:?}");
    }
}
