//! The five data flows of a flight stack, on a small vehicle of their own.

use proptest::prelude::*;
use stampfly_bus::{
    Activation, AnyTopic, Band, Message, PublishWords, ReadInputs, Runnable, Schedule, Scheduler, Split, Stamped, Taps,
    TopicTable, schedule,
};
use stampfly_types::messages::{ControlOutput, GuidedCommand, GuidedKind, ImuData, StateEstimate};
use stampfly_types::{ActivationRecord, Duration, InputRecord, Instant, Quat};

/// A vehicle small enough to reason about.
mod topics {
    use super::*;
    const COMMANDS: usize = 4;

    stampfly_bus::topics! {
        outside imu, link;

        /// Inertial sample.
        sensor_imu: ImuData = ring(8) @ 0.4 kHz from imu => [estimation];
        /// A command.
        command: GuidedCommand = queue(COMMANDS) @ on event from link => [estimation, control];
        /// State.
        estimate: StateEstimate = latest @ 400 Hz from estimation => [control, telemetry];
        /// Demand.
        demand: ControlOutput = latest @ 400 Hz from control => [];
    }
}

schedule! {
    /// Its runnables.
    #[derive(Clone, Debug)]
    struct Runnables on topics from ();

    /// Counts samples.
    estimation = Estimation: on sensor_imu, flight, 10 us;
    /// Follows.
    control = Control: after estimation or at latest 10 ms, flight, 10 us;
    /// Watches.
    telemetry = Telemetry: every 20 ms, background, 0.01 ms;
}

/// Sums its inputs.
#[derive(Clone, Debug, Default)]
pub struct Estimation {
    height: f32,
}

impl Estimation {
    fn new(_: &()) -> Self {
        Self::default()
    }
}

impl Runnable for Estimation {
    type Ends<'b> = topics::EstimationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        self.height += ends.sensor_imu.iter().map(|s| s.data.accel.z).sum::<f32>();
        self.height += ends.command.iter().map(|c| c.data.dwell).sum::<f32>();
        let estimate = StateEstimate { height: self.height, ..Default::default() };
        ends.estimate.publish(activation.now(), &estimate);
    }
}

/// Doubles the height.
#[derive(Clone, Debug, Default)]
pub struct Control {
    nows: Vec<Instant>,
    news: Vec<bool>,
}

impl Control {
    fn new(_: &()) -> Self {
        Self::default()
    }
}

impl Runnable for Control {
    type Ends<'b> = topics::ControlEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        self.nows.push(activation.now());
        self.news.push(ends.estimate.is_new());
        let thrust = ends.estimate.sample().map_or(-1.0, |sample| sample.data.height * 2.0);
        ends.demand.publish(activation.now(), &ControlOutput { thrust, ..Default::default() });
    }
}

/// Remembers generations.
#[derive(Clone, Debug, Default)]
pub struct Telemetry {
    generations: Vec<u32>,
}

impl Telemetry {
    fn new(_: &()) -> Self {
        Self::default()
    }
}

impl Runnable for Telemetry {
    type Ends<'b> = topics::TelemetryEnds<'b>;

    fn run(&mut self, _: &mut Activation, ends: &mut Self::Ends<'_>) {
        self.generations.push(ends.estimate.sample().map_or(0, |sample| sample.generation));
    }
}

struct Rig<'b> {
    runnables: Runnables,
    ends: topics::Ends<'b>,
    imu: topics::SensorImuTx<'b>,
    command: topics::CommandTx<'b>,
    scheduler: Scheduler<Runnables>,
    heads: [&'b dyn AnyTopic; topics::COUNT],
    taps: topics::Taps<'b>,
    log: Vec<(usize, Instant, u32, Vec<u32>)>,
    trace: Vec<Activation>,
}

impl<'b> Rig<'b> {
    fn new(bus: &'b mut topics::Bus) -> Self {
        let Split { runnables: ends, outside, taps, heads } = bus.split(None);
        let topics::Outside { imu, link } = outside;
        Self {
            runnables: Runnables::new(&()),
            ends,
            imu: imu.sensor_imu,
            command: link.command,
            scheduler: Scheduler::new(Instant::ZERO),
            heads,
            taps,
            log: Vec::new(),
            trace: Vec::new(),
        }
    }

