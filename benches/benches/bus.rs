//! One publish and one read of the IMU message: the bus beside its peers, interleaved in one run.
//!
//! `heapless::spsc` moves a value to one reader and no further; `embassy-sync`'s `Watch` and `PubSubChannel` offer
//! several readers under a critical section. A reader either looks whether there is something (polling) or has been
//! waiting for it and is woken (waiting): on the bus the publisher calls a hook, on `Watch` and `PubSubChannel` it
//! wakes the reader's future. The last lines print the ratios of the medians of seven interleaved rounds, which is the
//! figure to quote: single rounds vary with whatever else the machine does.

use criterion::{Criterion, criterion_group};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pubsub::{PubSubChannel, WaitResult};
use embassy_sync::watch::Watch;
use heapless::spsc;
use stampfly_types::messages::ImuData;
use stampfly_types::{Instant, Vec3};
use std::future::Future;
use std::hint::black_box;
use std::pin::pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Waker};

/// What is measured.
mod topics {
    use stampfly_types::messages::ImuData;

    stampfly_bus::topics! {
        outside imu, estimation, failsafe;

        /// A sample.
        sensor_imu: ImuData = ring(16) @ 400 Hz from imu => [estimation, failsafe];
        /// The newest sample.
        newest_imu: ImuData = latest @ 400 Hz from imu => [estimation];
    }
}

static WOKEN: AtomicBool = AtomicBool::new(false);

/// What an executor's hook does at least.
fn wake(_topic: usize) {
    WOKEN.store(true, Ordering::Release);
}

type Timed = (Instant, ImuData);

fn sample(seed: u64) -> ImuData {
    let x = seed as f32 * 1e-3;
    ImuData { accel: Vec3::new(x, -x, -9.81), gyro: Vec3::new(0.5 * x, x, -x), temperature: 25.0, ..Default::default() }
}

/// Somebody who measures. A trait, so that each contender is measured by code of its own, without a call in between.
trait Measure {
    /// Measures one publish and read. What was read goes into a black box whole, so nobody gets away with a part of it.
    fn contender(&mut self, name: &'static str, round: impl FnMut(u64) -> Option<ImuData>);
}

/// Hands every contender's publish-and-read to `measure`, in turn.
fn contenders(measure: &mut impl Measure) {
    let mut bus = topics::Bus::new();
    let topics::Outside { imu, estimation, failsafe: _other } = bus.split(None).outside;
    let (mut tx, mut rx) = (imu.sensor_imu, estimation.sensor_imu);
    measure.contender("stampfly-bus ring, polling", |k| {
        tx.publish(Instant::from_micros(k), &sample(k));
        rx.next().map(|s| s.data)
    });

    let (mut tx, mut rx) = (imu.newest_imu, estimation.newest_imu);
    measure.contender("stampfly-bus latest, polling", |k| {
        tx.publish(Instant::from_micros(k), &sample(k));
        rx.latest().map(|s| s.data)
    });

    let mut bus = topics::Bus::new();
    let topics::Outside { imu, estimation, failsafe: _other } = bus.split(Some(wake)).outside;
    let (mut tx, mut rx) = (imu.sensor_imu, estimation.sensor_imu);
    measure.contender("stampfly-bus ring, waiting", |k| {
        tx.publish(Instant::from_micros(k), &sample(k));
        if WOKEN.swap(false, Ordering::AcqRel) { rx.next().map(|s| s.data) } else { None }
    });

    let mut queue: spsc::Queue<Timed, 16> = spsc::Queue::new();
    let (mut producer, mut consumer) = queue.split();
    measure.contender("heapless spsc, polling", |k| {
        let _ = producer.enqueue((Instant::from_micros(k), sample(k)));
        consumer.dequeue().map(|s| s.1)
    });

    let watch: Watch<CriticalSectionRawMutex, Timed, 2> = Watch::new();
    let (sender, mut receiver) = (watch.sender(), watch.receiver().expect("two receivers"));
    measure.contender("embassy-sync Watch, polling", |k| {
        sender.send((Instant::from_micros(k), sample(k)));
        receiver.try_changed().map(|s| s.1)
    });

    let watch: Watch<CriticalSectionRawMutex, Timed, 2> = Watch::new();
    let (sender, mut receiver) = (watch.sender(), watch.receiver().expect("two receivers"));
    measure.contender("embassy-sync Watch, waiting", |k| {
        let mut reader = pin!(receiver.changed());
        let mut context = Context::from_waker(Waker::noop());
        assert!(reader.as_mut().poll(&mut context).is_pending());
        sender.send((Instant::from_micros(k), sample(k)));
        match reader.poll(&mut context) {
            Poll::Ready(s) => Some(s.1),
            Poll::Pending => None,
        }
    });

    let channel: PubSubChannel<CriticalSectionRawMutex, Timed, 16, 2, 1> = PubSubChannel::new();
    let publisher = channel.publisher().expect("one publisher");
    let mut subscriber = channel.subscriber().expect("two subscribers");
    measure.contender("embassy-sync PubSub, polling", |k| {
        publisher.publish_immediate((Instant::from_micros(k), sample(k)));
        match subscriber.try_next_message() {
            Some(WaitResult::Message(s)) => Some(s.1),
            _ => None,
        }
    });

    let channel: PubSubChannel<CriticalSectionRawMutex, Timed, 16, 2, 1> = PubSubChannel::new();
    let publisher = channel.publisher().expect("one publisher");
    let mut subscriber = channel.subscriber().expect("two subscribers");
    measure.contender("embassy-sync PubSub, waiting", |k| {
        let mut reader = pin!(subscriber.next_message());
        let mut context = Context::from_waker(Waker::noop());
        assert!(reader.as_mut().poll(&mut context).is_pending());
        publisher.publish_immediate((Instant::from_micros(k), sample(k)));
        match reader.poll(&mut context) {
            Poll::Ready(WaitResult::Message(s)) => Some(s.1),
            _ => None,
        }
    });
}

struct ByCriterion<'a>(criterion::BenchmarkGroup<'a, criterion::measurement::WallTime>);

