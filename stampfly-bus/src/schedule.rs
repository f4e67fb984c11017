//! The activation table: who runs when, and in which band.

use crate::topic::AnyTopic;
use stampfly_types::{Duration, Instant};

/// What activates a runnable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Trigger {
    /// Something new on any of these topics (indices into the topic table).
    On(&'static [usize]),
    /// A fixed period.
    Every(Duration),
    /// The activation with this index has just finished.
    After(usize),
}

/// Where a runnable runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Band {
    /// In table order, as one task, ahead of everything else.
    Flight,
    /// When the flight band has nothing to do. May be interrupted by it.
    Background,
}

/// One line of the activation table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ActivationInfo {
    /// Name of the runnable.
    pub name: &'static str,
    /// First line of its documentation.
    pub doc: &'static [&'static str],
    /// What activates it.
    pub trigger: Trigger,
    /// Activate it this long after its last activation even if the trigger stays silent.
    pub at_latest: Option<Duration>,
    /// Where it runs.
    pub band: Band,
    /// Execution time it may take on the target.
    pub budget: Duration,
}

/// Decides which activation is due. Holds no clock and runs nothing: executors on a microcontroller, on a host and
/// in a replay share it, so they agree on `now`.
///
/// `now` of an activation is the newest stamp of its topics for `on`, the predecessor's `now` for `after`, and the
/// scheduled tick for `every` and `or at latest`; it never goes back.
///
/// `or at latest` counts from when the activation last ran, by the clock, not from its `now`: a stamp is as old as the
/// sensor's delay, and a deadline that counted from it would pass while everything is in order.
#[derive(Clone, Debug)]
pub struct Scheduler<const A: usize, const T: usize> {
    table: &'static [ActivationInfo; A],
    /// Heads seen by each activation's triggers.
    seen: [[u32; MAX_TRIGGERS]; A],
    /// The `now` of each activation's last run.
    last: [Instant; A],
    /// What the clock showed at each activation's last run.
    ran: [Instant; A],
    /// How often each activation has finished.
    runs: [u32; A],
    /// How often each activation's predecessor had finished when it last started.
    followed: [u32; A],
}

/// Most topics one `on` can name.
pub const MAX_TRIGGERS: usize = 4;

impl<const A: usize, const T: usize> Scheduler<A, T> {
    /// A scheduler at power-on, `start` on the clock. Periods count from there.
    #[must_use]
    pub fn new(table: &'static [ActivationInfo; A], start: Instant) -> Self {
        Self { table, seen: [[0; MAX_TRIGGERS]; A], last: [start; A], ran: [start; A], runs: [0; A], followed: [0; A] }
    }

    /// The first activation of this band from line `first` on that is due at `clock`: its index and its `now`.
    ///
    /// An executor that goes through the table once, from each activation to the next, runs a whole chain of `after`s in
    /// one pass, because `after` only names lines above.
    #[inline]
    #[must_use]
    pub fn due(
        &self,
        band: Band,
        first: usize,
        clock: Instant,
        heads: &[&dyn AnyTopic; T],
    ) -> Option<(usize, Instant)> {
        self.table
            .iter()
            .enumerate()
            .skip(first)
            .filter(|(_, info)| info.band == band)
            .find_map(|(index, info)| self.triggered(index, info, clock, heads).map(|now| (index, now)))
    }

    fn triggered(
        &self,
        index: usize,
        info: &ActivationInfo,
        clock: Instant,
        heads: &[&dyn AnyTopic; T],
    ) -> Option<Instant> {
        let by_trigger = match info.trigger {
            Trigger::On(topics) => topics
                .iter()
                .zip(self.seen.get(index)?)
                .filter_map(|(topic, seen)| {
                    let topic = heads.get(*topic)?;
                    (topic.head() != *seen).then(|| topic.newest_at()).flatten()
                })
                .max(),
            Trigger::After(before) => {
                let runs = *self.runs.get(before)?;
                (runs != *self.followed.get(index)?).then(|| self.last.get(before).copied()).flatten()
            }
            Trigger::Every(_) => None,
        };
        // A deadline that has passed may have been later than the stamp that comes after it.
        let last = *self.last.get(index)?;
        by_trigger
            .map(|now| now.max(last))
            .or_else(|| self.tick(index, info).filter(|tick| clock >= *tick).map(|tick| tick.max(last)))
    }

    /// When this activation is due even if nothing triggers it.
    fn tick(&self, index: usize, info: &ActivationInfo) -> Option<Instant> {
        match info.trigger {
            Trigger::Every(period) => Some(*self.last.get(index)? + period),
            _ => Some(*self.ran.get(index)? + info.at_latest?),
        }
    }

