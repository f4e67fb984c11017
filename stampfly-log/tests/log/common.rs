//! Shared by the tests: a growing sink, topics of every kind, a small log.

use stampfly_log::ActivationTopic;
use stampfly_log::ulog::{Definitions, Level, Sample, Sink, Topic, Writer};
use stampfly_types::messages::{
    EstimatorStatus, FlightStatus, ImuData, PowerData, Signal, StateEstimate, SystemAlert, TofData,
};
use stampfly_types::{ActivationRecord, InputRecord};
use stampfly_types::{Duration, Instant, Message, Vec3, message};

/// Bytes in memory, without limit.
#[derive(Default)]
pub struct Bytes(pub Vec<u8>);

impl Sink for Bytes {
    type Error = core::convert::Infallible;
    fn write(&mut self, bytes: &[u8]) -> Result<(), Self::Error> {
        self.0.extend_from_slice(bytes);
        Ok(())
    }
}

message! {
    /// A nested message.
    pub struct Part {
        /// An option in a message in an array.
        known: Option<Duration> ["us"],
        /// Sixteen digits.
        share: f64,
    }
}

message! {
    /// One field of every kind that the messages of the stack do not use.
    pub struct Odd {
        /// Two words.
        wide: u64 ["us"],
        /// An array of two words each.
        wides: [u64; 2] ["us"],
        /// Tests sign extension.
        signed: i16,
        /// Tests sign extension.
        signeds: [i16; 3],
        /// Sixteen bits.
        half: u16,
        /// Tests sign extension.
        integer: i32,
        /// Time.
        at: Instant ["us"],
        /// Tests sign extension.
        both_ways: i64 ["us"],
        /// Sixteen digits.
        precise: f64,
        /// Tests sign extension.
        small: i8,
        /// Longer than the arrays that implement `Default`.
        many: [i8; 40],
        /// An optional value.
        maybe: Option<Vec3> ["m/s"],
        /// Messages in an array.
        part: [Part; 2],
    }
}

pub const TOPICS: &[Topic] = &[
    Topic { name: "sensor_imu", fields: ImuData::FIELDS },
    Topic { name: "sensor_tof", fields: TofData::FIELDS },
    Topic { name: "sensor_power", fields: PowerData::FIELDS },
    Topic { name: "estimate_state", fields: StateEstimate::FIELDS },
    Topic { name: "estimate_status", fields: EstimatorStatus::FIELDS },
    Topic { name: "flight_status", fields: FlightStatus::FIELDS },
    Topic { name: "system_alert", fields: SystemAlert::FIELDS },
    Topic { name: "signal", fields: Signal::FIELDS },
    Topic { name: "odd", fields: Odd::FIELDS },
];

pub const ACTIVATIONS: &[ActivationTopic] = &[
    ActivationTopic { name: "estimation", index: 0, inputs: 3 },
    ActivationTopic { name: "control", index: 3, inputs: 1 },
    ActivationTopic { name: "heartbeat", index: 9, inputs: 0 },
];

pub fn start() -> Writer<Bytes, (&'static [Topic], &'static [ActivationTopic])> {
    let mut log = Definitions::start(Bytes::default(), Instant::from_micros(1_000)).unwrap();
    log.info("sys_name", "StampFly").unwrap();
    log.parameter("rate_roll_p", 0.6.into()).unwrap();
    log.parameter("loop_rate", 400.into()).unwrap();
    log.data((TOPICS, ACTIVATIONS)).unwrap()
}

/// A log with at least one message of every type that the writer supports.
pub fn small_log() -> Vec<u8> {
    let mut log = start();
    for step in 0..20u32 {
        let at = Instant::from_micros(1_000 + u64::from(step) * 2_500);
        let imu = ImuData { temperature: 25.0 + step as f32, ..Default::default() };
        log.sample(0, &Sample { at, generation: step, words: &imu.to_words() }).unwrap();
        let estimate = StateEstimate { height: step as f32, ..Default::default() };
        log.sample(3, &Sample { at, generation: step, words: &estimate.to_words() }).unwrap();
        let mut record = ActivationRecord::new(3, at);
        record.push(InputRecord { generation: step, taken: 1 }).unwrap();
        log.activation(&record).unwrap();
        if step % 5 == 0 {
            log.sync().unwrap();
            log.text(Level::Notice, at, "five more").unwrap();
        }
    }
    log.parameter("rate_roll_p", 0.7.into()).unwrap();
    log.into_sink().0
}
