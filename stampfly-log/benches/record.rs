//! Time to hash, write and read records: `cargo bench -p stampfly-log`.

use criterion::{Criterion, Throughput};
use stampfly_log::FlightHash;
use stampfly_log::ulog::{Definitions, Reader, Sample, Sink, Topic};
use stampfly_types::messages::{ImuData, StateEstimate};
use stampfly_types::{Instant, Message};
use std::hint::black_box;

/// Discards everything.
struct Nowhere;

impl Sink for Nowhere {
    type Error = core::convert::Infallible;
    fn write(&mut self, bytes: &[u8]) -> Result<(), Self::Error> {
        black_box(bytes);
        Ok(())
    }
}

/// Grows without limit.
struct Bytes(Vec<u8>);

impl Sink for Bytes {
    type Error = core::convert::Infallible;
    fn write(&mut self, bytes: &[u8]) -> Result<(), Self::Error> {
        self.0.extend_from_slice(bytes);
        Ok(())
    }
}

const TOPICS: &[Topic] = &[
    Topic { name: "sensor_imu", fields: ImuData::FIELDS },
    Topic { name: "estimate_state", fields: StateEstimate::FIELDS },
];

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let imu = ImuData { temperature: 25.0, ..Default::default() }.to_words();
    let state = StateEstimate::default().to_words();

    let mut hash = FlightHash::new();
    criterion.bench_function("hash/sensor_imu", |b| {
        b.iter(|| hash.publish(0, 1, Instant::from_micros(2_500), black_box(&imu)))
    });
    criterion.bench_function("hash/estimate_state", |b| {
        b.iter(|| hash.publish(1, 1, Instant::from_micros(2_500), black_box(&state)))
    });
    black_box(hash.finish());

    let mut log = Definitions::start(Nowhere, Instant::ZERO)
        .and_then(|log| log.data(TOPICS))
        .expect("these sinks take everything");
    for (name, topic, words) in [("write/sensor_imu", 0, &imu[..]), ("write/estimate_state", 1, &state[..])] {
        let sample = Sample { at: Instant::from_micros(2_500), generation: 1, words };
        criterion.bench_function(name, |b| b.iter(|| log.sample(topic, black_box(&sample))));
    }

    let mut log = Definitions::start(Bytes(Vec::new()), Instant::ZERO)
        .and_then(|log| log.data(TOPICS))
        .expect("these sinks take everything");
    for generation in 0..10_000 {
        for (topic, words) in [(0, &imu[..]), (1, &state[..])] {
            let _ = log.sample(topic, &Sample { at: Instant::ZERO, generation, words });
        }
    }
    let bytes = log.into_sink().0;
    let mut group = criterion.benchmark_group("read");
    group.throughput(Throughput::Bytes(bytes.len() as u64));
    group.bench_function("20000 samples", |b| b.iter(|| Reader::new(black_box(&bytes)).map(Iterator::count)));
    group.finish();
    criterion.final_summary();
}