    /// Notes that an activation is about to read its inputs, at `clock`.
    #[inline]
    pub fn started(&mut self, index: usize, now: Instant, clock: Instant, heads: &[&dyn AnyTopic; T]) {
        match self.table.get(index).map(|info| info.trigger) {
            Some(Trigger::On(topics)) => {
                let seen = self.seen.get_mut(index).into_iter().flatten();
                for (topic, seen) in topics.iter().zip(seen) {
                    *seen = heads.get(*topic).map_or(0, |topic| topic.head());
                }
            }
            Some(Trigger::After(before)) => {
                if let (Some(runs), Some(followed)) = (self.runs.get(before), self.followed.get_mut(index)) {
                    *followed = *runs;
                }
            }
            _ => {}
        }
        // A tick is on time by definition, so that ticks do not drift with an executor that is late.
        let is_tick = self.table.get(index).and_then(|info| self.tick(index, info)) == Some(now);
        if let Some(ran) = self.ran.get_mut(index) {
            *ran = if is_tick { now } else { clock };
        }
        if let Some(last) = self.last.get_mut(index) {
            *last = now;
        }
    }

    /// Notes that an activation has published: releases the ones that run after it.
    #[inline]
    pub fn finished(&mut self, index: usize) {
        if let Some(runs) = self.runs.get_mut(index) {
            *runs = runs.wrapping_add(1);
        }
    }

    /// The next instant at which a period or a deadline makes something due.
    #[must_use]
    pub fn next_tick(&self) -> Option<Instant> {
        self.table.iter().enumerate().filter_map(|(index, info)| self.tick(index, info)).min()
    }
}

/// A vehicle's runnables, addressed by their line in the activation table. Generated by
/// [`schedule!`](crate::schedule!).
pub trait Runnables {
    /// Copies the inputs of one runnable.
    fn read(&mut self, index: usize, activation: &mut crate::Activation);
    /// Steps one runnable.
    fn run(&mut self, index: usize, activation: &mut crate::Activation);
}