    fn activate(&mut self, index: usize, activation: &mut Activation) {
        Runnables::read(&mut self.ends, index, activation);
        self.runnables.run(&mut self.ends, index, activation);
    }

    fn run_due(&mut self, clock: Instant) {
        for band in [Band::Flight, Band::Background] {
            while let Some((index, now)) = self.scheduler.start_first(band, clock, &self.heads) {
                let mut activation = Activation::live(index as u8, now);
                self.activate(index, &mut activation);
                self.scheduler.finished(index);
                self.trace.push(activation);
            }
        }
        self.taps.drain(&mut |topic, at, generation, words| self.log.push((topic, at, generation, words.to_vec())));
    }
}

#[test]
fn a_silent_imu_still_activates_control() {
    let mut bus = topics::Bus::new();
    let mut rig = Rig::new(&mut bus);
    rig.imu.publish(Instant::from_micros(2_500), &ImuData::default());
    rig.run_due(Instant::from_micros(2_600));
    for clock in (3_000..40_000).step_by(500) {
        rig.run_due(Instant::from_micros(clock));
    }
    // After the sample, then every 10 ms from when that ran, at the scheduled ticks and not at the clock's.
    assert_eq!(rig.runnables.control.nows, [2_500, 12_600, 22_600, 32_600].map(Instant::from_micros));
    assert_eq!(rig.runnables.telemetry.generations, [1], "20 ms period");
}

#[test]
fn a_deadline_counts_from_the_run_and_time_does_not_go_back() {
    let mut bus = topics::Bus::new();
    let mut rig = Rig::new(&mut bus);
    // Samples are 6 ms old when they arrive; from stamp to arrival of the next one it is 12 ms.
    for k in 0..10u64 {
        rig.imu.publish(Instant::from_micros(k * 6_000), &ImuData::default());
        rig.run_due(Instant::from_micros(k * 6_000 + 6_000));
        rig.run_due(Instant::from_micros(k * 6_000 + 11_900));
    }
    assert_eq!(
        rig.runnables.control.nows,
        (0..10).map(|k| Instant::from_micros(k * 6_000)).collect::<Vec<_>>(),
        "no deadline passed"
    );
    // Silence, a deadline, and then a sample whose stamp lies before the deadline.
    rig.run_due(Instant::from_micros(72_000));
    rig.imu.publish(Instant::from_micros(66_000), &ImuData::default());
    rig.run_due(Instant::from_micros(72_100));
    assert_eq!(rig.runnables.control.nows[10..], [Instant::from_micros(70_000), Instant::from_micros(70_000)]);
}

#[test]
fn a_slow_reader_counts_what_it_missed() {
    let mut bus = topics::Bus::new();
    let mut rig = Rig::new(&mut bus);
    for k in 1..=20u64 {
        rig.imu.publish(Instant::from_micros(k), &ImuData::default());
    }
    rig.run_due(Instant::from_micros(21));
    assert_eq!(rig.ends.estimation().sensor_imu.lost(), 12);
    assert_eq!(rig.trace[0].record().inputs()[0].taken, 8);
    assert_eq!(rig.taps.lost(), 12);
}

#[test]
fn a_queue_refuses_and_gives_the_value_back() {
    let mut bus = topics::Bus::new();
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
    let imu = topics::Id::sensor_imu.info();
    assert_eq!((imu.policy, imu.depth, imu.rate, imu.publisher), ("ring", 8, "0.4 kHz", "imu"));
    assert_eq!((imu.period, imu.is_outside), (Some(Duration::from_micros(2_500)), true));
    assert_eq!(imu.readers, ["estimation"]);
    let command = topics::Id::command.info();
    assert_eq!((command.rate, command.period, command.depth), ("on event", None, 4));
    assert!(!topics::Id::estimate.info().is_outside);
    assert_eq!(<topics::Bus as TopicTable>::TOPICS.len(), topics::COUNT);
    assert_eq!(ACTIVATIONS[Id::control as usize].at_latest, Some(Duration::from_millis(10)));
    assert_eq!(ACTIVATIONS[2].budget, Duration::from_micros(10));
    assert_eq!(Runnables::INPUTS, [2, 2, 1]);
}

