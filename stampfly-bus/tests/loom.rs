//! Every interleaving of a small bus, and every value the memory model lets a reader see.
//!
//! `cargo xtask loom`. Each model counts the executions it explored and asserts a floor, because a model that explores
//! one interleaving passes whatever the code does. Each has a twin from which one ordering, or one cursor, is taken
//! out; the twin must fail. All actors are spawned, none is the model's own closure: loom explores that one too little.
// A program of its own: it is built with `--cfg loom`.
#![cfg(loom)]

use loom::thread;
use stampfly_bus::weaken::{self, Without};
use stampfly_bus::{Every, Hook, Latest, Lossless, Publisher, Subscriber, Tap, Topic};
use stampfly_types::{Instant, message};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

message! {
    /// Two words that must never be seen apart.
    pub struct Pair {
        /// The sample's number.
        number: u32,
        /// Its complement.
        complement: u32,
    }
}

const DEPTH: usize = 2;
type Slots<P, const READERS: usize> = Topic<Pair, P, DEPTH, 2, READERS>;
type Reader<P> = Subscriber<'static, Pair, P, DEPTH, 2>;

fn pair(number: u32) -> Pair {
    Pair { number, complement: !number }
}

/// What every sample that is ever read must be: whole, and in its place.
fn check(at: Instant, generation: u32, data: Pair) {
    assert_eq!((data, at), (pair(generation), Instant::from_micros(u64::from(generation))), "torn sample {generation}");
}

/// Threads of a model outlive its closure, so a topic of one execution is never freed. It is a few hundred bytes.
fn topic<P: 'static, const READERS: usize>() -> &'static mut Slots<P, READERS> {
    Box::leak(Box::new(Topic::new()))
}

/// Explores `model` with at most this many preemptions and returns the number of executions.
fn explore(preemptions: usize, model: impl Fn() + Sync + Send + 'static) -> usize {
    let executions = std::sync::Arc::new(AtomicUsize::new(0));
    let counter = executions.clone();
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = Some(preemptions);
    builder.check(move || {
        counter.fetch_add(1, Ordering::Relaxed);
        model();
    });
    let executions = executions.load(Ordering::Relaxed);
    println!("{executions} executions");
    executions
}

/// The model must fail with this ordering taken out of the bus.
fn must_fail_without(without: Without, preemptions: usize, model: impl Fn() + Sync + Send + 'static) {
    weaken::set(Some(without));
    let outcome = catch_unwind(AssertUnwindSafe(|| explore(preemptions, model)));
    weaken::set(None);
    assert!(outcome.is_err(), "the model does not notice that {without:?} is missing");
}

/// The model, broken in itself, must fail.
fn must_fail(preemptions: usize, model: impl Fn() + Sync + Send + 'static) {
    let outcome = catch_unwind(AssertUnwindSafe(|| explore(preemptions, model)));
    assert!(outcome.is_err(), "the model does not notice that it is broken");
}

fn publish<P: stampfly_bus::Overwriting, const READERS: usize>(
    mut tx: Publisher<'static, Pair, P, DEPTH, 2, READERS>,
    samples: u32,
) {
    for number in 1..=samples {
        assert_eq!(tx.publish(Instant::from_micros(u64::from(number)), &pair(number)), number);
    }
}

/// Takes everything there is; checks the order, and that what was not taken was counted.
fn take_in_order(rx: &mut Reader<Every>, taken: &mut u32, until: u32) {
    while let Some(sample) = rx.next() {
        check(sample.at, sample.generation, sample.data);
        *taken += 1;
        assert_eq!(*taken + rx.lost(), sample.generation, "every sample is taken or counted as lost");
        if sample.generation == until {
            break;
        }
    }
}

fn ring<const READERS: usize>(samples: u32) {
    let (tx, readers) = topic::<Every, 0>().split::<READERS>();
    let writer = thread::spawn(move || publish(tx, samples));
    let readers = readers.map(|mut rx| {
        thread::spawn(move || {
            let mut taken = 0;
            take_in_order(&mut rx, &mut taken, samples);
            (rx, taken)
        })
    });
    writer.join().unwrap();
    for reader in readers {
        let (mut rx, mut taken) = reader.join().unwrap();
        take_in_order(&mut rx, &mut taken, samples);
        assert_eq!(taken + rx.lost(), samples, "the count of losses is exact");
    }
}

#[test]
fn ring_two_readers() {
    assert!(explore(4, || ring::<2>(2)) > 1_000);
}

#[test]
fn ring_reader_lapped_while_it_copies() {
    assert!(explore(3, || ring::<1>(3)) > 1_000);
}

#[test]
fn ring_needs_its_orderings() {
    for without in [Without::ReleaseFence, Without::AcquireFence, Without::ReleaseStore, Without::AcquireLoad] {
        must_fail_without(without, 3, || ring::<1>(3));
    }
}

