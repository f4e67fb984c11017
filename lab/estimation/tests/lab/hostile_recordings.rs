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

/// An element of a MATLAB file: type, length, bytes, and zeros to a multiple of eight.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let padding = vec![0; data.len().wrapping_neg() % 8];
    [&kind.to_le_bytes()[..], &(data.len() as u32).to_le_bytes(), data, &padding].concat()
}

fn zlib(data: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

/// A matrix of a MATLAB file, column after column.
fn matrix(name: &str, class: u8, size: [usize; 2], kind: u32, data: &[u8]) -> Vec<u8> {
    let flags = element(6, &[class, 0, 0, 0, 0, 0, 0, 0]);
    let size = element(5, &size.map(|size| (size as u32).to_le_bytes()).concat());
    // A name of up to four letters lies in its tag.
    let name = match name.len() {
        0..=4 => {
            [&1_u16.to_le_bytes()[..], &(name.len() as u16).to_le_bytes(), name.as_bytes(), &vec![0; 4 - name.len()]]
                .concat()
        }
        _ => element(1, name.as_bytes()),
    };
    element(14, &[flags, size, name, element(kind, data)].concat())
}

/// The head of a MATLAB file and these elements, compressed or not.
fn matlab(elements: &[Vec<u8>], is_compressed: bool) -> Vec<u8> {
    let mut file = format!("{:<124}", "MATLAB 5.0 MAT-file Platform: posix, Created on: Fri May  7 2021").into_bytes();
    file.extend(b"\x00\x01IM");
    for element in elements {
        if is_compressed {
            let packed = zlib(element);
            file.extend(15_u32.to_le_bytes());
            file.extend((packed.len() as u32).to_le_bytes());
            file.extend(packed);
        } else {
            file.extend(element);
        }
    }
    file
}

/// A BROAD trial of `rows` samples as published, lying still.
fn published_trial(rows: usize) -> Vec<Vec<u8>> {
    let doubles = |row: &[f64]| -> Vec<u8> { row.iter().flat_map(|value| value.to_le_bytes().repeat(rows)).collect() };
    let text: Vec<u8> = "Berlin".encode_utf16().flat_map(u16::to_le_bytes).collect();
    vec![
        matrix("imu_gyr", 6, [rows, 3], 9, &doubles(&[0.0, 0.0, 0.0])),
        matrix("imu_acc", 6, [rows, 3], 9, &doubles(&[0.0, 0.0, 9.81])),
        matrix("imu_mag", 6, [rows, 3], 9, &doubles(&[0.0, 20.0, -40.0])),
        matrix("opt_quat", 6, [rows, 4], 9, &doubles(&[1.0, 0.0, 0.0, 0.0])),
        matrix("opt_pos", 6, [rows, 3], 9, &doubles(&[1.0, 2.0, 3.0])),
        matrix("sampling_rate", 6, [1, 1], 9, &100.0_f64.to_le_bytes()),
        matrix("movement", 9, [rows, 1], 2, &vec![1; rows]),
        matrix("info", 4, [1, 6], 4, &text),
    ]
}

/// NanoBench's table of so many rows, as published: a vehicle at rest.
fn published_flight(rows: usize) -> String {
    let header = "t,px,py,pz,qx,qy,qz,qw,roll,pitch,yaw,vx,vy,vz,wx_vicon,wy_vicon,wz_vicon,imu_acc_x,imu_acc_y,imu_acc_z,\
                  imu_gyro_x,imu_gyro_y,imu_gyro_z,motor_motor_m1,motor_motor_m2,motor_motor_m3,motor_motor_m4,\
                  est_stateEstimate_x,est_stateEstimate_y,est_stateEstimate_z,est_stateEstimate_vx,est_stateEstimate_vy,\
                  est_stateEstimate_vz,est_stateEstimate_ax,est_stateEstimate_ay,est_stateEstimate_az,\
                  att_stateEstimate_roll,att_stateEstimate_pitch,att_stateEstimate_yaw,att_stateEstimate_qx,\
                  att_stateEstimate_qy,att_stateEstimate_qz,att_stateEstimate_qw,sp_ctrltarget_x,sp_ctrltarget_y,\
                  sp_ctrltarget_z,sp_ctrltarget_yaw,pid_controller_roll,pid_controller_pitch,pid_controller_yaw,\
                  pid_controller_cmd_thrust,pwr_pm_vbat";
    let row = |n: usize| {
        let time = 1_772_422_003.5 + n as f64 * 0.01;
        format!(
            "{time:.9},0.1,0.2,0.3,0,0,0,1{},0,0,1,0,0,0.0{}{},1{}\n",
            ",0".repeat(9),
            n % 7,
            ",0".repeat(19),
            ",0".repeat(9)
        )
    };
    format!("{header}\n{}", (0..rows).map(row).collect::<String>())
}

/// A small recording of every kind, in every form in which it is read.
pub fn recordings() -> Vec<(&'static str, Vec<u8>)> {
    let capture = |n: usize| format!("{},0,0,0.0{},0,0,-9.81\n", n * 10, n % 7);
    let replay = |n: usize| format!("{},imu,0,0,-0.098,0,0,0,10000,10000\n", n * 10_000);
    let capture = format!("{FLIGHT_HEADER}\n{}", (0..100).map(capture).collect::<String>());
    vec![
        ("sensor log", log(60).into_bytes()),
        ("flight capture", capture.into_bytes()),
        ("NanoBench", published_flight(60).into_bytes()),
        ("BROAD", matlab(&published_trial(40), true)),
        ("BROAD, not compressed", matlab(&published_trial(40), false)),
        ("BROAD as arrays", archive(&trial(40))),
        ("PX4 replay", (1..100).map(replay).collect::<String>().into_bytes()),
    ]
}

#[test]
fn a_trial_is_read_as_published() {
    let converted = dataset::parse("still", &archive(&trial(3))).unwrap();
    for is_compressed in [false, true] {
        let published = dataset::parse("still", &matlab(&published_trial(3), is_compressed)).unwrap();
        assert_eq!(published, converted, "compressed: {is_compressed}");
    }
}

#[test]
fn a_flight_is_read_as_published() {
    let flight = dataset::parse("circle", published_flight(50).as_bytes()).unwrap();
    assert_eq!((flight.kind, flight.imu.len(), flight.truth.len()), (Kind::NanoBench, 50, 50));
    assert_eq!(flight.imu[49].at.as_micros(), 490_000, "its clock begins with its first row");
    assert!((flight.imu[3].data.accel.z + 9.806_65).abs() < 1e-4, "{:?}", flight.imu[3].data.accel);
    assert_eq!(flight.truth[7].position.map(|place| [place.x, place.y, place.z]), Some([0.1, -0.2, -0.3]));
}

#[test]
fn columns_are_found_in_any_order_and_among_others() {
    let plain = log(50);
    let turned: String = plain
        .lines()
        .enumerate()
        .map(|(n, line)| {
            let other = if n == 0 { "gyro_bias_x,pos_x" } else { "7,7" };
            let turned: Vec<&str> = line.split(',').rev().collect();
            format!("{other},{}\n", turned.join(","))
        })
        .collect();
    let [plain, turned] = [plain, turned].map(|text| dataset::parse("x", text.as_bytes()).unwrap());
    assert_eq!(plain, turned);
}

#[test]
fn a_clock_that_goes_back_is_counted() {
    let text = published_flight(300);
    let (header, rows) = text.split_once('\n').unwrap();
    let rows: Vec<&str> = rows.lines().collect();
    let text = [&[header], &rows[..200], &rows[100..]].concat().join("\n");
    let flight = dataset::parse("back", text.as_bytes()).unwrap();
    assert_eq!((flight.imu.len(), flight.timing.backwards), (301, 99), "one of a hundred has the stamp of the last");
    assert!(flight.truth.windows(2).all(|pair| pair[0].at <= pair[1].at));
    let figures = estimate::run(&flight, &estimate::suite(flight.kind)).figures;
    assert_eq!(figures.clock_back, 99);
}

#[test]
fn hdf5_is_refused_with_a_way_out() {
    for begins in [&b"\x89HDF\r\n\x1a\n"[..], b"MATLAB 7.3 MAT-file"] {
        let error = dataset::parse("x", begins).unwrap_err().to_string();
        assert!(error.contains("HDF5 is not read") && error.contains("data_mat"), "{error}");
    }
}

/// Small files that unpack to much, or claim to.
fn bombs() -> Vec<(&'static str, Vec<u8>)> {
    let zeros = vec![0; 100_000_000];
    let of = |size, kind, data: &[u8]| matlab(&[matrix("imu_gyr", 6, size, kind, data)], true);
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    for name in ["a.npy", "b.npy"] {
        zip.start_file(name, options).unwrap();
        zip.write_all(&npy("|u1", "(99999000,)", &zeros[..99_999_000])).unwrap();
    }
    let mut texts = zip::ZipWriter::new(Cursor::new(Vec::new()));
    texts.start_file("cols.npy", options).unwrap();
    texts.write_all(&npy("<U1", "(8000000,)", &zeros[..32_000_000])).unwrap();
    vec![
        ("zip", zip.finish().unwrap().into_inner()),
        ("texts", texts.finish().unwrap().into_inner()),
        ("bytes", of([33_000_000, 3], 2, &zeros[..99_000_000])),
        ("many matrices", {
            let one = matrix("imu_gyr", 6, [1_000_000, 3], 2, &zeros[..3_000_000]);
            matlab(&vec![one; 30], true)
        }),
        ("claims", of([0xffff_ffff, 0xffff_ffff], 9, &[0; 8])),
        ("nothing", of([0xffff_ffff, 0], 9, &[])),
    ]
}

#[test]
fn small_files_that_unpack_to_much_are_refused() {
    for (what, bytes) in bombs() {
        let began = std::time::Instant::now();
        let error = dataset::parse("bomb", &bytes).unwrap_err();
        println!("{what}: {} bytes, {:?}: {error}", bytes.len(), began.elapsed());
        assert!(began.elapsed().as_secs_f64() < 2.0, "{what}: {:?}", began.elapsed());
    }
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
    fn damaged_matrices(
        which in 0usize..8,
        changes in prop::collection::vec(any::<(prop::sample::Index, u8)>(), 1..12),
        is_compressed: bool,
    ) {
        let mut elements = published_trial(5);
        damage(&mut elements[which], &changes);
        survives(&matlab(&elements, is_compressed))?;
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
