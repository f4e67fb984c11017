//! Logs as others write them, message by message: formats within formats, instances, samples
//! without a time.

/// A log that was started at this instant, µs, with nothing in it.
pub fn begun(started: u64) -> Vec<u8> {
    let mut log = b"ULog\x01\x12\x35\x01".to_vec();
    log.extend(started.to_le_bytes());
    message(&mut log, b'B', &[&[0; 40]]);
    log
}

pub fn message(log: &mut Vec<u8>, kind: u8, parts: &[&[u8]]) {
    let payload = parts.concat();
    log.extend(u16::try_from(payload.len()).expect("fits").to_le_bytes());
    log.push(kind);
    log.extend(payload);
}

pub fn format(log: &mut Vec<u8>, text: &str) {
    message(log, b'F', &[text.as_bytes()]);
}

pub fn subscribe(log: &mut Vec<u8>, id: u16, instance: u8, topic: &str) {
    message(log, b'A', &[&[instance], &id.to_le_bytes(), topic.as_bytes()]);
}

pub fn sample(log: &mut Vec<u8>, id: u16, at: u64, rest: &[u8]) {
    message(log, b'D', &[&id.to_le_bytes(), &at.to_le_bytes(), rest]);
}

/// A log such as PX4's: set-points within one, four reports in an array, two instances of one topic
/// under three numbers, a sample without a time, marks. Started at 1,000 s.
pub fn px4_like() -> Vec<u8> {
    const START: u64 = 1_000_000_000;
    let mut log = begun(START);
    message(&mut log, b'I', &[&[16], b"char[3] sys_name", b"PX4"]);
    message(&mut log, b'P', &[&[19], b"float MPC_XY_VEL_MAX"[..19].as_ref(), &12.0_f32.to_le_bytes()]);
    format(
        &mut log,
        "position_setpoint_triplet:uint64_t timestamp;position_setpoint previous;position_setpoint current;",
    );
    format(&mut log, "position_setpoint:uint64_t timestamp;double lat;float yaw;bool valid;uint8_t[3] _padding0;");
    format(&mut log, "esc_status:uint64_t timestamp;uint16_t counter;uint8_t[6] _padding0;esc_report[4] esc;");
    format(&mut log, "esc_report:uint64_t timestamp;int32_t esc_rpm;float[2] esc_voltage;uint8_t[4] _padding0;");
    format(&mut log, "sensor_accel:uint64_t timestamp;float x;");
    subscribe(&mut log, 0, 0, "position_setpoint_triplet");
    subscribe(&mut log, 1, 0, "esc_status");
    subscribe(&mut log, 2, 0, "sensor_accel");
    subscribe(&mut log, 3, 1, "sensor_accel");
    for n in 0..20_u32 {
        let at = START + 10_000 * u64::from(n);
        let setpoint =
            |lat: f64| [&at.to_le_bytes()[..], &lat.to_le_bytes(), &0.5_f32.to_le_bytes(), &[1], &[0; 3]].concat();
        sample(&mut log, 0, if n == 0 { 0 } else { at }, &[setpoint(1.0), setpoint(f64::from(n))].concat());
        let report = |rpm: i32| {
            let volts = [3.5_f32, rpm as f32].map(f32::to_le_bytes).concat();
            [&at.to_le_bytes()[..], &rpm.to_le_bytes(), &volts, &[0; 4]].concat()
        };
        let reports: Vec<u8> = (0..4).flat_map(|esc| report(esc * 100 + n.cast_signed())).collect();
        sample(&mut log, 1, at, &[&(n as u16).to_le_bytes()[..], &[0; 6], &reports].concat());
        for id in [2, 3] {
            sample(&mut log, id, at, &(f32::from(id) + n as f32).to_le_bytes());
        }
        if n == 9 {
            // Once more under another number, and its format once more.
            format(&mut log, "sensor_accel:uint64_t timestamp;float x;");
            subscribe(&mut log, 7, 1, "sensor_accel");
        }
        if n > 9 {
            sample(&mut log, 7, at + 5_000, &100.0_f32.to_le_bytes());
        }
        message(&mut log, b'S', &[&[0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12]]);
    }
    message(&mut log, b'L', &[b"6", &START.to_le_bytes(), b"[commander] armed"]);
    log
}

/// Small files that claim much: name, and bytes.
pub fn hostile() -> Vec<(&'static str, Vec<u8>)> {
    let of = |formats: &[&str], topics: usize| {
        let mut log = begun(1);
        formats.iter().for_each(|text| format(&mut log, text));
        for id in 0..topics {
            subscribe(&mut log, id as u16, (id % 256) as u8, "x");
            sample(&mut log, id as u16, 1_000, &[0; 16]);
        }
        log
    };
    let name = "n".repeat(60_000);
    let many = "bool a;".repeat(9_000);
    let padding = "bool _padding;".repeat(4_600);
    let names = {
        let mut log = of(&["x:uint64_t timestamp;uint8_t state;"], 256);
        let values: String = (0..5_000).map(|n| format!("a{n}={n} ")).collect();
        message(&mut log, b'I', &[&[21], b"char[9] names/x/state", values.as_bytes()]);
        log
    };
    vec![
        ("array", of(&["x:uint64_t timestamp;float[4000000000] x;"], 3)),
        ("longest array", of(&["x:uint64_t timestamp;bool[65000] x;"], 60_000)),
        ("itself", of(&["x:uint64_t timestamp;x y;"], 3)),
        ("itself often", of(&["x:uint64_t timestamp;x[4000000000] y;"], 60_000)),
        ("nothing often", of(&["x:uint64_t timestamp;e[4000000000] y;", "e:"], 60_000)),
        (
            "nothing in nothing",
            of(&["x:uint64_t timestamp;a[65535] y;", "a:b[65535] y;", "b:c[65535] y;", "c:"], 60_000),
        ),
        ("padding", of(&["x:uint64_t timestamp;p[60000] y;", &format!("p:{padding}")], 60_000)),
        ("long names", of(&[&format!("x:uint64_t timestamp;float[9000] {name};")], 60_000)),
        (
            "long padding often",
            of(&["x:uint64_t timestamp;p[60000] y;", &format!("p:uint8_t _padding{name};")], 60_000),
        ),
        ("many fields", of(&[&format!("x:uint64_t timestamp;{many}")], 60_000)),
        ("names of values", names),
        ("many topics", {
            let mut log = begun(1);
            for id in 0..60_000_u16 {
                format(&mut log, &format!("t{id}:uint64_t timestamp;float x;"));
                subscribe(&mut log, id, 0, &format!("t{id}"));
                sample(&mut log, id, 1_000, &[0; 4]);
            }
            log
        }),
        ("formats that change", {
            let mut log = begun(1);
            for n in 0..20_000_u32 {
                format(&mut log, &format!("x:uint64_t timestamp;float x{n};"));
                subscribe(&mut log, n as u16, 0, "x");
            }
            log
        }),
        ("damage everywhere", [begun(1), [9, 0, b'F'].repeat(300_000)].concat()),
        ("zeros", [begun(1), vec![0; 1_000_000]].concat()),
    ]
}
