//! The five data flows of a flight stack, on a small vehicle of their own.

#![cfg(not(loom))]

use proptest::prelude::*;
use stampfly_bus::{Activation, Band, Runnable, Runnables, Scheduler, schedule, topics};
use stampfly_types::messages::{ControlOutput, GuidedCommand, GuidedKind, ImuData, StateEstimate};
use stampfly_types::{Duration, Instant};

topics! {
    /// A vehicle small enough to reason about.
    pub mod wiring;
    /// Inertial sample.
    sensor_imu: ImuData = ring(8) @ 400 Hz from imu => [estimation];
    /// A command.
    command: GuidedCommand = queue(4) @ on event from link => [estimation, control];
    /// State.
    estimate: StateEstimate = latest @ 400 Hz from estimation => [control, telemetry];
    /// Demand.
    demand: ControlOutput = latest @ 400 Hz from control => [];
}

schedule! {
    /// Its activations.
    pub mod plan on wiring;
    /// Counts samples.
    estimation = Estimation: on sensor_imu, flight, 10 us;
    /// Follows.
    control = Control: after estimation or at latest 10 ms, flight, 10 us;
    /// Watches.
    telemetry = Telemetry: every 20 ms, background, 10 us;
}

/// Sums its inputs.
pub struct Estimation<'b> {
    imu: wiring::sensor_imu::Rx<'b>,
    command: wiring::command::Rx<'b>,
    out: wiring::estimate::Tx<'b>,
    samples: heapless::Vec<stampfly_bus::Stamped<ImuData>, 8>,
    commands: heapless::Vec<stampfly_bus::Stamped<GuidedCommand>, 4>,
    height: f32,
}

impl Runnable for Estimation<'_> {
    fn read(&mut self, activation: &mut Activation) {
        activation.drain(&mut self.imu, &mut self.samples);
        activation.drain(&mut self.command, &mut self.commands);
    }
    fn run(&mut self, activation: &mut Activation) {
        self.height += self.samples.iter().map(|s| s.data.accel.z).sum::<f32>();
        self.height += self.commands.iter().map(|c| c.data.dwell).sum::<f32>();
        let estimate = StateEstimate { height: self.height, ..Default::default() };
        self.out.publish(activation.now(), &estimate);
    }
}

/// Doubles the height.
pub struct Control<'b> {
    estimate: wiring::estimate::Rx<'b>,
    command: wiring::command::Rx<'b>,
    out: wiring::demand::Tx<'b>,
    commands: heapless::Vec<stampfly_bus::Stamped<GuidedCommand>, 4>,
    seen: Option<stampfly_bus::Stamped<StateEstimate>>,
    nows: Vec<Instant>,
}

impl Runnable for Control<'_> {
    fn read(&mut self, activation: &mut Activation) {
        self.seen = activation.latest(&mut self.estimate);
        activation.drain(&mut self.command, &mut self.commands);
    }
    fn run(&mut self, activation: &mut Activation) {
        self.nows.push(activation.now());
        let thrust = self.seen.map_or(-1.0, |s| s.data.height * 2.0);
        self.out.publish(activation.now(), &ControlOutput { thrust, ..Default::default() });
    }
}

/// Remembers generations.
pub struct Telemetry<'b> {
    estimate: wiring::estimate::Rx<'b>,
    generations: Vec<u32>,
}

impl Runnable for Telemetry<'_> {
    fn read(&mut self, activation: &mut Activation) {
        self.generations.push(activation.latest(&mut self.estimate).map_or(0, |s| s.generation));
    }
    fn run(&mut self, _: &mut Activation) {}
}

struct Rig<'b> {
    vehicle: plan::Vehicle<'b>,
    imu: wiring::sensor_imu::Tx<'b>,
    command: wiring::command::Tx<'b>,
    scheduler: Scheduler<{ plan::COUNT }, { wiring::COUNT }>,
    heads: [&'b dyn stampfly_bus::AnyTopic; wiring::COUNT],
    taps: wiring::Taps<'b>,
    log: Vec<(wiring::Id, u64, u32, Vec<u32>)>,
    trace: Vec<(usize, Activation)>,
}