/// Declares who runs when.
///
/// ```text
/// schedule! {
///     /// The vehicle's activations.
///     pub mod plan on wiring;
///     /// First line of the documentation.
///     name = Runnable: on topic | topic, flight, 300 us;
///     name = Runnable: after name or at latest 5 ms, flight, 40 us;
///     name = Runnable: every 20 ms, background, 80 us;
/// }
/// ```
///
/// `Runnable` is a type `Runnable<'b>` that implements [`Runnable`](crate::Runnable). From the table follow
/// `plan::Vehicle<'b>`, a struct with one field per line that implements [`Runnables`], `plan::ACTIVATIONS`, and
/// `plan::RESPONSE_TIMES`: how long after its trigger each line has published at the latest. The flight band runs in table
/// order, so `after` may only name a line above it; that, and a line that could not finish before it is due again (see
/// [`response_time`](crate::response_time)), does not compile.
#[macro_export]
macro_rules! schedule {
    ($(#[$meta:meta])* $vis:vis mod $plan:ident on $wiring:ident; $($rows:tt)+) => {
        $crate::schedule!(@rows [$(#[$meta])* $vis $plan $wiring] [] $($rows)+);
    };

    // One rule per form of activation; each turns its line into the same shape.
    (@rows $head:tt [$($done:tt)*] $(#[doc = $doc:literal])+ $name:ident = $Type:ident : on $($topic:ident)|+ or at latest $late:literal $late_unit:ident, $band:ident, $budget:literal us; $($rest:tt)*) => {
        $crate::schedule!(@rows $head [$($done)* { [$($doc)+] $name $Type (on $($topic)+) (late $late $late_unit) $band $budget }] $($rest)*);
    };
    (@rows $head:tt [$($done:tt)*] $(#[doc = $doc:literal])+ $name:ident = $Type:ident : on $($topic:ident)|+ , $band:ident, $budget:literal us; $($rest:tt)*) => {
        $crate::schedule!(@rows $head [$($done)* { [$($doc)+] $name $Type (on $($topic)+) (never) $band $budget }] $($rest)*);
    };
    (@rows $head:tt [$($done:tt)*] $(#[doc = $doc:literal])+ $name:ident = $Type:ident : after $before:ident or at latest $late:literal $late_unit:ident, $band:ident, $budget:literal us; $($rest:tt)*) => {
        $crate::schedule!(@rows $head [$($done)* { [$($doc)+] $name $Type (after $before) (late $late $late_unit) $band $budget }] $($rest)*);
    };
    (@rows $head:tt [$($done:tt)*] $(#[doc = $doc:literal])+ $name:ident = $Type:ident : after $before:ident, $band:ident, $budget:literal us; $($rest:tt)*) => {
        $crate::schedule!(@rows $head [$($done)* { [$($doc)+] $name $Type (after $before) (never) $band $budget }] $($rest)*);
    };
    (@rows $head:tt [$($done:tt)*] $(#[doc = $doc:literal])+ $name:ident = $Type:ident : every $period:literal $period_unit:ident, $band:ident, $budget:literal us; $($rest:tt)*) => {
        $crate::schedule!(@rows $head [$($done)* { [$($doc)+] $name $Type (every $period $period_unit) (never) $band $budget }] $($rest)*);
    };

    (@rows [$(#[$meta:meta])* $vis:vis $plan:ident $wiring:ident] [$({ [$($doc:literal)+] $name:ident $Type:ident $trigger:tt $late:tt $band:ident $budget:literal })+]) => {
        $(#[$meta])*
        $vis mod $plan {
            use super::*;

            /// Index of a runnable in the table.
            #[allow(non_camel_case_types, reason = "a runnable has one spelling everywhere")]
            #[derive(Clone, Copy, Debug, PartialEq, Eq)]
            pub enum Id { $($(#[doc = $doc])+ $name),+ }

            /// Number of runnables.
            pub const COUNT: usize = [$(Id::$name),+].len();

            /// The table itself.
            pub const ACTIVATIONS: [$crate::ActivationInfo; COUNT] = [$($crate::ActivationInfo {
                name: stringify!($name),
                doc: &[$($doc),+],
                trigger: $crate::schedule!(@trigger $wiring $trigger),
                at_latest: $crate::schedule!(@late $late),
                band: $crate::schedule!(@band $band),
                budget: $crate::__private::Duration::from_micros($budget),
            }),+];

            const _: () = {
                let mut index = 0;
                while index < COUNT {
                    if let $crate::Trigger::After(before) = ACTIVATIONS[index].trigger {
                        assert!(before < index, "`after` may only name a line above");
                    }
                    index += 1;
                }
            };

            /// How long after its trigger each runnable has published at the latest, if everybody keeps to their budgets.
            pub const RESPONSE_TIMES: [$crate::__private::Duration; COUNT] =
                $crate::__private::response_times(&ACTIVATIONS, &$wiring::TOPICS);

            $(const _: () = match $crate::response_time(&ACTIVATIONS, &$wiring::TOPICS, Id::$name as usize) {
                Ok(_) => {}
                Err($crate::Unbounded::NoRate) => {
                    panic!(concat!("`", stringify!($name), "` is activated by a topic without a rate"))
                }
                Err(_) => panic!(concat!("`", stringify!($name), "` may not have finished when it is due again")),
            };)+

            /// Every runnable of one vehicle.
            pub struct Vehicle<'b> { $($(#[doc = $doc])+ pub $name: $Type<'b>),+ }

            impl $crate::Runnables for Vehicle<'_> {
                #[inline]
                fn read(&mut self, index: usize, activation: &mut $crate::Activation) {
                    $(if index == Id::$name as usize { return $crate::Runnable::read(&mut self.$name, activation) })+
                }
                #[inline]
                fn run(&mut self, index: usize, activation: &mut $crate::Activation) {
                    $(if index == Id::$name as usize { return $crate::Runnable::run(&mut self.$name, activation) })+
                }
            }
        }
    };

    (@trigger $wiring:ident (on $($topic:ident)+)) => { $crate::Trigger::On(const {
        let topics: &[usize] = &[$($wiring::Id::$topic as usize),+];
        assert!(topics.len() <= $crate::MAX_TRIGGERS, "`on` names too many topics");
        topics
    }) };
    (@trigger $wiring:ident (after $before:ident)) => { $crate::Trigger::After(Id::$before as usize) };
    (@trigger $wiring:ident (every $period:literal $unit:ident)) => { $crate::Trigger::Every($crate::schedule!(@time $period $unit)) };
    (@late (never)) => { None };
    (@late (late $late:literal $unit:ident)) => { Some($crate::schedule!(@time $late $unit)) };
    (@time $value:literal ms) => { $crate::__private::Duration::from_millis($value) };
    (@time $value:literal us) => { $crate::__private::Duration::from_micros($value) };
    (@band flight) => { $crate::Band::Flight };
    (@band background) => { $crate::Band::Background };
}
