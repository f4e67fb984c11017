//! Bounds on what a client may cost the server of the page. The defaults are for people; tests take shorter times.

use std::time::Duration;

/// What a client may cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Connections at a time.
    pub connections: usize,
    /// Time for the head of a request.
    pub head: Duration,
    /// Longest time in which a client takes nothing of what it is sent.
    pub stall: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self { connections: 16, head: Duration::from_secs(5), stall: Duration::from_secs(5) }
    }
}
