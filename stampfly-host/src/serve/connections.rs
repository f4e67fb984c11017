//! The programs that are connected to TCP ports: one thread reads, one writes, and an outbox of
//! bounded size between the flight and the writer, so that a program that reads slowly does not
//! hold up a flight.

use super::age::Looks;
use super::events::{Events, POLL};
use super::greeting::{Foreign, Greeting};
use super::outbox::{Outbox, Waiting};
use crate::waited::has_only_waited;
use stampfly_sim::vehicle::{Client, Heard, PortSpec};
use std::collections::HashMap;
use std::fmt;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

/// Most connections to one port.
const MOST: usize = 16;
/// Bytes that may wait for a connection to take them: what a vehicle says in half a minute, which a
/// line that was held up for so long brings at once.
const WAITING: usize = 256 * 1024;
/// Bytes that may wait for a serial line: a program that begins to read wants no old ones.
#[cfg(unix)]
const WAITING_LINE: usize = 16 * 1024;
/// Bytes read at once.
const PART: usize = 2048;

/// A connection was ended because it does not speak the language of its port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Name of the port.
    pub port: &'static str,
    /// What it speaks instead.
    pub speaks: Foreign,
    /// How many were ended at the ports of this vehicle, with this one.
    pub count: u64,
}

impl fmt::Display for Ended {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { port, speaks, count } = self;
        write!(f, "port '{port}': a connection that speaks {speaks} was ended, and nothing of it obeyed")?;
        if *speaks == Foreign::Http {
            f.write_str("; a page in a browser may try to fly the vehicle")?;
        }
        if *count > 1 { write!(f, " ({count} so far)") } else { Ok(()) }
    }
}

/// Hears of connections that were ended.
type Told = Box<dyn Fn(Ended) + Send + Sync>;

/// A port that takes connections.
#[derive(Clone, Copy, Debug)]
pub(super) struct Door {
    /// Its place among the vehicle's.
    pub port: usize,
    pub spec: &'static PortSpec,
    /// Does only what is signed with the key count there?
    pub asks_for_key: bool,
}

/// The queue of every connection.
#[derive(Default)]
pub(super) struct Connections {
    queues: Mutex<HashMap<Client, Queue>>,
    /// Connections that have come, and that were ended.
    begun: AtomicU64,
    ended: AtomicU64,
    told: OnceLock<Told>,
}

/// What waits for one to take it.
#[derive(Debug)]
struct Queue {
    bytes: Outbox,
    /// Connections are numbered in the order in which they opened.
    number: u64,
    /// Its bytes have been frames of the port's protocol; at a port that requires the key, signed
    /// with it.
    is_shown: bool,
    /// Is what finds no room lost? A serial line stays, whether or not a program reads there.
    stays: bool,
}

impl Connections {
    fn queues(&self) -> MutexGuard<'_, HashMap<Client, Queue>> {
        self.queues.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// From now on this hears of connections that are ended.
    pub fn tell(&self, told: Told) {
        _ = self.told.set(told);
    }

    /// Connections that were ended because they do not speak the language of their port.
    pub fn ended(&self) -> u64 {
        self.ended.load(Ordering::Relaxed)
    }

    fn end(&self, port: &'static str, speaks: Foreign) {
        let count = self.ended.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(told) = self.told.get() {
            told(Ended { port, speaks, count });
        }
    }

    /// Sends to one. A connection whose queue is full is closed: it has not read for a long time. A
    /// serial line loses what no program reads.
    pub fn send(&self, to: &Client, bytes: &[u8]) {
        let mut all = self.queues();
        if all.get(to).is_some_and(|queue| !queue.bytes.put(bytes) && !queue.stays) {
            all.remove(to);
        }
    }

    /// One that is no TCP connection: what is sent to it waits in this queue.
    #[cfg(unix)]
    pub fn join(&self, client: Client) -> Waiting {
        let (queue, waiting) = Outbox::new(WAITING_LINE);
        self.queues().insert(client, Queue { bytes: queue, number: 0, is_shown: true, stays: true });
        waiting
    }

    /// Takes connections until the ports are closed.
    pub fn accept(self: &Arc<Self>, door: Door, listener: &TcpListener, events: &Events) {
        if listener.set_nonblocking(true).is_err() {
            return;
        }
        while events.are_open() {
            match listener.accept() {
                Ok((stream, address)) => self.begin(Client { port: door.port, address }, door, stream, events),
                Err(_) => std::thread::sleep(POLL / 5),
            }
        }
    }