impl<'b> Rig<'b> {
    fn new(bus: &'b mut wiring::Bus) -> Self {
        let wiring::Split { ports, taps, heads } = bus.split(None);
        let wiring::Ports { sensor_imu, command, estimate, demand } = ports;
        let wiring::demand::Ends { tx: demand } = demand;
        Self {
            vehicle: plan::Vehicle {
                estimation: Estimation {
                    imu: sensor_imu.estimation,
                    command: command.estimation,
                    out: estimate.tx,
                    samples: heapless::Vec::new(),
                    commands: heapless::Vec::new(),
                    height: 0.0,
                },
                control: Control {
                    estimate: estimate.control,
                    command: command.control,
                    out: demand,
                    commands: heapless::Vec::new(),
                    seen: None,
                    nows: Vec::new(),
                },
                telemetry: Telemetry { estimate: estimate.telemetry, generations: Vec::new() },
            },
            imu: sensor_imu.tx,
            command: command.tx,
            scheduler: Scheduler::new(&plan::ACTIVATIONS, Instant::ZERO),
            heads,
            taps,
            log: Vec::new(),
            trace: Vec::new(),
        }
    }

    fn run_due(&mut self, clock: Instant) {
        for band in [Band::Flight, Band::Background] {
            while let Some((index, now)) = self.scheduler.due(band, 0, clock, &self.heads) {
                let mut activation = Activation::live(now);
                self.scheduler.started(index, now, clock, &self.heads);
                self.vehicle.read(index, &mut activation);
                self.vehicle.run(index, &mut activation);
                self.scheduler.finished(index);
                self.trace.push((index, activation));
            }
        }
        self.taps
            .drain(&mut |id, at, generation, words| self.log.push((id, at.as_micros(), generation, words.to_vec())));
    }
}

#[test]
fn a_silent_imu_still_activates_control() {
    let mut bus = wiring::Bus::new();
    let mut rig = Rig::new(&mut bus);
    rig.imu.publish(Instant::from_micros(2_500), &ImuData::default());
    rig.run_due(Instant::from_micros(2_600));
    for clock in (3_000..40_000).step_by(500) {
        rig.run_due(Instant::from_micros(clock));
    }
    // After the sample, then every 10 ms from when that ran, at the scheduled ticks and not at the clock's.
    assert_eq!(rig.vehicle.control.nows, [2_500, 12_600, 22_600, 32_600].map(Instant::from_micros));
    assert_eq!(rig.vehicle.telemetry.generations, [1], "20 ms period");
}

#[test]
fn a_deadline_counts_from_the_run_and_time_does_not_go_back() {
    let mut bus = wiring::Bus::new();
    let mut rig = Rig::new(&mut bus);
    // Samples are 6 ms old when they arrive; from stamp to arrival of the next one it is 12 ms.
    for k in 0..10u64 {
        rig.imu.publish(Instant::from_micros(k * 6_000), &ImuData::default());
        rig.run_due(Instant::from_micros(k * 6_000 + 6_000));
        rig.run_due(Instant::from_micros(k * 6_000 + 11_900));
    }
    assert_eq!(
        rig.vehicle.control.nows,
        (0..10).map(|k| Instant::from_micros(k * 6_000)).collect::<Vec<_>>(),
        "no deadline passed"
    );
    // Silence, a deadline, and then a sample whose stamp lies before the deadline.
    rig.run_due(Instant::from_micros(72_000));
    rig.imu.publish(Instant::from_micros(66_000), &ImuData::default());
    rig.run_due(Instant::from_micros(72_100));
    assert_eq!(rig.vehicle.control.nows[10..], [Instant::from_micros(70_000), Instant::from_micros(70_000)]);
}

#[test]
fn a_slow_reader_counts_what_it_missed() {
    let mut bus = wiring::Bus::new();
    let mut rig = Rig::new(&mut bus);
    for k in 1..=20u64 {
        rig.imu.publish(Instant::from_micros(k), &ImuData::default());
    }
    rig.run_due(Instant::from_micros(21));
    assert_eq!(rig.vehicle.estimation.imu.lost(), 12);
    assert_eq!(rig.trace[0].1.inputs()[0].taken, 8);
    assert_eq!(rig.taps.lost(), 12);
}

