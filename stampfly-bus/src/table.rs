//! The topic table: one line per topic, and everything that follows from it.

use stampfly_types::{Duration, FieldInfo};

/// What a line of the topic table says, for tools: the command line, the log, the documentation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TopicInfo {
    /// Name of the topic.
    pub name: &'static str,
    /// First line of its documentation.
    pub doc: &'static [&'static str],
    /// Type name of its message.
    pub message: &'static str,
    /// `latest`, `ring` or `queue`.
    pub policy: &'static str,
    /// Number of slots.
    pub depth: usize,
    /// Nominal rate as written in the table, such as `400 Hz` or `on event`.
    pub rate: &'static str,
    /// Time between two samples at that rate; `None` when they come as they come.
    pub period: Option<Duration>,
    /// Who publishes it.
    pub publisher: &'static str,
    /// Who reads it. The log tap reads every topic and is not listed.
    pub readers: &'static [&'static str],
    /// Words per sample.
    pub words: usize,
    /// Schema of the message.
    pub fields: &'static [FieldInfo],
}

/// Slots of a `latest` topic. Only the newest is ever asked for; the others let the log tap, which comes round
/// every few milliseconds, miss nothing.
pub const LATEST_DEPTH: usize = 8;

/// Declares the topics of a vehicle.
///
/// ```text
/// topics! {
///     /// The vehicle's topics.
///     pub mod wiring;
///     /// First line of the documentation.
///     name: Message = latest | ring(N) | queue(N) @ 400 Hz | on event from publisher => [reader, …];
/// }
/// ```
///
/// From each line follow a module `wiring::name` with the types `Tx` and `Rx` of its ends, a field of
/// `wiring::Ports` that holds exactly one publisher `tx` and one subscriber per named reader, a row of
/// `wiring::TOPICS`, an index in `wiring::Id`, and a log tap. A vehicle's bus is a value, `wiring::Bus`; it can only
/// be split while nobody else holds a part of it:
///
/// ```
/// use stampfly_bus::topics;
/// use stampfly_types::{Instant, messages::{ImuData, TofData}};
///
/// topics! {
///     /// Two sensors.
///     pub mod wiring;
///     /// Inertial sample.
///     sensor_imu: ImuData = ring(16) @ 400 Hz from imu => [estimation];
///     /// Range to the ground.
///     sensor_tof: TofData = latest @ 30 Hz from tof => [estimation, landing];
/// }
///
/// fn main() {
///     let mut bus = wiring::Bus::new();
///     let wiring::Split { ports, mut taps, .. } = bus.split(None);
///     let wiring::Ports { sensor_imu: mut imu, sensor_tof: mut tof } = ports;
///
///     imu.tx.publish(Instant::from_micros(2_500), &ImuData::default());
///     tof.tx.publish(Instant::from_micros(2_000), &TofData { distance: 0.4, valid: true, ..Default::default() });
///
///     assert_eq!(imu.estimation.next().unwrap().generation, 1);
///     assert_eq!(tof.landing.latest().unwrap().data.distance, 0.4);
///     let mut logged = 0;
///     taps.drain(&mut |_topic, _at, _generation, _words| logged += 1);
///     assert_eq!(logged, 2);
/// }
/// ```
///
/// Publishing from two places, reading without being named and forgetting to hand out an end do not compile.
#[macro_export]
macro_rules! topics {
    (
        $(#[$table_meta:meta])* $vis:vis mod $table:ident;
        $(
            $(#[doc = $doc:literal])+
            $name:ident : $Message:ty = $policy:ident $(($depth:literal))? @ $rate:tt $unit:ident from $publisher:ident
                => [$($reader:ident),* $(,)?];
        )+
    ) => {
        $(#[$table_meta])*
        $vis mod $table {
            #[allow(unused_imports, reason = "message types are named as the table's author sees them")]
            use super::*;
            use $crate::__private as bus;

            /// Index of a topic in the table.
            #[allow(non_camel_case_types, reason = "a topic has one spelling everywhere")]
            #[derive(Clone, Copy, Debug, PartialEq, Eq)]
            pub enum Id { $($(#[doc = $doc])+ $name),+ }

            /// Number of topics.
            pub const COUNT: usize = [$(Id::$name),+].len();

            /// The table itself.
            pub const TOPICS: [$crate::TopicInfo; COUNT] = [$($crate::TopicInfo {
                name: stringify!($name),
                doc: &[$($doc),+],
                message: <$Message as bus::Message>::NAME,
                policy: stringify!($policy),
                depth: $crate::topics!(@depth $policy $($depth)?),
                rate: concat!(stringify!($rate), " ", stringify!($unit)),
                period: $crate::topics!(@period $rate $unit),
                publisher: stringify!($publisher),
                readers: &[$(stringify!($reader)),*],
                words: <$Message as bus::Message>::WORDS,
                fields: <$Message as bus::Message>::FIELDS,
            }),+];

            /// Storage of every topic of one vehicle.
            pub struct Bus { $($name: $name::Storage),+ }

            impl Bus {
                /// A bus on which nothing has been published.
                #[must_use]
                #[allow(clippy::new_without_default, reason = "`const`, for a static in firmware")]
                pub const fn new() -> Self {
                    Self { $($name: $name::Storage::new()),+ }
                }

                /// Hands out every end once. `hook` is called after every publish.
                pub fn split(&mut self, hook: Option<$crate::Hook>) -> Split<'_> {
                    let bus: &Self = self;
                    Split {
                        ports: Ports { $($name: $name::Ends::new(&bus.$name, hook)),+ },
                        taps: Taps { $($name: $crate::Tap::__new(&bus.$name)),+ },
                        heads: [$(&bus.$name as &dyn $crate::AnyTopic),+],
                    }
                }
            }

            /// Everything a bus is split into.
            pub struct Split<'b> {
                /// The ends, by topic.
                pub ports: Ports<'b>,
                /// The log's cursors.
                pub taps: Taps<'b>,
                /// Every topic without its type, by [`Id`].
                pub heads: [&'b dyn $crate::AnyTopic; COUNT],
            }

            /// The ends of every topic. Take it apart without `..`: that is how the compiler finds a forgotten end.
            pub struct Ports<'b> { $($(#[doc = $doc])+ pub $name: $name::Ends<'b>),+ }

            /// The log's cursors.
            pub struct Taps<'b> { $($name: $name::Tap<'b>),+ }

            impl Taps<'_> {
                /// Hands every new sample of every topic to `take`: topic, instant, generation, words.
                pub fn drain(&mut self, take: &mut dyn FnMut(Id, bus::Instant, u32, &[u32])) {
                    $(self.$name.drain(&mut |at, generation, words| take(Id::$name, at, generation, words));)+
                }

                /// Samples the log has missed, over all topics.
                #[must_use]
                pub fn lost(&self) -> u32 {
                    0 $(+ self.$name.lost())+
                }
            }

            $(
                $(#[doc = $doc])+
                pub mod $name {
                    #[allow(unused_imports, reason = "message types are named as the table's author sees them")]
                    use super::super::*;
                    use $crate::__private as bus;

                    const DEPTH: usize = $crate::topics!(@depth $policy $($depth)?);
                    const WORDS: usize = <$Message as bus::Message>::WORDS;
                    const REQUIRED_READERS: usize = $crate::topics!(@required $policy [$($reader)*]);
                    type Policy = $crate::topics!(@policy $policy);

                    pub(super) type Storage = $crate::Topic<$Message, Policy, DEPTH, WORDS, REQUIRED_READERS>;
                    /// The writing end.
                    pub type Tx<'b> = $crate::Publisher<'b, $Message, Policy, DEPTH, WORDS, REQUIRED_READERS>;
                    /// A reading end.
                    pub type Rx<'b> = $crate::Subscriber<'b, $Message, Policy, DEPTH, WORDS>;
                    pub(super) type Tap<'b> = $crate::Tap<'b, $Message, DEPTH, WORDS>;

                    /// The ends of this topic.
                    pub struct Ends<'b> {
                        /// The publisher.
                        pub tx: Tx<'b>,
                        $(#[doc = concat!("Read by `", stringify!($reader), "`.")] pub $reader: Rx<'b>,)*
                    }

                    impl<'b> Ends<'b> {
                        #[allow(unused_assignments, unused_mut, reason = "a topic may have no reader but the log")]
                        pub(super) fn new(topic: &'b Storage, hook: Option<$crate::Hook>) -> Self {
                            let mut index = 0usize;
                            Self {
                                tx: topic.__publisher(hook, super::Id::$name as usize),
                                $($reader: { index += 1; topic.__subscriber(index - 1) },)*
                            }
                        }
                    }
                }
            )+
        }
    };
    (@depth latest) => { $crate::LATEST_DEPTH };
    (@depth ring $depth:literal) => { $depth };
    (@depth queue $depth:literal) => { $depth };
    (@period on event) => { None };
    (@period $rate:literal Hz) => { Some(bus::Duration::from_micros(1_000_000 / $rate)) };
    (@policy latest) => { $crate::Latest };
    (@policy ring) => { $crate::Every };
    (@policy queue) => { $crate::Lossless };
    (@required queue [$($reader:ident)*]) => { <[&str]>::len(&[$(stringify!($reader)),*]) };
    (@required $policy:ident [$($reader:ident)*]) => { 0 };
}
