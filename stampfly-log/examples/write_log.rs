//! Writes a small flight log for inspection with public tools:
//!
//! ```sh
//! cargo run -p stampfly-log --example write_log -- flight.ulg
//! ulog_info flight.ulg
//! ulog2csv flight.ulg
//! ```

use stampfly_log::ulog::{Definitions, Level, Sample, Sink, Topic};
use stampfly_log::{ActivationTopic, FlightHash};
use stampfly_types::messages::{FlightPhase, FlightStatus, ImuData, PowerData};
use stampfly_types::{ActivationRecord, GRAVITY, InputRecord, Instant, Message, Vec3, math};
use std::fs::File;
use std::io::{BufWriter, Write};

const TOPICS: &[Topic] = &[
    Topic { name: "sensor_imu", fields: ImuData::FIELDS },
    Topic { name: "sensor_power", fields: PowerData::FIELDS },
    Topic { name: "flight_status", fields: FlightStatus::FIELDS },
    // A second battery. Topics with the same name become instances of one topic.
    Topic { name: "sensor_power", fields: PowerData::FIELDS },
];
const IMU: usize = 0;
const POWER: usize = 1;
const MODE: usize = 2;
const SECOND_POWER: usize = 3;
const ACTIVATIONS: &[ActivationTopic] = &[ActivationTopic { name: "estimation", index: 0, inputs: 1 }];

/// A file. On a vehicle the sink is a radio link or a ring buffer in memory.
struct Disk(BufWriter<File>);

impl Sink for Disk {
    type Error = std::io::Error;
    fn write(&mut self, bytes: &[u8]) -> Result<(), Self::Error> {
        self.0.write_all(bytes)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "flight.ulg".to_owned());
    let mut log = Definitions::start(Disk(BufWriter::new(File::create(&path)?)), Instant::ZERO)?;
    log.info("sys_name", "StampFly")?;
    log.info("ver_hw", "example")?;
    log.parameter("loop_rate", 400.into())?;
    log.parameter("rate_roll_p", 0.65.into())?;

    let mut log = log.data((TOPICS, ACTIVATIONS))?;
    let mut hash = FlightHash::new();
    let mut publish = |log: &mut stampfly_log::ulog::Writer<Disk, (&[Topic], &[ActivationTopic])>,
                       topic: usize,
                       sample: Sample<'_>| {
        hash.publish(topic as u16, sample.generation, sample.at, sample.words);
        log.sample(topic, &sample)
    };
    for step in 0..2_000u32 {
        let at = Instant::from_micros(u64::from(step) * 2_500);
        let (sin, cos) = math::sin_cos(math::TAU * at.since(Instant::ZERO).seconds());
        let imu = ImuData {
            accel: Vec3::new(sin, cos, -GRAVITY),
            gyro: Vec3::new(0.0, 0.0, sin),
            temperature: 31.5,
            ..Default::default()
        };
        publish(&mut log, IMU, Sample { at, generation: step + 1, words: &imu.to_words() })?;
        let mut record = ActivationRecord::new(0, at);
        record.push(InputRecord { generation: step + 1, taken: 1 })?;
        log.activation(&record)?;
        if step % 40 == 0 {
            let power = PowerData { voltage: 4.1 - 0.1 * at.since(Instant::ZERO).seconds(), current: 2.0, power: 8.0 };
            publish(&mut log, POWER, Sample { at, generation: step / 40 + 1, words: &power.to_words() })?;
            let power = PowerData { voltage: 3.9, ..power };
            publish(&mut log, SECOND_POWER, Sample { at, generation: step / 40 + 1, words: &power.to_words() })?;
        }
        if step % 400 == 0 {
            log.sync()?;
            let phase = if step < 800 { FlightPhase::IdleGround } else { FlightPhase::Armed };
            let mode = FlightStatus { phase, armed: step >= 800, ..Default::default() };
            publish(&mut log, MODE, Sample { at, generation: step / 400 + 1, words: &mode.to_words() })?;
        }
        if step == 800 {
            log.text(Level::Info, at, "armed")?;
            log.parameter("rate_roll_p", 0.6.into())?;
        }
    }
    log.into_sink().0.flush()?;
    println!("{path}: {} messages, flight hash {:016x}", hash.messages(), hash.finish());
    Ok(())
}
