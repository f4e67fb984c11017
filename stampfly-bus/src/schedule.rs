//! What follows from an activation table: its lines as data, and the table as a trait.
//!
//! [`schedule!`](crate::schedule!) generates an `impl` of [`Schedule`]; code that works for any vehicle (an executor, a
//! recorder, a replay) is generic over it and never names a runnable. [`Scheduler`](crate::Scheduler) decides from the
//! lines what is due.

use crate::activation::Activation;
use crate::scheduler::ActivationState;
use crate::table::TopicTable;
use stampfly_types::{Duration, Instant};

/// Most topics one `on` can name.
pub const MAX_TRIGGERS: usize = 4;

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
    /// Its documentation, line by line.
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

/// A vehicle's activation table with its runnables. Implemented by the struct that [`schedule!`](crate::schedule!)
/// generates, which has one field per line.
pub trait Schedule: Sized + 'static {
    /// The topic table it belongs to.
    type Topics: TopicTable;
    /// What its runnables are configured from.
    type Config;
    /// What the scheduler keeps per line: an array.
    type States: AsRef<[ActivationState]> + AsMut<[ActivationState]> + Clone;
    /// The table itself.
    const ACTIVATIONS: &'static [ActivationInfo];
    /// Number of inputs of each line.
    const INPUTS: &'static [usize];

    /// Every runnable at power-on.
    fn new(config: &Self::Config) -> Self;

    /// What the scheduler keeps, at power-on.
    fn states(start: Instant) -> Self::States;

    /// Copies the inputs of one runnable. A line that does not exist reads nothing.
    fn read(ends: &mut <Self::Topics as TopicTable>::Ends<'_>, index: usize, activation: &mut Activation);

    /// Steps one runnable on the inputs it has read.
    fn run(&mut self, ends: &mut <Self::Topics as TopicTable>::Ends<'_>, index: usize, activation: &mut Activation);
}
