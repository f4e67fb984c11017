//! A line of an activation table as data: which runnable, what activates it, where it runs and how long it may take.
//!
//! [`schedule!`](crate::schedule!) writes the lines; the scheduler, the proof of response times and listings read them.
//! What holds the runnables themselves is a [`Schedule`](crate::Schedule).

use stampfly_types::Duration;

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

impl Trigger {
    /// The line that it follows.
    #[inline]
    pub(crate) const fn before(self) -> Option<usize> {
        if let Self::After(before) = self { Some(before) } else { None }
    }
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
