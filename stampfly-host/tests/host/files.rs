//! Files of others in the program's hands: cut off, damaged, foreign and hostile ones. What is
//! whole is read, how far is said, and nothing that a file says rules the terminal or the file
//! system.

use crate::flown::HOP;
use crate::foreign_log::{begun, format, hostile, message, px4_like, sample, subscribe};
use crate::program::folder;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// The longest that a command may take over a small file. A machine that does other work takes
/// longer.
const PATIENCE: Duration = Duration::from_secs(if cfg!(debug_assertions) { 10 } else { 2 });

fn log(folder: &Path, arguments: &[&str]) -> Output {
    let began = Instant::now();
    let output = bounded(&[&["log"], arguments].concat()).current_dir(folder).output().expect("it runs");
    assert!(began.elapsed() < PATIENCE, "{arguments:?}: {:?}", began.elapsed());
    output
}

/// The program, with at most 200 MB of memory where a shell can say so.
fn bounded(arguments: &[&str]) -> Command {
    let program = env!("CARGO_BIN_EXE_stampfly");
    if cfg!(target_os = "linux") {
        let mut shell = Command::new("sh");
        // Data: what is allocated, without the program itself and without what is only reserved.
        shell.args(["-c", "ulimit -d 200000 && exec \"$@\"", "sh", program]).args(arguments);
        return shell;
    }
    let mut command = Command::new(program);
    command.args(arguments);
    command
}

fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

fn names(folder: &Path) -> Vec<String> {
    let files = std::fs::read_dir(folder).expect("a folder").map(|file| file.expect("a file").file_name());
    let mut names: Vec<String> = files.map(|name| name.to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn every_command_reads_what_is_whole_and_says_the_same_of_the_rest() {
    let folder = folder("files", "cut");
    let whole = &HOP.log;
    let middle = whole.len() / 2;
    let damaged = [&whole[..middle], &whole[middle + 3..]].concat();
    // Within a message, wherever that is: two bytes are none.
    for (name, bytes) in [("cut.ulg", [&whole[..middle], &[9, 9][..]].concat()), ("damaged.ulg", damaged)] {
        std::fs::write(folder.join(name), bytes).expect("written");
        let info = log(&folder, &["info", name, "--json"]);
        let info: serde_json::Value = serde_json::from_slice(&info.stdout).expect("JSON");
        assert_eq!(info["whole"], false);
        let end = info["end"].as_str().expect("a sentence");
        let begins = if name == "cut.ulg" { "cut off at byte " } else { "damaged at byte " };
        assert!(end.starts_with(begins), "{name}: {end}");
        let commands: [&[&str]; 5] = [
            &["log", "info", name],
            &["log", "csv", name, "--topic", "sensor_power", "--out", "tables"],
            &["log", "mcap", name, "--topic", "sensor_power", "--out", "part.mcap"],
            &["log", "cut", name, "--to", "5", "--out", "part.ulg"],
            &["replay", name],
        ];
        for arguments in commands {
            let output = Command::new(env!("CARGO_BIN_EXE_stampfly")).args(arguments).current_dir(&folder).output();
            let output = output.expect("it runs");
            assert!(output.status.success(), "{arguments:?}: {}", text(&output));
            assert!(text(&output).contains(&format!("the log is {end}")), "{arguments:?}: {}", text(&output));
        }
    }
}

#[test]
fn a_topic_that_is_not_there_is_a_failure() {
    let folder = folder("files", "topic");
    std::fs::write(folder.join("px4.ulg"), px4_like()).expect("written");
    for command in ["csv", "mcap"] {
        let output = log(&folder, &[command, "px4.ulg", "--topic", "battery_status"]);
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output).contains("px4.ulg: no topic `battery_status`"), "{}", text(&output));
    }
    let output = log(&folder, &["csv", "px4.ulg", "--topic", "position_setpoint_triplet", "--topic", "sensor_accel"]);
    assert!(output.status.success(), "{}", text(&output));
    let expected =
        ["px4.ulg", "px4_position_setpoint_triplet_0.csv", "px4_sensor_accel_0.csv", "px4_sensor_accel_1.csv"];
    assert_eq!(names(&folder), expected);
    let table = std::fs::read_to_string(folder.join(expected[1])).expect("a table");
    let header = "timestamp,previous.timestamp,previous.lat,previous.yaw,previous.valid,current.timestamp,current.lat,";
    assert!(table.starts_with(header), "{table}");
}

