//! Every kind of file that the program accepts, cut off and with bytes turned over, in the program's
//! own hands: the whole part is read, or an error says what is wrong. Never a panic, never long, never
//! much memory. `damaged_files` of `stampfly-lab` has the recordings that are no text.
//!
//! Programs that speak MSP or a Tello's text send no files, and parameters come one by one.

use crate::flown::{Hop, hop};
use crate::foreign_log::px4_like;
use crate::program::folder;
use crate::thorough::thorough;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_host::campaign::case::{Cases, Plan};
use stampfly_host::campaign::file;
use stampfly_host::campaign::row::Row;
use stampfly_sim::vehicle::Options;
use stampfly_types::Duration as Simulated;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Places at which each file is cut off, and bytes that are turned over in each.
const CUTS: (usize, usize) = (25, 1_000);
const BYTES: (usize, usize) = (25, 200);
/// A drive that takes a tenth of a second.
const COURSE: &str = "0.0 throttle 0.8\n1.5 throttle 0.2 steer 0.6\n2.5 check yaw_rate > 0\n4.0 end\n";
/// A file that nothing was done to.
const WHOLE: &str = "whole";
/// What says that a file was read whole although the command went wrong behind it.
const READ: [&str; 2] = ["there is no fault 'none'", " has rows 0 to "];
/// What one may take.
const PATIENCE: Duration = Duration::from_secs(2);
const MEMORY: u64 = 200;

/// A kind of file, a small one of it, and what the program does with it: words, with `FILE` for it.
struct Kind {
    name: &'static str,
    bytes: Vec<u8>,
    command: &'static str,
}

fn kinds() -> Vec<Kind> {
    // A second of a flight.
    let second = Hop::fly(&Setup { limit: Simulated::from_secs(1), ..hop(1, None) });
    let mission = "arm\ntakeoff 0.4\nhover 2\ngoto 0.5 -0.3 0.6 yaw 60\nland\n".repeat(20);
    let stick_row = |n: usize| format!("{:.2},0.6,0.{},-0.25,0,stabilize,1\n", n as f32 * 0.02, n % 10);
    let sticks = format!("t,throttle,roll,pitch,yaw,mode,arm\n{}", (0..100).map(stick_row).collect::<String>());
    let kind = |name, bytes: &[u8], command| Kind { name, bytes: bytes.to_vec(), command };
    vec![
        kind("log", &second.log, "log info FILE"),
        kind("log as tables", &second.log, "log csv FILE --out tables"),
        kind("log, a part", &second.log, "log cut FILE --to 0.5 --out part.ulg"),
        kind("log, replayed", &second.log, "replay FILE"),
        kind("log of PX4 as MCAP", &px4_like(), "log mcap FILE --out part.mcap"),
        kind("compact record", &second.record, "log info FILE"),
        kind("compact record, replayed", &second.record, "replay FILE"),
        // The mission comes before the fault, which there is not: nothing is flown.
        kind("mission", mission.as_bytes(), "fly --mission FILE --fault none@0"),
        kind("sticks", sticks.as_bytes(), "fly --sticks FILE --fault none@0"),
        kind("drive of the rover", COURSE.as_bytes(), "fly --vehicle rover --mission FILE"),
        // No file has so many rows.
        kind("flights of a campaign", &flights(), "fly --from FILE --row 9999"),
        kind("key", "0123456789abcdef".repeat(4).as_bytes(), "key mavlink FILE"),
    ]
}

/// Two rows of a campaign, as their file.
fn flights() -> Vec<u8> {
    let plan = Plan { seed: 1, flights: 2, pairs: false, drawn: false, only: Vec::new(), options: Options::default() };
    let cases = Cases::new::<StampFly>(&plan).expect("a campaign");
    let rows: Vec<_> = (0..40).map(|index| Row { verdict: "flew".into(), ..Row::of(&cases.case(index)) }).collect();
    let path = folder("every_file", "rows").join("rows.parquet");
    file::write(&path, "identity", &rows).expect("written");
    std::fs::read(path).expect("a file")
}

