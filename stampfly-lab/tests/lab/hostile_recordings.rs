//! Files that only look like recordings, without needing any real one.

use proptest::prelude::*;
use stampfly_lab::dataset::{self, DatasetErrorKind, Kind};
use stampfly_lab::estimate;
use std::io::{Cursor, Write};

const LOG_HEADER: &str = "timestamp_ms,dt_ms,raw_accel_x,raw_accel_y,raw_accel_z,raw_gyro_x,raw_gyro_y,raw_gyro_z,\
    raw_baro_alt,raw_tof,raw_flow_squal,raw_flow_dx,raw_flow_dy,dev_pos_x,dev_pos_y,dev_pos_z,dev_vel_x,dev_vel_y,\
    dev_vel_z,dev_roll_deg,dev_pitch_deg,dev_yaw_deg";
const FLIGHT_HEADER: &str = "timestamp_ms,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z";

fn log(rows: usize) -> String {
    let row =
        |n: usize| format!("{},10.0,{},0.1,-9.8,0,0,0,28.8,0.037,136,0,1{}\n", n * 11, n as f32 * 0.01, ",0".repeat(9));
    format!("{LOG_HEADER}\n{}", (1..=rows).map(row).collect::<String>())
}

/// A `.npy` file of these numbers.
fn npy(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((header.len() as u16).to_le_bytes());
    file.extend(header.bytes());
    file.extend(data);
    file
}

/// The arrays of a BROAD trial of `rows` samples, lying still.
fn trial(rows: usize) -> Vec<(&'static str, Vec<u8>)> {
    let floats = |row: &[f32]| row.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>().repeat(rows);
    vec![
        ("gyr", npy("<f4", &format!("({rows}, 3)"), &floats(&[0.0, 0.0, 0.0]))),
        ("acc", npy("<f4", &format!("({rows}, 3)"), &floats(&[0.0, 0.0, 9.81]))),
        ("mag", npy("<f4", &format!("({rows}, 3)"), &floats(&[0.0, 20.0, -40.0]))),
        ("quat", npy("<f4", &format!("({rows}, 4)"), &floats(&[1.0, 0.0, 0.0, 0.0]))),
        ("pos", npy("<f4", &format!("({rows}, 3)"), &floats(&[1.0, 2.0, 3.0]))),
        ("movement", npy("|u1", &format!("({rows},)"), &vec![1; rows])),
        ("fs", npy("<f8", "()", &100.0f64.to_le_bytes())),
    ]
}