#[test]
fn what_has_been_read_is_not_copied_again() {
    let mut bus = topics::Bus::new();
    let mut rig = Rig::new(&mut bus);
    rig.imu.publish(Instant::ZERO, &ImuData::default());
    rig.run_due(Instant::from_micros(1));
    rig.run_due(Instant::from_millis(11));
    assert_eq!(rig.runnables.control.news, [true, false], "the second time on its deadline");
    let inputs = rig.trace.last().expect("two activations").record().inputs();
    assert_eq!((inputs[1].generation, inputs[1].taken), (1, 0), "held, not taken again");
}

/// What control holds of the estimate after it has read in flight, and what it wrote down.
fn control_reads(ends: &mut topics::Ends<'_>) -> (Option<Stamped<StateEstimate>>, bool, InputRecord) {
    let mut activation = Activation::live(Id::control as u8, Instant::ZERO);
    Runnables::read(ends, Id::control as usize, &mut activation);
    let estimate = ends.control().estimate;
    (estimate.sample().copied(), estimate.is_new(), activation.record().inputs()[1])
}

#[test]
fn what_a_runnable_hands_over_is_what_the_bus_holds() {
    let mut bus = topics::Bus::new();
    let mut ends = bus.split(None).runnables;
    assert_eq!(control_reads(&mut ends), (None, false, InputRecord { generation: 0, taken: 0 }));
    for generation in 1..=20 {
        let estimate = StateEstimate { height: generation as f32, ..Default::default() };
        ends.estimation().estimate.publish(Instant::from_millis(generation), &estimate);
        let (handed_over, is_new, record) = control_reads(&mut ends);
        let mut replayed = ActivationRecord::new(Id::telemetry as u8, Instant::ZERO);
        replayed.push(record).expect("room");
        let mut telemetry = ends.telemetry();
        telemetry.read(&mut Activation::replay(replayed));
        assert_eq!(handed_over.as_ref(), telemetry.estimate.sample());
        assert_eq!(handed_over.map(|sample| sample.data), Some(estimate));
        assert!(is_new);
        assert_eq!(record, InputRecord { generation: generation as u32, taken: 1 });
    }
    assert_eq!(control_reads(&mut ends).2, InputRecord { generation: 20, taken: 0 }, "nothing new");
}

/// Puts the inputs of `estimation` where they have read as far as these generations. Was that possible?
fn seek(ends: &mut topics::Ends<'_>, generations: [u32; 2]) -> bool {
    let mut record = ActivationRecord::new(Id::estimation as u8, Instant::ZERO);
    for generation in generations {
        record.push(InputRecord { generation, taken: 0 }).expect("room");
    }
    let mut sought = Activation::seek(record);
    Runnables::read(ends, Id::estimation as usize, &mut sought);
    !sought.is_missing_input()
}

#[test]
fn nobody_has_read_what_was_never_published() {
    let mut bus = topics::Bus::new();
    let mut split = bus.split(None);
    // Before anything was published, a reader that is ahead would never meet the newest sample.
    assert!(!seek(&mut split.runnables, [5, 0]));
    for instant in 1..=3 {
        split.outside.imu.sensor_imu.publish(Instant::from_millis(instant), &ImuData::default());
    }
    assert!(!seek(&mut split.runnables, [4, 0]));
    for (read, left) in [(3, 0), (2, 1), (0, 3)] {
        assert!(seek(&mut split.runnables, [read, 0]));
        let mut activation = Activation::live(Id::estimation as u8, Instant::ZERO);
        Runnables::read(&mut split.runnables, Id::estimation as usize, &mut activation);
        assert_eq!(split.runnables.estimation().sensor_imu.len(), left);
    }
}

