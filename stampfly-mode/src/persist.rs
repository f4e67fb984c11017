//! "For at least so long": the one debouncer of this crate.

use stampfly_types::Micros;

/// Remembers since when a condition has held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Persist {
    since: Option<Micros>,
}

impl Persist {
    /// Has the condition held for at least `span`, this instant included?
    pub(crate) fn holds(&mut self, now: Micros, condition: bool, span: Micros) -> bool {
        if !condition {
            self.since = None;
            return false;
        }
        now.since(*self.since.get_or_insert(now)) >= span
    }

    /// Starts over.
    pub(crate) fn reset(&mut self) {
        self.since = None;
    }
}