#[test]
fn a_name_from_a_file_rules_neither_terminal_nor_file_system() {
    let folder = folder("files", "names");
    let long = "a".repeat(300);
    let names_of_topics = [
        "../../pwn",
        "/pwned",
        "a\0b",
        "a\nb",
        "a\x1b[31mb",
        "a\u{202e}b",
        "a b",
        "",
        ".",
        "CON",
        "con",
        &long,
        "fine",
    ];
    let mut bytes = begun(0);
    message(&mut bytes, b'I', &[&[16], b"char[30] sys_nam\x1b]0;owned\x07\x1b[2J<img src=x>"]);
    for (id, name) in names_of_topics.iter().enumerate() {
        format(&mut bytes, &format!("{name}:uint64_t timestamp;float x;"));
        subscribe(&mut bytes, id as u16, 0, name);
        sample(&mut bytes, id as u16, 10, &1.0_f32.to_le_bytes());
    }
    std::fs::write(folder.join("evil.ulg"), bytes).expect("written");
    for arguments in
        [&["info", "evil.ulg"][..], &["info", "evil.ulg", "--json"], &["csv", "evil.ulg", "--out", "tables"]]
    {
        let output = log(&folder, arguments);
        assert!(output.status.success(), "{}", text(&output));
        let obeyed = text(&output).chars().find(|c| (c.is_control() && *c != '\n') || *c == '\u{202e}');
        assert_eq!(obeyed, None, "{}", text(&output));
        if arguments.contains(&"--json") {
            let info: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON still");
            assert!(info["topics"]["a\u{202e}b"].is_object(), "{info}");
        }
    }
    let tables = names(&folder.join("tables"));
    assert_eq!(tables.len(), names_of_topics.len(), "{tables:?}");
    let is_safe = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    assert!(tables.iter().all(|name| name.len() < 120 && name.chars().all(is_safe)), "{tables:?}");
    assert!(tables.contains(&"evil_fine_0.csv".to_owned()), "{tables:?}");
    assert_eq!(names(&folder), ["evil.ulg", "tables"]);
}

/// One table that cannot be written does not end the others.
#[test]
fn one_bad_table_costs_itself_alone() {
    let folder = folder("files", "table");
    std::fs::write(folder.join("px4.ulg"), px4_like()).expect("written");
    std::fs::create_dir(folder.join("px4_esc_status_0.csv")).expect("a folder in the way");
    let output = log(&folder, &["csv", "px4.ulg"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output).contains("px4_esc_status_0.csv: "), "{}", text(&output));
    assert_eq!(names(&folder).len(), 5, "{:?}", names(&folder));
}

#[test]
fn small_files_that_claim_much_cost_little_time_and_memory() {
    let folder = folder("files", "hostile");
    for (what, bytes) in hostile() {
        std::fs::write(folder.join("hostile.ulg"), &bytes).expect("written");
        let output = log(&folder, &["info", "hostile.ulg"]);
        assert!(output.status.success(), "{what}: {}", text(&output));
        let output = log(&folder, &["mcap", "hostile.ulg", "--out", "hostile.mcap"]);
        assert!(output.status.success(), "{what}: {}", text(&output));
        let output = log(&folder, &["cut", "hostile.ulg", "--to", "1", "--out", "part.ulg"]);
        assert!(output.status.success(), "{what}: {}", text(&output));
        let began = Instant::now();
        let output = bounded(&["replay", "hostile.ulg"]).current_dir(&folder).output().expect("it runs");
        assert_eq!(output.status.code(), Some(2), "{what}: {}", text(&output));
        assert!(text(&output).contains("no activations") && began.elapsed() < PATIENCE, "{what}: {}", text(&output));
    }
}

#[test]
fn names_of_fields_are_one_header_line_of_a_table_whatever_is_in_them() {
    let folder = folder("files", "fields");
    let mut bytes = begun(0);
    format(&mut bytes, "x:uint64_t timestamp;float ../x,\"\n=cmd|calc;float \x1b[2Jclear;float a,b;float y;");
    subscribe(&mut bytes, 1, 0, "x");
    let values: Vec<u8> = [1.0_f32, 2.0, 3.0, 4.5].iter().flat_map(|value| value.to_le_bytes()).collect();
    sample(&mut bytes, 1, 1_000, &values);
    std::fs::write(folder.join("fields.ulg"), bytes).expect("written");
    let output = log(&folder, &["csv", "fields.ulg"]);
    assert!(output.status.success(), "{}", text(&output));
    let table = std::fs::read_to_string(folder.join("fields_x_0.csv")).expect("a table");
    let header = r#"timestamp,"../x,""\u000a=cmd|calc",\u001b[2Jclear,"a,b",y"#;
    assert_eq!(table, format!("{header}\n1000,1,2,3,4.5\n"));
}
