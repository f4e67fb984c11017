//! A vehicle's tables for the test of one runnable: publish its inputs, run it, look at its outputs (AUTOSAR: a mock RTE).
//!
//! Nothing runs but what the test runs, and any topic can be published, whoever publishes it in the vehicle. For several
//! runnables together use the [flight loop](crate::FlightLoop), which knows when each is due.

use crate::flight_loop::{Assembled, FlightLoop};
use crate::newest::message;
use stampfly_bus::{AnyTopic, PublishWords, Schedule, TopicTable};
use stampfly_types::{ActivationRecord, Instant, Message, Stamped};

/// The tables of a vehicle in the hands of a test. Topics and runnables go by their names.
///
/// ```
/// # mod rover { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/flight/common/mod.rs")); }
/// use rover::{Rover, topics}; // the rover of `tests/flight/common`, configured by a gain
/// use stampfly_flight::Mock;
/// use stampfly_types::{Instant, messages::{FlightStatus, MotorOutput, TofData}};
///
/// # fn main() {
/// let (mut bus, now) = (topics::Bus::new(), Instant::from_millis(20));
/// let mut mock = Mock::<Rover>::new(&mut bus, &0.5);
/// mock.publish("sensor_range", now, &TofData { distance: 1.0, valid: true, ..TofData::default() }).expect("a topic");
/// mock.run("drive", now).expect("a runnable");
/// let output = mock.newest::<MotorOutput>("actuator_motor").expect("published");
/// assert_eq!((output.at, output.data.duty[0]), (now, 0.5));
/// assert_eq!(mock.newest::<FlightStatus>("flight_status"), None, "the monitor has not run");
/// # }
/// ```
pub struct Mock<'b, R: Schedule> {
    flight_loop: FlightLoop<'b, R>,
    outside: <R::Topics as TopicTable>::Outside<'b>,
}

impl<'b, R: Schedule> Mock<'b, R> {
    /// Every runnable at power-on, on an empty bus.
    pub fn new(bus: &'b mut R::Topics, config: &R::Config) -> Self {
        let Assembled { flight_loop, outside, .. } = Assembled::new(bus, None, config, Instant::ZERO);
        Self { flight_loop, outside }
    }

    fn place<M: Message>(topic: &str) -> Option<usize> {
        <R::Topics as TopicTable>::TOPICS.iter().position(|info| info.name == topic && info.message == M::NAME)
    }

    /// Publishes a message. Returns its generation; `None` when there is no such topic of this message.
    pub fn publish<M: Message>(&mut self, topic: &str, at: Instant, message: &M) -> Option<u32> {
        let (place, words) = (Self::place::<M>(topic)?, message.to_words());
        let from_outside = self.outside.publish_words(place, at, words.as_ref());
        from_outside.or_else(|| self.flight_loop.ends_mut().publish_words(place, at, words.as_ref()))
    }

    /// Activates a runnable. Returns what it has read; `None` when there is no such runnable.
    pub fn run(&mut self, runnable: &str, now: Instant) -> Option<ActivationRecord> {
        let index = R::ACTIVATIONS.iter().position(|info| info.name == runnable)?;
        Some(self.flight_loop.activate(index, now))
    }

    /// The newest message of a topic; `None` before the first, or when there is no such topic of this message.
    #[must_use]
    pub fn newest<M: Message>(&self, topic: &str) -> Option<Stamped<M>> {
        let topic: &dyn AnyTopic = *self.flight_loop.heads().get(Self::place::<M>(topic)?)?;
        let (generation, mut newest) = (topic.head(), None);
        topic.copy(generation, &mut |at, words| {
            newest = message(words).map(|data| Stamped { at, generation, data });
        });
        newest
    }

    /// The runnables: the state of the vehicle.
    #[must_use]
    pub const fn runnables(&self) -> &R {
        self.flight_loop.runnables()
    }
}
