//! What `datagrams.json` is written from: datagrams of every kind, and bytes and lines that must be refused.
//!
//! The test `com` compares the file with this table, and the Python package is tested against the file. Written again by
//! `cargo xtask vectors --fix`, which asks the example `datagram_vectors`.

use serde_json::{Value, json};
use stampfly_link::datagram::Body as _;
use stampfly_link::{Datagram, DatagramError, json as line};
use stampfly_log::csv;
use stampfly_param::{ParameterAction, ParameterRequest, ParameterStatus, ParameterTable};
use stampfly_rover::Parameters;
use stampfly_rover::com::{Body, MAX};
use stampfly_rover::messages::*;
use stampfly_types::{FieldInfo, FieldKind, Instant, Message};

/// A line of the log with values of every length.
pub fn record() -> LogRecord {
    LogRecord {
        t: 12.34,
        throttle: 1.0 / 3.0,
        brake: 0.1,
        steer: -0.7,
        drive_accel_cmd: 2.0 / 3.0,
        brake_decel_cmd: 0.4,
        steer_angle_cmd: -0.28,
        x: 123.456,
        y: -1e-7,
        yaw: 3.437_683,
        v: 2.999_999_8,
        yaw_rate: -0.062_017_035,
        wheel_omega: 99.999_99,
        estop: true,
        system_state: SystemState::EStop,
    }
}

/// One of every kind at least, with extreme values.
pub fn datagrams() -> Vec<Datagram<Body>> {
    let input = DriverInput { throttle: 1.0, brake: f32::MIN_POSITIVE, steer: -1.0 };
    let bodies: Vec<Body> = vec![
        OperatorCommand::default().into(),
        OperatorCommand { throttle: 0.6, brake: 0.25, steer: 0.2, mode: InputMode::Demo, estop: true, reset: true }
            .into(),
        OperatorCommand { mode: InputMode::Replay, steer: -1.0, ..OperatorCommand::default() }.into(),
        ParameterRequest { action: ParameterAction::Set, index: 4, value: 0.05 }.into(),
        ParameterRequest { action: ParameterAction::RollBack, index: 0, value: -1.5e9 }.into(),
        DriveCommand { acceleration: 1.2 }.into(),
        input.into(),
        SafetyStatus {
            estop: false,
            system_state: SystemState::Degraded,
            stalled: Components::BRAKE | Components::COM,
        }
        .into(),
        LogRecord::default().into(),
        record().into(),
        ParameterStatus { version: 3, applied_at: Instant::from_micros(1 << 40), refused: u32::MAX }.into(),
        Subscription { every: 2 }.into(),
    ];
    let times = [0, 20_000, u64::MAX].map(Instant::from_micros).into_iter().cycle();
    let sequences = [0, 7, u32::MAX].into_iter().cycle();
    bodies
        .into_iter()
        .zip(times)
        .zip(sequences)
        .map(|((body, time), sequence)| Datagram { sequence, time, body })
        .collect()
}

/// As it is sent.
pub fn bytes(datagram: &Datagram<Body>) -> Vec<u8> {
    datagram.write(&mut [0; MAX]).expect("valid").to_vec()
}

/// Two digits a byte.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn kind_of(field: &FieldInfo) -> Value {
    match field.kind {
        FieldKind::F32 => json!("f32"),
        FieldKind::U32 | FieldKind::Flags(_) => json!("u32"),
        FieldKind::U64 => json!("u64"),
        FieldKind::Bool => json!("bool"),
        FieldKind::Enum(names) => names.iter().map(|(name, number)| json!([name, number])).collect(),
        kind => panic!("{kind:?} does not travel"),
    }
}

fn schema<M: Message>() -> Value {
    M::FIELDS.iter().map(|field| json!([field.name, kind_of(field), field.unit])).collect()
}

