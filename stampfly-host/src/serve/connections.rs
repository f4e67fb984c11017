//! The programs that are connected to TCP ports: one thread reads, one writes, and a queue of bounded length between the flight
//! and the writer, so that nobody who reads slowly can hold up a flight.

use super::events::{Events, POLL};
use crate::waited::has_only_waited;
use stampfly_sim::vehicle::{Client, Heard};
use std::collections::HashMap;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

/// Most connections to one port.
const MOST: usize = 16;
/// Answers that may wait for a connection to take them.
const WAITING: usize = 256;
/// Bytes read at once.
const PART: usize = 2048;

/// The queue of every connection.
#[derive(Debug, Default)]
pub(super) struct Connections(Mutex<HashMap<Client, Queue>>);

/// What waits for one to take it.
#[derive(Debug)]
struct Queue {
    bytes: SyncSender<Vec<u8>>,
    /// Is what finds no room lost? A serial line stays, whoever reads there.
    stays: bool,
}

impl Connections {
    /// Sends to one. A connection whose queue is full is closed: it has not read for a long time. A serial line loses what nobody reads.
    pub fn send(&self, to: &Client, bytes: &[u8]) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if all.get(to).is_some_and(|queue| queue.bytes.try_send(bytes.to_vec()).is_err() && !queue.stays) {
            all.remove(to);
        }
    }

    /// One that is no TCP connection: what is sent to it waits in this queue.
    #[cfg(unix)]
    pub fn join(&self, client: Client) -> Receiver<Vec<u8>> {
        let (queue, waiting) = sync_channel(WAITING);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(client, Queue { bytes: queue, stays: true });
        waiting
    }

    /// Takes connections until the ports are closed.
    pub fn accept(self: &Arc<Self>, port: usize, listener: &TcpListener, events: &Events) {
        if listener.set_nonblocking(true).is_err() {
            return;
        }
        while events.are_open() {
            match listener.accept() {
                Ok((stream, address)) => self.begin(Client { port, address }, stream, events),
                Err(_) => std::thread::sleep(POLL / 5),
            }
        }
    }

    fn begin(self: &Arc<Self>, client: Client, stream: TcpStream, events: &Events) {
        let (queue, waiting) = sync_channel(WAITING);
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let prepared = stream
            .set_nonblocking(false)
            .and_then(|()| stream.set_nodelay(true))
            .and_then(|()| stream.set_read_timeout(Some(POLL)))
            .and_then(|()| stream.set_write_timeout(Some(20 * POLL)))
            .and_then(|()| stream.try_clone());
        let at_port = all.keys().filter(|other| other.port == client.port).count();
        // One that is refused sees its connection closed.
        let Some(writer) = prepared.ok().filter(|_| at_port < MOST) else { return };
        all.insert(client, Queue { bytes: queue, stays: false });
        drop(all);
        let (connections, events) = (Arc::clone(self), events.clone());
        std::thread::spawn(move || write(writer, &waiting));
        std::thread::spawn(move || {
            events.put(client, Heard::Opened);
            read(stream, client, &connections, &events);
            connections.0.lock().unwrap_or_else(PoisonError::into_inner).remove(&client);
            events.put(client, Heard::Closed);
        });
    }

    /// Who is connected.
    pub fn all(&self) -> Vec<Client> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).keys().copied().collect()
    }

    fn has(&self, client: &Client) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).contains_key(client)
    }
}

fn read(mut stream: TcpStream, client: Client, connections: &Connections, events: &Events) {
    let mut part = [0; PART];
    while events.are_open() && connections.has(&client) {
        match stream.read(&mut part) {
            Ok(0) => break,
            // Waits while the flight has much to hear: the sender is held up, not the flight.
            Ok(length) => events.put(client, Heard::Bytes(part.get(..length).unwrap_or_default())),
            Err(error) if has_only_waited(&error) => {}
            Err(_) => break,
        }
    }
    _ = stream.shutdown(Shutdown::Both);
}

/// Ends when the queue's other end is gone and everything in it is written, or the program takes no more.
fn write(mut stream: TcpStream, waiting: &Receiver<Vec<u8>>) {
    while let Ok(bytes) = waiting.recv() {
        if stream.write_all(&bytes).is_err() {
            break;
        }
    }
    _ = stream.shutdown(Shutdown::Both);
}
