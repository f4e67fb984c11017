//! What sockets hear, on its way to the flight: one queue of bounded length.

use stampfly_sim::vehicle::{Client, Heard};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// How soon a thread notices that the ports are closed.
pub(super) const POLL: Duration = Duration::from_millis(100);
/// What may wait for the flight.
const WAITS: usize = 1024;

/// What was heard, on its way to the flight.
#[derive(Debug)]
pub(super) enum Event {
    Opened,
    Bytes(Vec<u8>),
    Closed,
}

/// An event, of whom, and since when it may have waited.
pub(super) type Waiting = (Client, Event, Instant);

/// The sockets' end of the queue to the flight.
#[derive(Clone, Debug)]
pub(super) struct Events {
    queue: SyncSender<Waiting>,
    open: Arc<AtomicBool>,
}

impl Events {
    pub fn are_open(&self) -> bool {
        self.open.load(Ordering::Relaxed)
    }

    /// The flight is over: every thread ends soon.
    pub fn close(&self) {
        self.open.store(false, Ordering::Relaxed);
    }

    /// Waits for room. Nothing happens when the flight is over.
    pub fn put(&self, client: Client, heard: Heard<'_>, since: Instant) {
        _ = self.queue.send((client, event(heard), since));
    }

    /// Drops it when there is no room.
    pub fn offer(&self, client: Client, heard: Heard<'_>, since: Instant) {
        _ = self.queue.try_send((client, event(heard), since));
    }
}

fn event(heard: Heard<'_>) -> Event {
    match heard {
        Heard::Opened => Event::Opened,
        Heard::Bytes(bytes) | Heard::Late(bytes) => Event::Bytes(bytes.to_vec()),
        Heard::Closed => Event::Closed,
    }
}

/// Both ends.
pub(super) fn queue() -> (Events, Receiver<Waiting>) {
    let (queue, heard) = sync_channel(WAITS);
    (Events { queue, open: Arc::new(AtomicBool::new(true)) }, heard)
}
