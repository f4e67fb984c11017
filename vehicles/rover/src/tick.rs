//! The tick: how often the software components run, and by how much time a model advances in one.
//!
//! The table of [`schedule`](crate::schedule) begins its chain as often; that is checked there.

use stampfly_types::Duration;

/// The document's period, and the time step of the models.
pub const TICK: Duration = Duration::from_millis(10);
