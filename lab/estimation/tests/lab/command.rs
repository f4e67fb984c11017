//! Output and exit codes of `lab estimate`.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn lab(arguments: &[&Path]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lab")).arg("estimate").args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// An empty folder of this test's own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A capture of two seconds at rest.
fn still() -> String {
    let row = |n: usize| format!("{},0.001,-0.002,0.00{},0.1,0,-9.8\n", n * 10, n % 3);
    format!("timestamp_ms,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n{}", (0..200).map(row).collect::<String>())
}

#[test]
fn a_broken_file_does_not_stop_the_others() {
    let folder = folder("broken");
    let path = |name: &str, content: &[u8]| {
        let path = folder.join(name);
        std::fs::write(&path, content).unwrap();
        path
    };
    let good = path("good.csv", still().as_bytes());
    let empty = path("empty.csv", b"");
    let strange = path("strange.csv", b"when,what\n1,2\n");
    let number = path("number.csv", still().replacen("20,0.001", "20,zero", 1).as_bytes());
    let header = path("header.csv", still().lines().next().unwrap().as_bytes());
    let archive = path("archive.npz", b"PK\x03\x04 and then nothing");
    let missing = folder.join("missing.csv");
    let files = [&empty, &strange, &number, &header, &archive, &missing, &good].map(PathBuf::as_path);
    let output = lab(&[&files[..], &[Path::new("--json")]].concat());
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{errors}");
    let expected = [
        "empty.csv: no known kind",
        "strange.csv: no known kind of recording begins with `when,what`",
        "number.csv: line 4: gyro_x: `zero` is not a number",
        "header.csv: no usable inertial sample",
        "archive.npz: array archive: ",
        "missing.csv: ",
    ];
    for expected in expected {
        assert_eq!(errors.matches(expected).count(), 1, "{expected} in\n{errors}");
    }
    assert_eq!(errors.lines().count(), expected.len(), "{errors}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let files = json["files"].as_array().unwrap();
    assert_eq!(files.len(), 1);
    assert_eq!(files[0]["file"], good.display().to_string());
    assert_eq!((&files[0]["kind"], &files[0]["diverged"]), (&"stampfly_flight".into(), &false.into()));
    for absent in ["end_xy_m", "max_xy_m", "tilt_rmse_deg", "tilt_rmse_aligned_deg", "total_rmse_deg"] {
        assert!(files[0].get(absent).unwrap().is_null(), "{absent}");
    }
    assert!(files[0]["updates_per_s"].as_f64().unwrap() > 0.0 && files[0]["rejected"].is_object());
}

#[test]
fn a_report_is_written_where_asked_for() {
    let folder = folder("report");
    let file = folder.join("bench.csv");
    std::fs::write(&file, still()).unwrap();
    let output = lab(&[&file]);
    assert!(output.status.success() && text(&output.stdout).contains("bench.csv"), "{output:?}");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "no report without --out");
    let out = folder.join("pages");
    let output = lab(&[&file, Path::new("--out"), &out, Path::new("--estimator"), Path::new("complementary")]);
    assert!(output.status.success(), "{output:?}");
    let page = std::fs::read_to_string(out.join("estimate_bench.html")).unwrap();
    assert!(page.starts_with("<!doctype html>") && page.contains("bench"));
}

#[test]
fn every_estimator_can_be_asked_for() {
    let file = folder("estimators").join("still.csv");
    std::fs::write(&file, still()).unwrap();
    for (estimator, sensors) in [("eskf", "gravity"), ("complementary", ""), ("attitude", "")] {
        let output = lab(&[&file, Path::new("--estimator"), Path::new(estimator), Path::new("--json")]);
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let figures = &json["files"][0];
        assert_eq!(figures["diverged"], false, "{estimator}: {figures}");
        let looked_at: Vec<_> = figures["rejected"].as_object().unwrap().keys().cloned().collect();
        assert_eq!(looked_at.join(" "), sensors, "{estimator}: {figures}");
    }
}

#[test]
fn a_wrong_option_is_named() {
    let file = folder("option").join("still.csv");
    std::fs::write(&file, still()).unwrap();
    for (option, expected) in
        [("eskf.gate=a", "'a' is not a number"), ("eskf.gat=1", "eskf.gat=1"), ("gate", "NAME=VALUE")]
    {
        let output = lab(&[&file, Path::new("--param"), Path::new(option)]);
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains(expected), "{}", text(&output.stderr));
    }
    let output = lab(&[]);
    assert_eq!(output.status.code(), Some(2), "a file is needed");
}

#[test]
fn a_clock_that_goes_back_is_told() {
    let file = folder("back").join("back.csv");
    let text_of = still();
    let (header, rows) = text_of.split_once('\n').unwrap();
    let rows: Vec<&str> = rows.lines().collect();
    std::fs::write(&file, [&[header], &rows[..150], &rows[100..]].concat().join("\n")).unwrap();
    let output = lab(&[&file]);
    assert!(output.status.success(), "{output:?}");
    let said = text(&output.stdout);
    assert!(said.contains("back.csv: the clock goes back: ") && said.contains("samples were left out"), "{said}");
    let output = lab(&[&file, Path::new("--json")]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(json["files"][0]["clock_back"].as_u64() > Some(20), "{json}");
}