#[test]
fn what_is_published_after_reading_belongs_to_the_next_activation() {
    let mut bus = topics::Bus::new();
    let mut ends = bus.split(None).runnables;
    ends.estimation().estimate.publish(Instant::ZERO, &StateEstimate { height: 1.0, ..Default::default() });
    control_reads(&mut ends);
    ends.estimation().estimate.publish(Instant::ZERO, &StateEstimate { height: 2.0, ..Default::default() });
    assert_eq!(ends.control().estimate.get().height, 1.0);
}

#[test]
fn a_restored_topic_is_handed_over_and_so_is_one_published_as_words() {
    let mut bus = topics::Bus::new();
    let mut ends = bus.split(None).runnables;
    let (place, at) = (topics::Id::estimate as usize, Instant::from_micros(7));
    let words = |height| StateEstimate { height, ..Default::default() }.to_words();
    assert_eq!(ends.restore_words(place, at, 41, &[1, 2]), None, "no such words");
    ends.restore_words(place, at, 41, &words(1.5)).expect("restored");
    let (restored, _, record) = control_reads(&mut ends);
    assert_eq!(restored, Some(stamped(at, 41, StateEstimate { height: 1.5, ..Default::default() })));
    assert_eq!(record, InputRecord { generation: 41, taken: 1 });
    assert_eq!(ends.publish_words(place, at, &words(2.5)), Some(42));
    assert_eq!(control_reads(&mut ends).0.map(|sample| (sample.generation, sample.data.height)), Some((42, 2.5)));
}

/// An attitude whose length is not one is refused by whoever reads it, and the sample before stays. The record says so, so that a
/// replay sees the same.
#[test]
fn what_cannot_be_read_is_as_if_it_had_not_come() {
    let mut bus = topics::Bus::new();
    let mut ends = bus.split(None).runnables;
    ends.estimation().estimate.publish(Instant::ZERO, &StateEstimate::default());
    let (before, ..) = control_reads(&mut ends);
    ends.telemetry().read(&mut Activation::live(Id::telemetry as u8, Instant::ZERO));
    let broken = StateEstimate { attitude: Quat::new_unchecked(3.0, 0.0, 0.0, 0.0), ..Default::default() };
    ends.estimation().estimate.publish(Instant::ZERO, &broken);
    assert_eq!(control_reads(&mut ends), (before, false, InputRecord { generation: 1, taken: 0 }));
    let mut alone = Activation::live(Id::telemetry as u8, Instant::ZERO);
    let mut telemetry = ends.telemetry();
    telemetry.read(&mut alone);
    assert_eq!((telemetry.estimate.sample(), telemetry.estimate.is_new()), (before.as_ref(), false));
    assert_eq!(alone.record().inputs(), [InputRecord { generation: 1, taken: 0 }]);
}

/// A sample as a reader gets it, for a topic's own type.
fn stamped<T>(at: Instant, generation: u32, data: T) -> Stamped<T> {
    Stamped { at, generation, data }
}

#[test]
fn a_restored_topic_goes_on_where_it_was() {
    let mut bus = topics::Bus::new();
    let Split { mut outside, mut taps, .. } = bus.split(None);
    let sample = ImuData { temperature: 21.0, ..Default::default() };
    let place = topics::Id::sensor_imu as usize;
    assert_eq!(
        outside.restore_words(place, Instant::from_micros(7), 0, &sample.to_words()),
        None,
        "no such generation"
    );
    assert_eq!(outside.restore_words(place, Instant::from_micros(7), 41, &[1, 2]), None, "no such words");
    assert_eq!(outside.restore_words(topics::Id::estimate as usize, Instant::ZERO, 1, &[]), None, "not outside");
    outside.restore_words(place, Instant::from_micros(7), 41, &sample.to_words()).expect("restored");
    assert_eq!(outside.imu.sensor_imu.publish(Instant::from_micros(9), &sample), 42);
    let mut seen = Vec::new();
    taps.drain(&mut |_, at, generation, words| {
        let data = ImuData::from_words(words.try_into().expect("its size")).expect("a sample");
        seen.push(stamped(at, generation, data));
    });
    assert_eq!(seen.last(), Some(&stamped(Instant::from_micros(9), 42, sample)));
}

