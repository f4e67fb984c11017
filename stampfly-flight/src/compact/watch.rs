//! Which topics a compact record takes its samples from, and how samples get from a topic's slot into the ring.

use super::entry::{Kind, WHOLE_PASS, seen_by};
use super::ring::RingWriter;
use heapless::Vec;
use stampfly_bus::{AnyTopic, Band, Head, Schedule, TopicTable};

/// Most topics from outside.
const TOPICS: usize = 32;
/// Most runnables that read one of them.
pub(super) const READERS: usize = 8;

/// A topic from outside.
pub(super) struct Watched<'b> {
    pub head: Head<'b>,
    /// Everything up to this generation is in the record.
    pub known: u32,
    pub topic: &'b dyn AnyTopic,
    pub place: u8,
    /// Line, and which of its inputs this topic is.
    pub readers: Vec<(u8, u8), READERS>,
}

/// What takes samples.
pub(super) struct Taking<'t, 'r, const WORDS: usize> {
    pub ring: &'t mut RingWriter<'r, WORDS>,
    /// There are positions in the ring, which are wrong as soon as something is new.
    pub is_at_rest: bool,
    /// There was everything, and room for it.
    pub is_whole: bool,
}

impl<const WORDS: usize> Taking<'_, '_, WORDS> {
    #[inline(always)]
    pub fn take_new(&mut self, watched: &mut Watched<'_>) {
        if watched.has_moved() {
            let newest = watched.head.newest();
            self.take(watched, newest, WHOLE_PASS);
        }
    }

    /// Takes the samples of a topic up to this one.
    #[inline(always)]
    pub fn take(&mut self, watched: &mut Watched<'_>, to: u32, line: u32) {
        if self.is_at_rest {
            self.is_at_rest = false;
            self.ring.discard();
        }
        while watched.known != to {
            let generation = Head::after(watched.known);
            watched.known = generation;
            let Some(sample) = watched.topic.in_place(generation) else {
                self.is_whole = false;
                continue;
            };
            if !self.ring.has_room(sample.words().len() as u32 + 2) {
                self.is_whole = false;
                continue;
            }
            let first = Kind::Sample.word(watched.place.into(), seen_by(line, generation));
            self.ring.sample([first, sample.at_low()], &sample);
            self.is_whole &= sample.is_whole();
        }
    }
}

/// Which topics are watched, in an order in which those that a band reads stand next to each other.
pub(super) struct Watch<'b> {
    pub topics: Vec<Watched<'b>, TOPICS>,
    /// The flight band reads those before.
    pub flight: usize,
    /// The background reads those from here on.
    pub background: usize,
    /// Those from here on nobody reads.
    pub unread: usize,
}

impl<'b> Watch<'b> {
    pub fn new<R: Schedule>(heads: &[&'b dyn AnyTopic]) -> Self {
        let mut watch = Self { topics: Vec::new(), flight: 0, background: 0, unread: 0 };
        let table = <R::Topics as TopicTable>::TOPICS;
        // Flight band alone; both; background alone; nobody.
        for wanted in 0..4 {
            match wanted {
                1 => watch.background = watch.topics.len(),
                2 => watch.flight = watch.topics.len(),
                3 => watch.unread = watch.topics.len(),
                _ => {}
            }
            for (place, (info, topic)) in table.iter().zip(heads).enumerate() {
                let of =
                    |band| R::ACTIVATIONS.iter().any(|line| line.band == band && info.readers.contains(&line.name));
                let group = match (of(Band::Flight), of(Band::Background)) {
                    (true, false) => 0,
                    (true, true) => 1,
                    (false, true) => 2,
                    (false, false) => 3,
                };
                if group != wanted || !info.is_outside {
                    continue;
                }
                let lines = R::ACTIVATIONS.iter().enumerate().filter(|(_, line)| info.readers.contains(&line.name));
                let readers = lines.map(|(index, line)| {
                    let inputs = table.iter().take(place).filter(|info| info.readers.contains(&line.name));
                    (index as u8, inputs.count() as u8)
                });
                let head = topic.counter();
                let readers = readers.take(READERS).collect();
                _ = watch.topics.push(Watched {
                    head,
                    known: head.newest(),
                    topic: *topic,
                    place: place as u8,
                    readers,
                });
            }
        }
        watch
    }

    /// Those that a band reads.
    #[inline(always)]
    pub fn of(&mut self, band: Band) -> &mut [Watched<'b>] {
        match band {
            Band::Flight => self.topics.get_mut(..self.flight),
            _ => self.topics.get_mut(self.background..self.unread),
        }
        .unwrap_or_default()
    }
}

impl Watched<'_> {
    #[inline(always)]
    pub fn has_moved(&self) -> bool {
        self.head.has_moved(self.known)
    }
}

/// Four at a time, which takes a third less.
#[inline(always)]
pub(super) fn have_moved(topics: &[Watched<'_>]) -> bool {
    let (fours, rest) = topics.as_chunks::<4>();
    fours.iter().any(|[a, b, c, d]| a.has_moved() || b.has_moved() || c.has_moved() || d.has_moved())
        || rest.iter().any(Watched::has_moved)
}
