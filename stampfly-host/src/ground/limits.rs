//! Bounds on what a client may cost the server of the page. The defaults are for people; tests take
//! shorter times.

use std::time::Duration;

/// What a client may cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Requests at a time that are not answered yet. One more ends the oldest: a client that says
    /// half a request does not keep a person out.
    pub requests: usize,
    /// WebSockets at a time.
    pub sockets: usize,
    /// Logs on their way at a time.
    pub logs: usize,
    /// Time for the head of a request.
    pub head: Duration,
    /// Longest time in which a client takes nothing of what it is sent.
    pub stall: Duration,
    /// Slowest way of a log, bytes a second; after that a client is cut off.
    pub slowest: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            requests: 16,
            sockets: 32,
            logs: 8,
            head: Duration::from_secs(5),
            stall: Duration::from_secs(5),
            slowest: 50_000,
        }
    }
}
