//! What a PC asks of a vehicle, and whom the vehicle sends to because of it.

use stampfly_types::{Duration, Instant};

/// A PC that has not been heard for so long has gone.
const SILENCE: Duration = Duration::from_secs(5);

/// What a PC asks, in one byte.
///
/// ```
/// use stampfly_link::stream::StreamRequest;
/// assert_eq!(StreamRequest::decode(&[0xF2]), Some(StreamRequest::Heartbeat));
/// assert_eq!(StreamRequest::decode(&[0xF2, 0]), None);
/// assert_eq!(StreamRequest::Start.to_bytes(), [0xF0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StreamRequest {
    /// Send to me.
    Start,
    /// Send no more.
    Stop,
    /// I am still here.
    Heartbeat,
}

impl StreamRequest {
    /// Reads it: `None` when it is none.
    #[must_use]
    pub const fn decode(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0xF0] => Some(Self::Start),
            [0xF1] => Some(Self::Stop),
            [0xF2] => Some(Self::Heartbeat),
            _ => None,
        }
    }

    /// Writes it.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; 1] {
        match self {
            Self::Start => [0xF0],
            Self::Stop => [0xF1],
            Self::Heartbeat => [0xF2],
        }
    }
}

/// Whom the vehicle sends to: the last that asked for it, until it stops or has been silent for five seconds. `A` is the address of a PC.
///
/// Only the one that is sent to can stop the stream or keep it going.
///
/// ```
/// use stampfly_link::stream::{StreamRequest, StreamSink};
/// use stampfly_types::Instant;
/// let mut sink = StreamSink::new();
/// sink.take(Instant::ZERO, "pc", StreamRequest::Start);
/// sink.take(Instant::from_secs(4), "other", StreamRequest::Stop);
/// assert_eq!(sink.address(Instant::from_micros(4_999_999)), Some("pc"));
/// assert_eq!(sink.address(Instant::from_secs(5)), None);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StreamSink<A> {
    sink: Option<(A, Instant)>,
}

impl<A> Default for StreamSink<A> {
    fn default() -> Self {
        Self { sink: None }
    }
}

impl<A: Copy + PartialEq> StreamSink<A> {
    /// Nobody has asked.
    #[must_use]
    pub const fn new() -> Self {
        Self { sink: None }
    }

    /// Takes what was asked, `at` the instant it came in.
    pub fn take(&mut self, at: Instant, from: A, request: StreamRequest) {
        let present = self.address(at) == Some(from);
        match request {
            StreamRequest::Start => self.sink = Some((from, at)),
            StreamRequest::Heartbeat if present => self.sink = Some((from, at)),
            StreamRequest::Stop if present => self.sink = None,
            StreamRequest::Heartbeat | StreamRequest::Stop => {}
        }
    }

    /// Whom to send to now.
    #[must_use]
    pub fn address(&self, now: Instant) -> Option<A> {
        self.sink.filter(|(_, heard)| now.since(*heard) < SILENCE).map(|(address, _)| address)
    }
}