fn latest<const READERS: usize>(samples: u32) {
    let (tx, readers) = topic::<Latest, 0>().split::<READERS>();
    let writer = thread::spawn(move || publish(tx, samples));
    let readers = readers.map(|mut rx| {
        thread::spawn(move || {
            let mut seen = 0;
            for _ in 0..2 {
                if let Some(sample) = rx.latest() {
                    check(sample.at, sample.generation, sample.data);
                    assert!(sample.generation >= seen, "the newest value never gets older");
                    seen = sample.generation;
                }
            }
            rx
        })
    });
    writer.join().unwrap();
    for reader in readers {
        assert_eq!(reader.join().unwrap().latest().map(|s| s.generation), Some(samples));
    }
}

#[test]
fn latest_two_readers() {
    assert!(explore(3, || latest::<2>(2)) > 1_000);
}

#[test]
fn latest_reader_lapped_while_it_copies() {
    assert!(explore(3, || latest::<1>(3)) > 1_000);
}

#[test]
fn latest_needs_its_orderings() {
    for without in [Without::ReleaseFence, Without::AcquireFence, Without::ReleaseStore, Without::AcquireLoad] {
        must_fail_without(without, 3, || latest::<1>(3));
    }
}

/// Three samples through two slots: the writer is refused until the reader has taken one.
fn queue<const RESPECTED: usize>() {
    let (mut tx, [mut rx]) = topic::<Lossless, RESPECTED>().split();
    let writer = thread::spawn(move || {
        let mut refused = 0;
        for number in 1..=3 {
            match tx.publish(Instant::from_micros(u64::from(number)), pair(number)) {
                Ok(generation) => assert_eq!(generation, number),
                Err(full) => {
                    assert_eq!(full.0, pair(number), "a refused value is given back");
                    refused += 1;
                }
            }
        }
        (tx, refused)
    });
    let reader = thread::spawn(move || {
        let mut taken = 0;
        for _ in 0..2 {
            if let Some(sample) = rx.next() {
                taken += 1;
                assert_eq!(sample.generation, taken, "nothing is skipped");
                check(sample.at, sample.generation, sample.data);
            }
        }
        (rx, taken)
    });
    let ((mut tx, refused), (mut rx, mut taken)) = (writer.join().unwrap(), reader.join().unwrap());
    if refused > 0 && taken > 0 {
        tx.publish(Instant::from_micros(3), pair(3)).expect("what was taken has made room");
    }
    while let Some(sample) = rx.next() {
        taken += 1;
        assert_eq!(sample.generation, taken, "nothing is skipped");
    }
    assert_eq!((taken, rx.lost()), (tx.generation(), 0), "nothing is lost");
}

#[test]
fn queue_is_refused_then_taken() {
    assert!(explore(5, queue::<1>) > 1_000);
}

#[test]
fn queue_needs_its_cursor_and_its_orderings() {
    must_fail(3, queue::<0>);
    must_fail_without(Without::AcquireLoad, 3, queue::<1>);
    must_fail_without(Without::ReleaseStore, 3, queue::<1>);
}

/// The log comes round late: the writer does not wait for it, and it knows what it has missed.
fn tap(samples: u32) {
    let topic: &'static Slots<Latest, 0> = topic();
    let tx = topic.__publisher(None, 0);
    let mut tap = Tap::__new(topic);
    let writer = thread::spawn(move || publish(tx, samples));
    let log = thread::spawn(move || {
        let mut taken = 0;
        tap.drain(&mut |at, generation, words| {
            check(at, generation, Pair { number: words[0], complement: words[1] });
            taken += 1;
        });
        (tap, taken)
    });
    writer.join().unwrap();
    let (mut tap, mut taken) = log.join().unwrap();
    tap.drain(&mut |_, _, _| taken += 1);
    assert_eq!(taken + tap.lost(), samples);
}

#[test]
fn slow_tap() {
    assert!(explore(3, || tap(3)) > 1_000);
}

#[test]
fn slow_tap_needs_its_orderings() {
    for without in [Without::ReleaseFence, Without::AcquireFence, Without::ReleaseStore, Without::AcquireLoad] {
        must_fail_without(without, 3, || tap(3));
    }
}

loom::lazy_static! {
    /// What an executor's hook sets and its task looks at.
    static ref READY: loom::sync::atomic::AtomicU32 = loom::sync::atomic::AtomicU32::new(0);
}

fn wake(_topic: usize) {
    READY.fetch_add(1, Ordering::Release);
}

fn wake_carelessly(_topic: usize) {
    READY.fetch_add(1, Ordering::Relaxed);
}

/// A reader woken by the hook finds what it was woken for.
fn hook(hook: Hook) {
    let topic: &'static Slots<Every, 0> = topic();
    let (tx, mut rx) = (topic.__publisher(Some(hook), 0), topic.__subscriber(0));
    let writer = thread::spawn(move || publish(tx, 2));
    let reader = thread::spawn(move || {
        for _ in 0..2 {
            let woken = READY.load(Ordering::Acquire);
            let mut newest = rx.generation();
            while let Some(sample) = rx.next() {
                check(sample.at, sample.generation, sample.data);
                newest = sample.generation;
            }
            assert!(newest >= woken, "woken for {woken}, found {newest}");
        }
    });
    writer.join().unwrap();
    reader.join().unwrap();
}

#[test]
fn hook_comes_after_the_sample() {
    assert!(explore(4, || hook(wake)) > 1_000);
}

#[test]
fn hook_must_release() {
    must_fail(3, || hook(wake_carelessly));
}