/// What must be refused, and why.
pub fn refused() -> Vec<(Vec<u8>, DatagramError)> {
    let good = bytes(&datagrams()[1]);
    let spoilt = |place: usize, values: &[u8]| {
        let mut bytes = good.clone();
        bytes[place..place + values.len()].copy_from_slice(values);
        // A datagram that differs in this value only has the right checksum, by the crate's own writer.
        let end = bytes.len() - 4;
        let checksum = crc32(&bytes[..end]);
        bytes[end..].copy_from_slice(&checksum.to_le_bytes());
        bytes
    };
    let mut damaged = good.clone();
    damaged[30] ^= 4;
    vec![
        (good[..good.len() - 1].to_vec(), DatagramError::Length),
        (Vec::new(), DatagramError::Length),
        (damaged, DatagramError::Checksum),
        (spoilt(0, b"RVR2"), DatagramError::Magic),
        (spoilt(4, &[2]), DatagramError::Version),
        (spoilt(5, &[99]), DatagramError::Kind),
        (spoilt(5, &[6]), DatagramError::Length),
        (spoilt(20, &1.5f32.to_le_bytes()), DatagramError::Range),
        (spoilt(28, &f32::NAN.to_le_bytes()), DatagramError::Range),
        (spoilt(32, &[3]), DatagramError::Value),
        (spoilt(36, &[2]), DatagramError::Value),
    ]
}

fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

/// Lines that must be refused, and why.
pub const REFUSED_LINES: [(&str, DatagramError); 5] = [
    ("{}", DatagramError::Syntax),
    (r#"{"@kind":"DriveCommand","@format":1,"@sequence":1,"@time":2}"#, DatagramError::Member),
    (r#"{"@kind":"DriveCommand","@format":1,"@sequence":1,"@time":2,"acceleration":"x"}"#, DatagramError::Value),
    (r#"{"@kind":"DriveCommand","@format":1,"@sequence":1,"@time":2,"acceleration":-1}"#, DatagramError::Range),
    (r#"{"@kind":"Drive","@format":1,"@sequence":1,"@time":2,"acceleration":1}"#, DatagramError::Kind),
];

/// The number with the fewest digits that is this one in single precision.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().expect("a number")
}

/// The text of the file.
pub fn vectors() -> String {
    let lines = datagrams().into_iter().map(|datagram| {
        let mut text = String::new();
        line::write(&datagram, &mut text).expect("valid");
        json!({ "bytes": hex(&bytes(&datagram)), "line": text.trim_end() })
    });
    let mut csv = String::new();
    csv::write_header::<LogRecord>(&mut csv).expect("a string takes everything");
    csv::write_line(&record(), &mut csv).expect("a string takes everything");
    let schemas = [
        ("OperatorCommand", schema::<OperatorCommand>()),
        ("ParameterRequest", schema::<ParameterRequest>()),
        ("DriveCommand", schema::<DriveCommand>()),
        ("DriverInput", schema::<DriverInput>()),
        ("SafetyStatus", schema::<SafetyStatus>()),
        ("LogRecord", schema::<LogRecord>()),
        ("ParameterStatus", schema::<ParameterStatus>()),
        ("Subscription", schema::<Subscription>()),
    ];
    let kinds = Body::KINDS.iter().zip(schemas).map(|((kind, name), (known, schema))| {
        assert_eq!(*name, known);
        json!({ "kind": kind, "name": name, "fields": schema })
    });
    let table = Parameters::TABLE.iter();
    let parameters = table.map(|row| {
        let [default, min, max] = [row.get(&Parameters::default()), row.info.min, row.info.max].map(decimal);
        json!([row.info.name, default, min, max, row.info.unit])
    });
    let vectors = json!({
        "origin": "written by `cargo xtask vectors --fix`",
        "kinds": kinds.collect::<Vec<_>>(),
        "components": Components::NAMES,
        "parameters": parameters.collect::<Vec<_>>(),
        "datagrams": lines.collect::<Vec<_>>(),
        "refused": refused().iter().map(|(bytes, error)| json!([hex(bytes), format!("{error:?}")])).collect::<Vec<_>>(),
        "refused_lines": REFUSED_LINES.map(|(line, error)| json!([line, format!("{error:?}")])),
        "csv": csv,
    });
    serde_json::to_string_pretty(&vectors).expect("values have JSON") + "\n"
}