/// The program, and the most memory that it was seen to have, MB. Where a shell can say so, it gets no
/// more than [`MEMORY`].
fn run(folder: &Path, words: &[&str]) -> (Output, Duration, Option<u64>) {
    let program = env!("CARGO_BIN_EXE_stampfly");
    let mut command = if cfg!(target_os = "linux") {
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("ulimit -d {MEMORY}000 && exec \"$@\""), "sh", program]);
        shell
    } else {
        Command::new(program)
    };
    command.args(words).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let (begun, mut peak) = (Instant::now(), None);
    let mut child = command.spawn().expect("it starts");
    // One that says much waits until it is read: it is looked at while it says little or computes.
    while child.try_wait().expect("a child").is_none() && begun.elapsed() < PATIENCE {
        peak = peak.max(resident(&child));
        std::thread::sleep(Duration::from_micros(200));
    }
    let output = child.wait_with_output().expect("it ends");
    (output, begun.elapsed(), peak)
}

/// The most memory that it has had so far, MB. `None` before the program runs: until then the child
/// is a copy of the test, with its memory.
fn resident(child: &Child) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
    status.lines().find(|line| line.starts_with("Name:") && line.ends_with("stampfly"))?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()?.div_ceil(1_000))
}

fn damaged(bytes: &[u8]) -> impl Iterator<Item = (String, Vec<u8>)> {
    let (cuts, flips) = (thorough(CUTS.0, CUTS.1), thorough(BYTES.0, BYTES.1));
    let cuts = (0..cuts).map(move |cut| cut * bytes.len() / cuts);
    let cuts = cuts.map(|length| (format!("cut at {length}"), bytes[..length].to_vec()));
    let flips = (0..flips).flat_map(move |place| [place.min(bytes.len() - 1), place * bytes.len() / flips]);
    let flips = flips.enumerate().map(|(number, place)| {
        let mut flipped = bytes.to_vec();
        flipped[place] ^= [1, 0x80, 0xff][number % 3];
        (format!("byte {place} turned over"), flipped)
    });
    core::iter::once((WHOLE.to_owned(), bytes.to_vec())).chain(cuts).chain(flips)
}

#[test]
fn every_kind_of_file_is_read_as_far_as_it_is_whole_or_refused_with_a_reason_in_little_time_and_memory() {
    println!(
        "| kind | bytes | command | cut off: read, refused | turned over: read, refused | at most | peak memory |"
    );
    for Kind { name, bytes, command } in kinds() {
        let folder = folder("every_file", &name.replace([' ', ','], "-"));
        let (mut counts, mut longest, mut most) = ([[0; 2]; 2], Duration::ZERO, None);
        for (what, damaged) in damaged(&bytes) {
            let path = folder.join("file");
            std::fs::write(&path, damaged).expect("written");
            #[cfg(unix)]
            {
                use std::os::unix::fs::PermissionsExt;
                // As a key is kept.
                std::fs::set_permissions(&path, PermissionsExt::from_mode(0o600)).expect("its owner's");
            }
            let words: Vec<_> = command.split(' ').map(|word| if word == "FILE" { "file" } else { word }).collect();
            // A machine that does other work may hold a program up: the fastest of three counts.
            let (mut output, mut took, mut peak) = run(&folder, &words);
            for _ in 0..2 {
                if took > PATIENCE {
                    (output, took, peak) = run(&folder, &words);
                }
            }
            let said =
                format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
            let is_read = match output.status.code() {
                Some(0) => true,
                Some(1 | 2) => READ.iter().any(|read| said.contains(read)),
                code => panic!("{name}, {what}: {code:?}: {said}"),
            };
            if what == WHOLE {
                assert!(is_read, "{name}: {said}");
            } else {
                counts[usize::from(what.starts_with("byte"))][usize::from(!is_read)] += 1;
            }
            assert!(!said.trim().is_empty() && !said.contains("panicked"), "{name}, {what}: {said}");
            assert!(took < PATIENCE, "{name}, {what}: {took:?}");
            longest = longest.max(took);
            most = most.max(peak);
        }
        let ([[cut_read, cut_refused], [read, refused]], most_mb) = (counts, most.unwrap_or_default());
        println!(
            "| {name} | {} | `{command}` | {cut_read}, {cut_refused} | {read}, {refused} | {longest:.2?} | {most_mb} MB |",
            bytes.len()
        );
        assert!(most_mb < MEMORY, "{name}: {most_mb} MB");
    }
}