impl Measure for ByCriterion<'_> {
    fn contender(&mut self, name: &'static str, mut round: impl FnMut(u64) -> Option<ImuData>) {
        let mut k = 0;
        self.0.bench_function(name, |b| {
            b.iter(|| {
                k += 1;
                round(black_box(k))
            });
        });
    }
}

fn bench(c: &mut Criterion) {
    contenders(&mut ByCriterion(c.benchmark_group("publish and read one IMU message")));
}

criterion_group!(benches, bench);

const ROUNDS: usize = 7;
const CALLS: u64 = 2_000_000;

/// Times of every contender, one a round.
#[derive(Default)]
struct Interleaved(Vec<(&'static str, Vec<f64>)>);

impl Measure for Interleaved {
    fn contender(&mut self, name: &'static str, mut round: impl FnMut(u64) -> Option<ImuData>) {
        let started = std::time::Instant::now();
        for k in 1..=CALLS {
            black_box(round(black_box(k)));
        }
        let nanoseconds = started.elapsed().as_secs_f64() * 1e9 / CALLS as f64;
        match self.0.iter_mut().find(|(known, _)| *known == name) {
            Some((_, times)) => times.push(nanoseconds),
            None => self.0.push((name, vec![nanoseconds])),
        }
    }
}

/// Medians over seven interleaved rounds, as ratios to the first contender.
fn ratios() {
    let mut measured = Interleaved::default();
    for _ in 0..ROUNDS {
        contenders(&mut measured);
    }
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[ROUNDS / 2]
    };
    let medians: Vec<(&str, f64)> = measured.0.iter_mut().map(|(name, times)| (*name, median(times))).collect();
    let ours = medians[0].1;
    println!("\nmedian of {ROUNDS} interleaved rounds of {CALLS} calls");
    for (name, time) in &medians {
        println!("{name:<30} {time:>7.2} ns   this / ring, polling = {:.2}", time / ours);
    }
}

fn main() {
    benches();
    Criterion::default().configure_from_args().final_summary();
    ratios();
}
