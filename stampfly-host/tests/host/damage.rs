//! Files cut off at a thousand places and with inverted bytes, and the bounds of time and memory within
//! which a reader must accept or refuse each.

use std::process::Command;
use std::time::Duration;

/// Cuts of a file.
const CUTS: usize = 1_000;
/// Bytes that are inverted: the first ones, and as many over the whole file.
const BYTES: usize = 200;
/// The longest time that reading a small file may take.
const PATIENCE: Duration = Duration::from_secs(2);
/// Bound of the peak memory of the process that reads all of them, MB.
const MEMORY: u64 = 200;
/// Set in a process that was started to be measured.
const MEASURED: &str = "STAMPFLY_MEASURED";

/// Peak memory of this process, MB; `None` on a system without `/proc`.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()?.div_ceil(1_000))
}

/// Runs a test in a process of its own, whose peak memory and longest read are bounded. `work` reads
/// every file and returns their number and the longest time that one took.
pub fn measured(test: &str, work: impl FnOnce() -> (usize, Duration)) {
    if std::env::var_os(MEASURED).is_none() {
        let program = std::env::current_exe().expect("this program");
        let run = Command::new(program).args(["--exact", test, "--nocapture"]).env(MEASURED, "1").output();
        let output = run.expect("it runs");
        let said = String::from_utf8_lossy(&output.stdout);
        println!("{}", said.lines().filter(|line| line.contains(" files")).collect::<Vec<_>>().join("\n"));
        let why = String::from_utf8_lossy(&output.stderr);
        return assert!(output.status.success() && said.contains("1 passed"), "{said}{why}");
    }
    let before = peak();
    let (files, longest) = work();
    let peak = peak();
    println!("{test}: {files} files, at most {longest:.1?} each, peak memory {peak:?} MB ({before:?} before)");
    assert!(longest < PATIENCE && peak.is_none_or(|peak| peak < MEMORY));
}

pub fn cuts(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    (0..CUTS).map(|cut| &bytes[..cut * bytes.len() / CUTS])
}

pub fn flips(bytes: &[u8]) -> impl Iterator<Item = Vec<u8>> {
    let first = 0..BYTES.min(bytes.len());
    let spread = (0..BYTES).map(|place| place * bytes.len() / BYTES);
    first.chain(spread).flat_map(|place| {
        [1, 0x80, 0xff].map(|bits| {
            let mut flipped = bytes.to_vec();
            flipped[place] ^= bits;
            flipped
        })
    })
}
