#![doc = include_str!("../README.md")]
//!
//! # The parts
//! Typed topics on a lock-free broadcast ring, and the table that says what runs when.
//!
//! A vehicle is two tables. [`topics!`] says what is published, by whom, how often and for whom; [`schedule!`]
//! says what runs when. From the first follow the ends of every participant (one publisher and one subscriber per named
//! reader), the log's taps and the listing on the command line; from the second the dispatch that every executor shares.
//!
//! | need | use |
//! |---|---|
//! | newest value, never wait | policy `latest` → [`Latest`] |
//! | every sample, losses counted per reader | policy `ring(N)` → [`Every`] |
//! | nothing lost, publisher may be refused | policy `queue(N)` → [`Lossless`] |
//! | wake a task on publish | [`Hook`], given to `Bus::split`; `Bell` with the feature `async` |
//! | code for any vehicle's tables | [`TopicTable`], [`Schedule`] |
//! | know while compiling that everything is in time | [`schedule!`], [`response_time`] |
//! | repeat a flight bit for bit | [`Activation`] |
//!
//! No `unsafe`, no critical section, no allocation, no `static`: a bus is a value and a test can fly a thousand of
//! them. Publishing and reading work from interrupts and across cores, on targets without 64-bit atomics.
//!
//! Not for: several publishers of one topic (arbitrate first), or messages of varying size.
#![no_std]

#[cfg(any(test, loom))]
extern crate std;

// The tables name this crate by its name, here as elsewhere.
extern crate self as stampfly_bus;

mod activation;
mod activation_state;
#[cfg(feature = "async")]
pub mod bell;
mod input;
mod line;
mod macros;
mod output;
mod response;
mod ring;
mod schedule;
mod scheduler;
mod sync;
mod table;
mod topic;

#[doc(hidden)]
pub use activation::__run;
pub use activation::{Activation, ReadInputs, Runnable};
pub use activation_state::ActivationState;
#[cfg(feature = "async")]
pub use bell::Bell;
/// Its vectors are in signatures here.
pub use heapless;
pub use input::{NewestInput, SamplesInput};
#[doc(hidden)]
pub use input::{NewestPort, SamplesPort};
pub use line::{ActivationInfo, Band, MAX_TRIGGERS, Trigger};
pub use output::NewestOutput;
pub use response::{JITTER, Unbounded, response_time};
pub use schedule::{Schedule, VisitLines};
pub use scheduler::Scheduler;
/// For [`topics!`] and [`schedule!`].
#[doc(hidden)]
pub use stampfly_bus_macros::{schedule as __schedule, topics as __topics};
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
pub use stampfly_types::activation::MAX_INPUTS;
pub use stampfly_types::{Duration, Instant, Message, Stamped, message, message_enum, message_flags};
pub use table::{LATEST_DEPTH, PublishWords, Split, Taps, TopicInfo, TopicTable};
pub use topic::{
    AnyTopic, Every, Full, Head, Hook, InPlace, Latest, Lossless, Overwriting, Publisher, Sequential, Subscriber, Tap,
    Topic,
};

#[cfg(loom)]
#[doc(hidden)]
pub use sync::weaken;