#[test]
fn a_queue_refuses_and_gives_the_value_back() {
    let mut bus = wiring::Bus::new();
    let mut rig = Rig::new(&mut bus);
    let land = GuidedCommand { kind: GuidedKind::Land, ..Default::default() };
    for _ in 0..4 {
        rig.command.publish(Instant::from_micros(1), land).expect("room");
    }
    assert_eq!(rig.command.publish(Instant::from_micros(1), land), Err(stampfly_bus::Full(land)));
    rig.imu.publish(Instant::from_micros(2), &ImuData::default());
    rig.run_due(Instant::from_micros(2));
    rig.command.publish(Instant::from_micros(3), land).expect("both readers have caught up");
}

#[test]
fn the_table_says_it_all() {
    let imu = &wiring::TOPICS[wiring::Id::sensor_imu as usize];
    assert_eq!((imu.policy, imu.depth, imu.rate, imu.publisher), ("ring", 8, "400 Hz", "imu"));
    assert_eq!(imu.readers, ["estimation"]);
    assert_eq!(wiring::TOPICS[wiring::Id::command as usize].rate, "on event");
    assert_eq!(plan::ACTIVATIONS[1].at_latest, Some(Duration::from_micros(10_000)));
}

proptest! {
    /// Record a run with random traffic and random slowness, then repeat it from inputs and trace alone.
    #[test]
    fn a_trace_replays_bit_for_bit(steps in prop::collection::vec((0u8..4, 0u64..30_000, any::<f32>()), 1..200)) {
        let mut bus = wiring::Bus::new();
        let mut rig = Rig::new(&mut bus);
        let mut clock = 0;
        for (kind, wait, value) in steps {
            match kind {
                0 | 1 => { rig.imu.publish(Instant::from_micros(clock), &ImuData { accel: [0.0, 0.0, value].into(), ..Default::default() }); }
                2 => { let _ = rig.command.publish(Instant::from_micros(clock), GuidedCommand { dwell: value, ..Default::default() }); }
                _ => { clock += wait; rig.run_due(Instant::from_micros(clock)); }
            }
        }
        rig.run_due(Instant::from_micros(clock + 1));

        let mut again = wiring::Bus::new();
        let mut copy = Rig::new(&mut again);
        let mut inputs = rig.log.iter().filter(|l| l.0 == wiring::Id::sensor_imu).peekable();
        let mut commands = rig.log.iter().filter(|l| l.0 == wiring::Id::command).peekable();
        for (index, recorded) in &rig.trace {
            if *index == plan::Id::estimation as usize {
                while let Some((_, at, _, words)) = inputs.next_if(|l| l.2 <= recorded.inputs()[0].generation) {
                    copy.imu.publish_words(Instant::from_micros(*at), words);
                }
            }
            if *index != plan::Id::telemetry as usize {
                while let Some((_, at, _, words)) = commands.next_if(|l| l.2 <= recorded.inputs()[1].generation) {
                    copy.command.publish_words(Instant::from_micros(*at), words);
                }
            }
            let mut activation = Activation::replay(recorded.now(), recorded.inputs(), recorded.refused());
            copy.vehicle.read(*index, &mut activation);
            copy.vehicle.run(*index, &mut activation);
            copy.taps.drain(&mut |id, at, generation, words| copy.log.push((id, at.as_micros(), generation, words.to_vec())));
            prop_assert!(!activation.is_missing_input() || rig.taps.lost() > 0);
        }
        if rig.taps.lost() == 0 {
            for id in [wiring::Id::estimate, wiring::Id::demand] {
                let recorded: Vec<_> = rig.log.iter().filter(|l| l.0 == id).collect();
                let replayed: Vec<_> = copy.log.iter().filter(|l| l.0 == id).collect();
                prop_assert_eq!(recorded, replayed);
            }
        }
    }
}
