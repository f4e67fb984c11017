//! Writes a log into memory and reads it back as any tool would: from the formats in the file, not from our types.

use stampfly_log::FlightHash;
use stampfly_log::ulog::{Column, Definitions, Message, Ram, Reader, Sample, Topic};
use stampfly_types::messages::{PowerData, TofData};
use stampfly_types::{Instant, Message as _};
use std::collections::BTreeMap;

const TOPICS: &[Topic] =
    &[Topic { name: "sensor_power", fields: PowerData::FIELDS }, Topic { name: "sensor_tof", fields: TofData::FIELDS }];
const POWER: usize = 0;
const TOF: usize = 1;

fn write(memory: &mut [u8]) -> Result<usize, Box<dyn std::error::Error>> {
    let mut log = Definitions::start(Ram::new(memory), Instant::ZERO)?;
    log.info("sys_name", "StampFly")?;
    let mut log = log.data(TOPICS, &[])?;
    let mut hash = FlightHash::new();
    for k in 1..=5u32 {
        let at = Instant::from_micros(u64::from(k) * 100_000);
        let power = PowerData { voltage: 4.1 - 0.02 * k as f32, current: 3.0, power: 12.0 };
        let range = TofData { distance: 0.1 * k as f32, valid: k > 1, ..Default::default() };
        for (topic, words) in [(POWER, power.to_words().as_slice()), (TOF, range.to_words().as_slice())] {
            log.sample(topic, &Sample { at, generation: k, words })?;
            hash.publish(topic as u16, k, at, words);
        }
    }
    println!("{} samples written, hash {:016x}", hash.messages(), hash.finish());
    Ok(log.into_sink().written().len())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut memory = [0; 8192];
    let length = write(&mut memory)?;
    println!("{length} bytes\n");

    let mut columns: BTreeMap<&str, Vec<Column<'_>>> = BTreeMap::new();
    let mut topics: BTreeMap<u16, &str> = BTreeMap::new();
    for message in Reader::new(&memory[..length]).map_err(|e| format!("{e:?}"))? {
        match message.map_err(|e| format!("{e:?}"))? {
            Message::Format(format) => {
                columns.insert(format.name, format.columns().filter_map(Result::ok).collect());
            }
            Message::Subscription { id, topic, .. } => {
                topics.insert(id, topic);
            }
            Message::Data { id, payload } => {
                let topic = topics.get(&id).ok_or("data of no topic")?;
                let values = columns
                    .get(topic)
                    .into_iter()
                    .flatten()
                    .filter_map(|column| Some(format!("{} {:.3}", column.field, column.read(payload)?)));
                println!("{topic:<14} {}", values.collect::<Vec<_>>().join("  "));
            }
            _ => {}
        }
    }
    Ok(())
}
