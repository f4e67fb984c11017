//! One period of the flight loop, inertial sample to motor duty, on a recorded flight: the whole and every stage.
//!
//! The vehicle is the assembled StampFly in the air, with the other sensors at their rates, so the figures are the
//! mean mix and not a best case. A stage is a runnable: it reads its topics, computes and publishes.

use criterion::{Criterion, criterion_group};
use stampfly_benches::flight::{FLYING_FROM, Recording, Replay, STEPS};
use stampfly_board::{schedule, topics};
use stampfly_bus::{Activation, Band};
use stampfly_flight::Observer;
use std::time::{Duration, Instant};

/// Time of so many activations.
#[derive(Clone, Copy, Default)]
struct Sum {
    time: Duration,
    count: u32,
}

/// Adds up the time of every runnable.
struct Stages {
    begun: Instant,
    /// By line of the activation table.
    sums: [Sum; schedule::COUNT],
    /// The estimation's, in steps where the inertial sensor was alone.
    predict: Sum,
}

impl Stages {
    fn new() -> Self {
        Self { begun: Instant::now(), sums: [Sum::default(); schedule::COUNT], predict: Sum::default() }
    }
}

impl Observer for Stages {
    fn starts(&mut self, _: usize) {
        self.begun = Instant::now();
    }

    fn finished(&mut self, activation: &Activation) {
        let time = self.begun.elapsed();
        let index = usize::from(activation.record().index);
        let add = |sum: &mut Sum| *sum = Sum { time: sum.time + time, count: sum.count + 1 };
        add(&mut self.sums[index]);
        // The estimation reads the inertial sensor first, then the four others.
        let others = activation.record().inputs().get(1..5);
        if index == schedule::Id::estimation as usize
            && others.is_some_and(|inputs| inputs.iter().all(|i| i.taken == 0))
        {
            add(&mut self.predict);
        }
    }
}

/// What it costs to look at the clock, which every stage has to bear once.
fn clock() -> Duration {
    const LOOKS: u32 = 100_000;
    let begun = Instant::now();
    for _ in 0..LOOKS {
        std::hint::black_box(Instant::now());
    }
    begun.elapsed() / LOOKS
}

/// Flies the part of the recording that is in the air, as often as it takes for so many steps, and returns the sum of
/// what `measure` says about each flight, scaled to that number.
fn fly(recording: &Recording, steps: u64, mut measure: impl FnMut(&mut Replay<'_, '_>, usize) -> Duration) -> Duration {
    let in_the_air = STEPS - FLYING_FROM;
    let flights = steps.div_ceil(in_the_air as u64);
    let mut total = Duration::ZERO;
    for _ in 0..flights {
        let mut bus = topics::Bus::new();
        let mut replay = recording.replay(&mut bus);
        replay.skip(FLYING_FROM);
        total += measure(&mut replay, in_the_air);
        replay.check();
    }
    total.mul_f64(steps as f64 / (flights * in_the_air as u64) as f64)
}

/// Both bands, nobody watching.
fn whole(replay: &mut Replay<'_, '_>, steps: usize) -> Duration {
    let begun = Instant::now();
    replay.skip(steps);
    begun.elapsed()
}

/// Mean time of one activation, times the steps, so that a stage that is not due every step is not flattered.
fn stage(replay: &mut Replay<'_, '_>, steps: usize, clock: Duration, pick: impl Fn(&Stages) -> Sum) -> Duration {
    let mut stages = Stages::new();
    (0..steps).for_each(|_| replay.step(&mut stages));
    let Sum { time, count } = pick(&stages);
    time.saturating_sub(clock * count).mul_f64(steps as f64 / f64::from(count))
}

fn bench(c: &mut Criterion) {
    let recording = Recording::new();
    let clock = clock();
    let mut group = c.benchmark_group("chain");
    group.sample_size(20).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
    group.bench_function("whole step", |b| b.iter_custom(|steps| fly(&recording, steps, whole)));
    group.bench_function("estimation, inertial sample only", |b| {
        b.iter_custom(|steps| fly(&recording, steps, |replay, n| stage(replay, n, clock, |stages| stages.predict)));
    });
    for (index, activation) in schedule::ACTIVATIONS.iter().enumerate().filter(|(_, a)| a.band == Band::Flight) {
        group.bench_function(activation.name, |b| {
            b.iter_custom(|steps| fly(&recording, steps, |replay, n| stage(replay, n, clock, |s| s.sums[index])));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);

/// The figure to quote.
fn mean() {
    let recording = Recording::new();
    let steps = 10 * (STEPS - FLYING_FROM) as u64;
    let time = fly(&recording, steps, whole);
    let nanoseconds = time.as_secs_f64() * 1e9 / steps as f64;
    println!("\nmean of {steps} steps of 2.5 ms in flight: {nanoseconds:.0} ns");
}

fn main() {
    benches();
    Criterion::default().configure_from_args().final_summary();
    mean();
}