proptest! {
    /// An input that looks at a sample where it is, one that copies it and one in a replay see the same, and write down the same.
    #[test]
    fn every_way_of_reading_sees_the_same(steps in prop::collection::vec((any::<bool>(), 0u8..3), 1..60)) {
        let mut bus = topics::Bus::new();
        let mut ends = bus.split(None).runnables;
        let (mut published, mut seen) = (0, 0);
        for (publishes, way) in steps {
            if publishes {
                published += 1;
                let estimate = StateEstimate { height: published as f32, ..Default::default() };
                ends.estimation().estimate.publish(Instant::from_micros(published.into()), &estimate);
            }
            let expected = InputRecord { generation: published, taken: u16::from(published != seen) };
            seen = published;
            let mut activation = Activation::live(Id::control as u8, Instant::ZERO);
            match way {
                0 => {}
                1 => activation.begin(Id::control as u8, Instant::ZERO),
                _ => {
                    let mut record = *activation.record();
                    record.push(InputRecord::default()).expect("room");
                    record.push(expected).expect("room");
                    activation = Activation::replay(record);
                }
            }
            Runnables::read(&mut ends, Id::control as usize, &mut activation);
            prop_assert!(!activation.is_missing_input());
            prop_assert_eq!(activation.record().inputs()[1], expected);
            let estimate = ends.control().estimate;
            let sample = estimate.sample().map(|sample| (sample.at, sample.generation, sample.data.height));
            let newest = (Instant::from_micros(published.into()), published, published as f32);
            prop_assert_eq!(sample, (published != 0).then_some(newest));
            prop_assert_eq!(estimate.is_new(), expected.taken == 1);
            prop_assert_eq!(estimate.get().height, published as f32);
        }
    }

    /// Record a run with random traffic and random slowness, then repeat it from inputs and trace alone.
    #[test]
    fn a_trace_replays_bit_for_bit(steps in prop::collection::vec((0u8..4, 0u64..30_000, any::<f32>()), 1..200)) {
        let mut bus = topics::Bus::new();
        let mut rig = Rig::new(&mut bus);
        let mut clock = Instant::ZERO;
        for (kind, wait, value) in steps {
            match kind {
                0 | 1 => { rig.imu.publish(clock, &ImuData { accel: [0.0, 0.0, value].into(), ..Default::default() }); }
                2 => { let _ = rig.command.publish(clock, GuidedCommand { dwell: value, ..Default::default() }); }
                _ => { clock += Duration::from_micros(wait); rig.run_due(clock); }
            }
        }
        rig.run_due(clock + Duration::from_micros(1));

        let mut again = topics::Bus::new();
        let mut copy = Rig::new(&mut again);
        let outside = [topics::Id::sensor_imu, topics::Id::command];
        let mut inputs = outside.map(|id| rig.log.iter().filter(move |line| line.0 == id as usize).peekable());
        for recorded in &rig.trace {
            // Both are read by `estimation`, the second one also by `control`, where it comes first.
            let read = recorded.record().inputs();
            let upto = match recorded.record().index {
                0 => [read[0].generation, read[1].generation],
                1 => [0, read[0].generation],
                _ => [0, 0],
            };
            while let Some((_, at, _, words)) = inputs[0].next_if(|line| line.2 <= upto[0]) {
                copy.imu.publish_words(*at, words);
            }
            while let Some((_, at, _, words)) = inputs[1].next_if(|line| line.2 <= upto[1]) {
                copy.command.publish_words(*at, words);
            }
            let mut activation = Activation::replay(*recorded.record());
            copy.activate(usize::from(recorded.record().index), &mut activation);
            copy.taps.drain(&mut |topic, at, generation, words| copy.log.push((topic, at, generation, words.to_vec())));
            prop_assert!(!activation.is_missing_input() || rig.taps.lost() > 0);
        }
        if rig.taps.lost() == 0 {
            for id in [topics::Id::estimate, topics::Id::demand] {
                let recorded: Vec<_> = rig.log.iter().filter(|line| line.0 == id as usize).collect();
                let replayed: Vec<_> = copy.log.iter().filter(|line| line.0 == id as usize).collect();
                prop_assert_eq!(recorded, replayed);
            }
        }
    }
}
