//! An activation table with its runnables, as a trait.
//!
//! [`schedule!`](crate::schedule!) generates an `impl` of [`Schedule`]; code that works for any vehicle (an executor, a
//! recorder, a replay) is generic over it and never names a runnable. [`Scheduler`](crate::Scheduler) decides from the
//! lines what is due.

use crate::activation::Activation;
use crate::activation_state::ActivationState;
use crate::line::ActivationInfo;
use crate::table::TopicTable;
use stampfly_types::Instant;

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

    /// Puts one runnable back to power-on, with this configuration. A line that does not exist is none.
    fn renew(&mut self, index: usize, config: &Self::Config);

    /// What the scheduler keeps, at power-on.
    fn states(start: Instant) -> Self::States;

    /// Reads the inputs of one runnable. A line that does not exist reads nothing.
    fn read(ends: &mut <Self::Topics as TopicTable>::Ends<'_>, index: usize, activation: &mut Activation);

    /// Shows every line to a visitor, in the table's order.
    fn visit<V: VisitLines>(visitor: &mut V);

    /// Steps one runnable on the inputs it has read.
    fn run(&mut self, ends: &mut <Self::Topics as TopicTable>::Ends<'_>, index: usize, activation: &mut Activation);
}

/// Is shown the lines of a table, one by one, each as a constant: what depends on the line is then decided while compiling.
pub trait VisitLines {
    /// Is shown the line with this index.
    fn line<const INDEX: usize>(&mut self);
}
