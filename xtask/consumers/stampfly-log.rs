//! A stranger's program: a log of one sample.

use stampfly_log::ulog::{Definitions, Message, Ram, Reader, Sample, Topic};
use stampfly_types::{Instant, Message as _, messages::PowerData};

const TOPICS: &[Topic] = &[Topic { name: "sensor_power", fields: PowerData::FIELDS }];

fn main() {
    let mut memory = [0; 4096];
    let definitions = Definitions::start(Ram::new(&mut memory), Instant::ZERO).expect("room");
    let mut log = definitions.data(TOPICS, &[]).expect("room");
    let words = PowerData { voltage: 3.9, current: 2.0, power: 7.8 }.to_words();
    log.sample(0, &Sample { at: Instant::from_micros(2_500), generation: 1, words: &words }).expect("room");
    let messages = Reader::new(log.sink().written()).expect("a ULog");
    assert_eq!(messages.filter(|message| matches!(message, Ok(Message::Data { .. }))).count(), 1);
}