    fn begin(self: &Arc<Self>, client: Client, door: Door, stream: TcpStream, events: &Events) {
        let (queue, waiting) = Outbox::new(WAITING);
        let mut all = self.queues();
        let prepared = stream
            .set_nonblocking(false)
            .and_then(|()| stream.set_nodelay(true))
            .and_then(|()| stream.set_read_timeout(Some(POLL)))
            .and_then(|()| stream.set_write_timeout(Some(20 * POLL)))
            .and_then(|()| stream.try_clone());
        // One that is refused sees its connection closed.
        let Some(writer) = prepared.ok().filter(|_| has_room(&mut all, client.port)) else { return };
        let number = self.begun.fetch_add(1, Ordering::Relaxed);
        all.insert(client, Queue { bytes: queue, number, is_shown: false, stays: false });
        drop(all);
        let (connections, events) = (Arc::clone(self), events.clone());
        std::thread::spawn(move || write(writer, &waiting));
        std::thread::spawn(move || {
            events.put(client, Heard::Opened, Instant::now());
            if let Err(speaks) = read(stream, client, door, &connections, &events) {
                connections.end(door.spec.name, speaks);
            }
            connections.queues().remove(&client);
            events.put(client, Heard::Closed, Instant::now());
        });
    }

    /// Who is connected.
    pub fn all(&self) -> Vec<Client> {
        self.queues().keys().copied().collect()
    }

    /// This one speaks the language of its port, and has its key where that is asked for.
    pub fn show(&self, client: &Client) {
        if let Some(queue) = self.queues().get_mut(client) {
            queue.is_shown = true;
        }
    }

    fn has(&self, client: &Client) -> bool {
        self.queues().contains_key(client)
    }
}

/// Is there room for another connection to this port? Of too many, the oldest that has shown
/// nothing makes room: who only listens may, but keeps no program out. Where the key is asked for,
/// so does who speaks without it.
fn has_room(all: &mut HashMap<Client, Queue>, port: usize) -> bool {
    let at_port = all.iter().filter(|(client, _)| client.port == port);
    if at_port.clone().count() < MOST {
        return true;
    }
    let silent = at_port.filter(|(_, queue)| !queue.is_shown).min_by_key(|(_, queue)| queue.number);
    let oldest = silent.map(|(client, _)| *client);
    oldest.is_some_and(|client| all.remove(&client).is_some())
}

/// Reads until the connection is over.
///
/// # Errors
/// When it does not speak the language of its port.
fn read(
    mut stream: TcpStream,
    client: Client,
    door: Door,
    connections: &Connections,
    events: &Events,
) -> Result<(), Foreign> {
    let (mut part, mut greeting) = ([0; PART], Greeting::new(door.spec.speech));
    // Where the key is asked for, the vehicle tells who has it.
    let (mut heard, mut is_shown) = (Ok(()), door.asks_for_key);
    let (mut looks, mut patience) = (Looks::begin(Instant::now()), POLL);
    while heard.is_ok() && events.are_open() && connections.has(&client) {
        if patience != looks.patience() && stream.set_read_timeout(Some(looks.patience())).is_ok() {
            patience = looks.patience();
        }
        match stream.read(&mut part) {
            Ok(0) => break,
            Ok(length) => {
                let since = looks.found(Instant::now());
                heard = greeting.hear(part.get(..length).unwrap_or_default()).map(|bytes| {
                    if greeting.is_shown() && !core::mem::replace(&mut is_shown, true) {
                        connections.show(&client);
                    }
                    // Waits while the flight has much to hear: the sender is held up, not the
                    // flight.
                    if !bytes.is_empty() {
                        events.put(client, Heard::Bytes(&bytes), since);
                    }
                });
            }
            Err(error) if has_only_waited(&error) => looks.failed(Instant::now(), &error),
            Err(_) => break,
        }
    }
    _ = stream.shutdown(Shutdown::Both);
    heard
}

/// Ends when the queue's other end is gone and everything in it is written, or the program takes no
/// more.
fn write(mut stream: TcpStream, waiting: &Waiting) {
    while let Some(bytes) = waiting.next() {
        if stream.write_all(&bytes).is_err() {
            break;
        }
    }
    _ = stream.shutdown(Shutdown::Both);
}
