//! Random traffic on a topic of every policy, beside a model that is too simple to be wrong: everything ever
//! published, and each reader's place in it.
//!
//! Runs start a few samples after power-on, where the ring is empty, and a few samples before the generations wrap,
//! which at 400 Hz takes 124 days.

use proptest::prelude::*;
use stampfly_bus::{Every, Full, Latest, Lossless, Publisher, Stamped, Subscriber, Topic};
use stampfly_types::messages::PowerData;
use stampfly_types::{Instant, Message};

const DEPTH: usize = 4;
const WORDS: usize = PowerData::WORDS;
const READERS: usize = 2;

/// What happens next.
#[derive(Clone, Copy, Debug)]
enum Step {
    Publish,
    Next(usize),
    Latest(usize),
    Look(usize, u32),
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = prop_oneof![
        4 => Just(Step::Publish),
        3 => (0..READERS).prop_map(Step::Next),
        1 => (0..READERS).prop_map(Step::Latest),
        1 => (0..READERS, 0..8u32).prop_map(|(reader, back)| Step::Look(reader, back)),
    ];
    prop::collection::vec(step, 0..120)
}

/// The generation a run starts after: power-on, or shortly before the wrap.
fn start() -> impl Strategy<Value = u32> {
    prop_oneof![Just(0), u32::MAX - 20..=u32::MAX]
}

fn data(number: usize) -> PowerData {
    PowerData { voltage: number as f32, ..Default::default() }
}

/// Generations count from one and skip zero when they wrap.
fn generation(start: u32, number: usize) -> u32 {
    let sum = u64::from(start) + number as u64;
    if sum > u64::from(u32::MAX) { (sum - u64::from(u32::MAX)) as u32 } else { sum as u32 }
}

/// A reader's place: how many samples are behind it, and how many of them it missed.
#[derive(Clone, Copy, Default)]
struct Place {
    behind: usize,
    lost: u32,
}

/// The model: samples are numbered from one, whatever their generation. An aged topic starts with a sample zero.
struct Model {
    start: u32,
    published: usize,
    places: [Place; READERS],
}

impl Model {
    fn new(start: u32) -> Self {
        Self { start, published: 0, places: [Place::default(); READERS] }
    }

    fn stamped(&self, number: usize) -> Option<Stamped<PowerData>> {
        let generation = generation(self.start, number);
        (generation > 0).then_some(Stamped { at: Instant::from_micros(number as u64), generation, data: data(number) })
    }

    /// How many of the newest samples are held once `published` are: one for each slot, but where generations skip
    /// zero they skip a slot with it.
    fn held(&self, published: usize) -> usize {
        let has_wrapped = u64::from(self.start) + published as u64 > u64::from(u32::MAX);
        if has_wrapped && (generation(self.start, published) as usize) < DEPTH { DEPTH - 1 } else { DEPTH }
    }

    /// Nobody may lose the sample that is next for them.
    fn has_room(&self) -> bool {
        let after = self.published + 1;
        self.places.iter().all(|place| after - place.behind <= self.held(after))
    }

    fn next(&mut self, reader: usize) -> Option<Stamped<PowerData>> {
        let oldest = self.published.saturating_sub(self.held(self.published));
        let place = &mut self.places[reader];
        place.lost += oldest.saturating_sub(place.behind) as u32;
        place.behind = place.behind.max(oldest);
        if place.behind == self.published {
            return None;
        }
        place.behind += 1;
        let number = place.behind;
        self.stamped(number)
    }

    fn latest(&mut self, reader: usize) -> Option<Stamped<PowerData>> {
        self.places[reader].behind = self.published;
        self.stamped(self.published)
    }

    /// The sample `back` before the newest, if it is still there.
    fn look(&mut self, reader: usize, back: usize) -> Option<Stamped<PowerData>> {
        let number = self.published.checked_sub(back).filter(|_| back < self.held(self.published))?;
        let sample = self.stamped(number)?;
        self.places[reader].behind = number;
        Some(sample)
    }
}

type Writer<'b, P, const R: usize> = Publisher<'b, PowerData, P, DEPTH, WORDS, R>;
type Reader<'b, P> = Subscriber<'b, PowerData, P, DEPTH, WORDS>;

/// Does the same to a topic and to the model. `publish` says whether it was accepted; `next` is there for the policies
/// that have it.
fn compare<P, const R: usize>(
    start: u32,
    steps: &[Step],
    mut publish: impl FnMut(&mut Writer<'_, P, R>, &Model, Instant, PowerData) -> Result<u32, TestCaseError>,
    next: Option<impl Fn(&mut Reader<'_, P>) -> Option<Stamped<PowerData>>>,
) -> Result<(), TestCaseError> {
    let mut topic: Topic<PowerData, P, DEPTH, WORDS, R> = Topic::new();
    if start > 0 {
        topic.__age(start);
    }
    let (mut tx, mut readers) = topic.split::<READERS>();
    let mut model = Model::new(start);
    for step in steps {
        match (*step, &next) {
            (Step::Publish, _) => {
                let number = model.published + 1;
                let newest = publish(&mut tx, &model, Instant::from_micros(number as u64), data(number))?;
                model.published += usize::from(newest == generation(start, number));
                prop_assert_eq!(newest, generation(start, model.published));
            }
            (Step::Next(reader), Some(next)) => prop_assert_eq!(next(&mut readers[reader]), model.next(reader)),
            (Step::Next(reader) | Step::Latest(reader), _) => {
                prop_assert_eq!(readers[reader].latest(), model.latest(reader));
            }
            (Step::Look(reader, back), _) => {
                let wanted = generation(start, model.published).wrapping_sub(back);
                // Zero is no generation: what lies behind it is one further back.
                let wrapped = start > 0 && wanted.wrapping_add(back) <= back && back > 0;
                let wanted = wanted.wrapping_sub(u32::from(wrapped));
                prop_assert_eq!(readers[reader].at_generation(wanted), model.look(reader, back as usize));
            }
        }
        for (rx, place) in readers.iter().zip(model.places) {
            prop_assert_eq!(rx.generation(), generation(start, place.behind));
            prop_assert_eq!(rx.has_new(), place.behind != model.published);
            prop_assert_eq!(rx.lost(), place.lost);
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn latest(start in start(), steps in steps()) {
        compare::<Latest, 0>(start, &steps, |tx, _, at, data| Ok(tx.publish(at, &data)), None::<fn(&mut Reader<'_, _>) -> _>)?;
    }

    #[test]
    fn every(start in start(), steps in steps()) {
        compare::<Every, 0>(start, &steps, |tx, _, at, data| Ok(tx.publish(at, &data)), Some(|rx: &mut Reader<'_, _>| rx.next()))?;
    }

    #[test]
    fn lossless(start in start(), steps in steps()) {
        let publish = |tx: &mut Writer<'_, Lossless, READERS>, model: &Model, at, data| {
            let outcome = tx.publish(at, data);
            prop_assert_eq!(outcome.is_ok(), model.has_room());
            Ok(outcome.unwrap_or_else(|Full(refused)| {
                assert_eq!(refused, data, "a refused value is given back");
                tx.generation()
            }))
        };
        compare::<Lossless, READERS>(start, &steps, publish, Some(|rx: &mut Reader<'_, _>| rx.next()))?;
    }
}