fn archive(arrays: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in arrays {
        let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        zip.start_file(format!("{name}.npy"), options).unwrap();
        zip.write_all(content).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

#[test]
fn frames_of_a_trial_become_ours() {
    let recording = dataset::parse("still", &archive(&trial(3))).unwrap();
    assert_eq!((recording.kind, recording.imu.len(), recording.mag.len()), (Kind::Broad, 3, 3));
    let truth = recording.truth[2];
    let force = truth.attitude.unwrap() * recording.imu[2].data.accel;
    assert!((force.z + 9.81).abs() < 1e-5 && force.horizontal().norm() < 1e-5, "up is up: {force:?}");
    let field = truth.attitude.unwrap() * recording.mag[2].data.field;
    assert!((field.x - 20.0).abs() < 1e-4 && (field.z - 40.0).abs() < 1e-4, "north and down: {field:?}");
    let place = truth.position.unwrap();
    assert_eq!([place.x, place.y, place.z], [2.0, 1.0, -3.0]);
    assert_eq!(truth.at.as_micros(), 20_000);
}

#[test]
fn errors_say_where() {
    let message = |bytes: &[u8]| dataset::parse("x", bytes).unwrap_err().to_string();
    assert_eq!(message(b""), "no known kind of recording begins with ``");
    assert_eq!(message(b"hello,world\n1,2\n"), "no known kind of recording begins with `hello,world`");
    assert_eq!(message(FLIGHT_HEADER.as_bytes()), "no usable inertial sample");
    assert_eq!(message(format!("{FLIGHT_HEADER}\n1,2,3\n").as_bytes()), "line 2: line: 3 cells where the header has 7");
    let text = format!("{FLIGHT_HEADER}\n1,0,0,0,0,0,-9.8\n2,0,0,0,oops,0,-9.8\n");
    assert_eq!(message(text.as_bytes()), "line 3: accel_x: `oops` is not a number");
    let text = format!("{FLIGHT_HEADER}\n-1,0,0,0,0,0,-9.8\n");
    assert_eq!(message(text.as_bytes()), "line 2: timestamp_ms: -1 is not a time");
    let text = log(2).replace("raw_tof", "raw_fot");
    assert_eq!(message(text.as_bytes()), "line 1: raw_tof: no such column");
    let mut arrays = trial(3);
    arrays[3].1 = npy("<f4", "(3, 3)", &[0; 36]);
    assert_eq!(message(&archive(&arrays)), "array quat: 3 columns, not 4");
    let mut arrays = trial(3);
    arrays[0].1 = npy("<f4", "(4, 3)", &[0; 48]);
    assert!(message(&archive(&arrays)).contains("3 rows where gyr has 4"));
    assert!(message(&archive(&arrays[..2])).contains("NPZ with acc, gyr"));
    assert!(message(b"PK and nothing").starts_with("array archive: "));
    let missing = dataset::load("no/such/file.csv").unwrap_err();
    assert!(matches!(missing.kind, DatasetErrorKind::Io(_)) && missing.to_string().starts_with("no/such/file.csv: "));
}

/// Reading must end without a panic and, if it succeeds, with samples in order.
fn survives(bytes: &[u8]) -> Result<(), TestCaseError> {
    if let Ok(recording) = dataset::parse("hostile", bytes) {
        prop_assert!(!recording.imu.is_empty());
        prop_assert!(recording.imu.windows(2).all(|pair| pair[0].at < pair[1].at));
        prop_assert!(recording.imu.iter().all(|s| s.data.accel.iter().chain(&s.data.gyro).all(|v| v.is_finite())));
        // Neither may the estimator fall over it, whatever it makes of it.
        let estimated = estimate::run(&recording, &estimate::suite(recording.kind));
        prop_assert!(estimated.drive.instances.len() <= recording.imu.len());
        prop_assert!(serde_json::to_string(&estimated.figures).is_ok());
        let _ = estimated.to_flight(&recording);
    }
    Ok(())
}

fn damage(bytes: &mut [u8], changes: &[(prop::sample::Index, u8)]) {
    for (index, byte) in changes.iter().filter(|_| !bytes.is_empty()).copied().collect::<Vec<_>>() {
        let index = index.index(bytes.len());
        bytes[index] = byte;
    }
}

proptest! {
    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..500)) {
        survives(&bytes)?;
    }

    #[test]
    fn any_cells(rows in prop::collection::vec("[-0-9.eEnaif,]{0,60}", 0..20)) {
        for header in [LOG_HEADER, FLIGHT_HEADER, "10,imu,0,0,-9.8,0,0,0"] {
            survives(format!("{header}\n{}", rows.join("\n")).as_bytes())?;
        }
    }

    #[test]
    fn damaged_logs(changes in prop::collection::vec(any::<(prop::sample::Index, u8)>(), 1..20), keep in 0usize..6_000) {
        let mut bytes = log(60).into_bytes();
        damage(&mut bytes, &changes);
        bytes.truncate(keep);
        survives(&bytes)?;
    }

    #[test]
    fn damaged_arrays_in_an_intact_archive(
        which in 0usize..7,
        changes in prop::collection::vec(any::<(prop::sample::Index, u8)>(), 1..12),
        keep in any::<prop::sample::Index>(),
        cut: bool,
    ) {
        let mut arrays = trial(5);
        let content = &mut arrays[which].1;
        damage(content, &changes);
        if cut {
            content.truncate(keep.index(content.len()));
        }
        survives(&archive(&arrays))?;
    }
}
