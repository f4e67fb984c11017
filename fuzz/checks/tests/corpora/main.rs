//! Calls every target with the files of its corpus and with mutations of them, on the stable compiler.
//! The mutations are the same in each run; with `STAMPFLY_THOROUGH=1` there are ten times as many.

use fuzz_checks::{
    compact_record, console_line, data_stream, estimator_stream, failsafe_stream, ground_ask, ground_http, hil_frames,
    hisky, mode_machine, parameter_image, radio_packets, receiver_bytes, rover_datagrams, secure_session,
    services_cable, services_mavlink, services_msp, services_tello, stick_file, tello_text, ulog, whole_stack,
};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Longest input, bytes.
const LONGEST: usize = 4_096;

/// Calls the target with every file of its corpus, and with mutations of them.
fn smoke(name: &str, target: impl Fn(&[u8]), mutations: usize) {
    let thorough = std::env::var_os("STAMPFLY_THOROUGH").is_some_and(|value| !value.is_empty() && value != "0");
    let mutations = if thorough { 10 * mutations } else { mutations };
    let corpus = corpus(name);
    for (file, data) in &corpus {
        if catch_unwind(AssertUnwindSafe(|| target(data))).is_err() {
            panic!("{name} fails with corpus/{name}/{file}");
        }
    }
    let inputs: Vec<&[u8]> = corpus.iter().map(|(_, data)| data.as_slice()).collect();
    let failing = first_failure(&inputs, target, mutations);
    if let Some(data) = failing {
        let path = std::env::temp_dir().join(format!("{name}-failing-input"));
        std::fs::write(&path, &data).expect("a place for the input");
        panic!("{name} fails with {} bytes, which are in {}", data.len(), path.display());
    }
}

/// The first mutation with which the target panics.
fn first_failure(inputs: &[&[u8]], target: impl Fn(&[u8]), mutations: usize) -> Option<Vec<u8>> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for index in 0..mutations {
        let other = inputs[random.random_range(0..inputs.len())];
        let mut data = inputs[index % inputs.len()].to_vec();
        for _ in 0..random.random_range(1..=4) {
            mutate(&mut data, other, &mut random);
        }
        data.truncate(LONGEST);
        if catch_unwind(AssertUnwindSafe(|| target(&data))).is_err() {
            return Some(data);
        }
    }
    None
}

/// One change of the kinds that libFuzzer makes, too.
fn mutate(data: &mut Vec<u8>, other: &[u8], random: &mut impl Rng) {
    let place = random.random_range(0..=data.len());
    let end = random.random_range(place..=data.len().min(place + 64));
    match random.random_range(0..7) {
        0 => data.iter_mut().skip(place).take(1).for_each(|byte| *byte ^= 1 << random.random_range(0..8)),
        1 => data.iter_mut().skip(place).take(1).for_each(|byte| *byte = random.random()),
        2 => data.insert(place, [0, 1, 0x0A, 0x20, 0x7F, 0x80, 0xFF][random.random_range(0..7)]),
        3 => drop(data.drain(place..end)),
        4 => {
            let copy = data[place..end].to_vec();
            let to = random.random_range(0..=data.len());
            data.splice(to..to, copy);
        }
        5 => {
            let from = random.random_range(0..=other.len());
            data.truncate(place);
            data.extend(&other[from..]);
        }
        _ => data[place..end].fill(random.random()),
    }
}

/// The files of a target's corpus, by name.
fn corpus(name: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../corpus").join(name);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<_> = entries
        .map(|entry| {
            let path = entry.expect("a readable folder").path();
            let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            (file, std::fs::read(&path).expect("a readable file"))
        })
        .collect();
    files.sort();
    assert!(!files.is_empty(), "{} is empty", folder.display());
    files
}

#[test]
fn console() {
    smoke("console_line", console_line, 6_000);
}

#[test]
fn parameters() {
    smoke("parameter_image", parameter_image, 4_000);
}

#[test]
fn estimator() {
    smoke("estimator_stream", estimator_stream, 100);
}

#[test]
fn failsafe() {
    smoke("failsafe_stream", failsafe_stream, 1_000);
}

#[test]
fn ground() {
    smoke("ground_ask", ground_ask, 15_000);
    smoke("ground_http", ground_http, 15_000);
}

#[test]
fn hil() {
    smoke("hil_frames", hil_frames, 2_000);
}

#[test]
fn compact_records() {
    smoke("compact_record", compact_record, 2_000);
}

#[test]
fn machine() {
    smoke("mode_machine", mode_machine, 1_000);
}

#[test]
fn packets() {
    smoke("radio_packets", radio_packets, 40_000);
}

#[test]
fn receivers() {
    smoke("receiver_bytes", receiver_bytes, 20_000);
}

#[test]
fn small_transmitters() {
    smoke("hisky", hisky, 20_000);
}

#[test]
fn words() {
    smoke("tello_text", tello_text, 20_000);
}

#[test]
fn sticks() {
    smoke("stick_file", stick_file, 5_000);
}

#[test]
fn log_stream() {
    smoke("data_stream", data_stream, 20_000);
}

#[test]
fn secured() {
    smoke("secure_session", secure_session, 10_000);
}

#[test]
fn services() {
    smoke("services_cable", services_cable, 10_000);
    smoke("services_mavlink", services_mavlink, 10_000);
    smoke("services_msp", services_msp, 10_000);
    smoke("services_tello", services_tello, 10_000);
}

#[test]
fn datagrams() {
    smoke("rover_datagrams", rover_datagrams, 20_000);
}

#[test]
fn logs() {
    smoke("ulog", ulog, 15_000);
}

#[test]
fn stack() {
    smoke("whole_stack", whole_stack, 40);
}

/// A target that fails is found out, and a mutation reaches what no file of the corpus does.
#[test]
fn a_failure_is_found() {
    let fails_on_ff = |data: &[u8]| assert!(!data.contains(&0xFF) || data.len() < 4);
    let found = first_failure(&[b"harmless", b"as well"], fails_on_ff, 2_000).expect("found");
    assert!(found.contains(&0xFF));
    assert_eq!(first_failure(&[b"harmless"], |_| {}, 2_000), None);
}
