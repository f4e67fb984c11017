//! Relays between programs that hold up what passes through them, and then let all of it pass: a
//! network that is gone for a moment.

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

const LOOK: Duration = Duration::from_millis(2);
/// Datagrams that a network keeps each way: sockets have no room for more at once.
const KEPT: usize = 100;

/// Holds up what passes, or lets it pass.
pub trait Held: Send {
    fn hold(&self, holds: bool);
}

/// What the threads of a relay share.
#[derive(Clone, Default)]
struct Gate(Arc<[AtomicBool; 2]>);

impl Gate {
    fn holds(&self) -> bool {
        self.0[0].load(Ordering::Relaxed) && !self.is_over()
    }

    fn is_over(&self) -> bool {
        self.0[1].load(Ordering::Relaxed)
    }
}

/// Between two ends of a stream.
pub struct Stream {
    gate: Gate,
    place: String,
    /// Another, which holds nothing up.
    beside: Option<Box<Stream>>,
}

impl Stream {
    /// Listens, and connects every connection to that place.
    pub fn to(far: &str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let place = listener.local_addr().expect("an address").to_string();
        let (gate, far) = (Gate::default(), far.to_owned());
        let of_thread = gate.clone();
        thread::spawn(move || {
            while let Ok((near, _)) = listener.accept() {
                let Ok(far) = TcpStream::connect(&far) else { continue };
                for (mut from, mut to) in [(copy(&near), copy(&far)), (copy(&far), copy(&near))] {
                    let gate = of_thread.clone();
                    thread::spawn(move || {
                        carry(&gate, &mut from, &mut to);
                        _ = to.shutdown(Shutdown::Both);
                    });
                }
            }
        });
        Self { gate, place, beside: None }
    }

    /// The end of a pseudo-terminal, whose name is returned, is connected to that place.
    #[cfg(unix)]
    pub fn at_a_terminal(far: &str) -> (Self, String) {
        use serialport::{SerialPort, TTYPort};
        let (mut near, terminal) = TTYPort::pair().expect("a pseudo-terminal");
        let name = terminal.name().expect("its name");
        near.set_timeout(Duration::from_millis(50)).expect("a timeout");
        let far = TcpStream::connect(far).expect("the port listens");
        let (gate, mut back) = (Gate::default(), near.try_clone_native().expect("a handle"));
        let (there, here) = (gate.clone(), gate.clone());
        let (mut to, mut from) = (copy(&far), far);
        thread::spawn(move || {
            carry(&there, &mut near, &mut to);
            // It stays open: a program that opens it comes and goes.
            drop(terminal);
        });
        thread::spawn(move || carry(&here, &mut from, &mut back));
        (Self { gate, place: name.clone(), beside: None }, name)
    }

    /// Where it listens.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// The same, which keeps another that holds nothing up.
    pub fn beside(mut self, other: Self) -> Self {
        self.beside = Some(Box::new(other));
        self
    }
}

impl Held for Stream {
    fn hold(&self, holds: bool) {
        self.gate.0[0].store(holds, Ordering::Relaxed);
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        self.gate.0[1].store(true, Ordering::Relaxed);
    }
}

fn copy(stream: &TcpStream) -> TcpStream {
    stream.try_clone().expect("a handle")
}

fn carry(gate: &Gate, from: &mut dyn Read, to: &mut dyn Write) {
    let mut part = [0; 4096];
    while !gate.is_over() {
        let length = match from.read(&mut part) {
            Ok(0) => return,
            Ok(length) => length,
            Err(error) if error.kind() == std::io::ErrorKind::TimedOut => continue,
            Err(_) => return,
        };
        while gate.holds() {
            thread::sleep(LOOK);
        }
        if to.write_all(&part[..length]).is_err() {
            return;
        }
    }
}

/// Between two ends of datagrams.
pub struct Datagrams {
    gate: Gate,
    place: SocketAddr,
}

impl Datagrams {
    /// To a vehicle that listens there.
    pub fn to(vehicle: &str) -> Self {
        let far = UdpSocket::bind("127.0.0.1:0").expect("a port");
        far.connect(vehicle).expect("an address");
        Self::between(far)
    }

    /// Before a program, whose end is returned, and which a vehicle sends to.
    pub fn before_a_program() -> (Self, UdpSocket) {
        let [far, program] = [(), ()].map(|()| UdpSocket::bind("127.0.0.1:0").expect("a port"));
        far.connect(program.local_addr().expect("an address")).expect("an address");
        program.connect(far.local_addr().expect("an address")).expect("an address");
        (Self::between(far), program)
    }

    fn between(far: UdpSocket) -> Self {
        let near = UdpSocket::bind("127.0.0.1:0").expect("a port");
        let relay = Self { gate: Gate::default(), place: near.local_addr().expect("an address") };
        let gate = relay.gate.clone();
        near.set_nonblocking(true).and_then(|()| far.set_nonblocking(true)).expect("sockets");
        thread::spawn(move || {
            let (mut peer, mut room) = (None, [0; 2048]);
            let mut ways = [VecDeque::new(), VecDeque::new()];
            while !gate.is_over() {
                while let Ok((length, from)) = near.recv_from(&mut room) {
                    peer = Some(from);
                    keep(&mut ways[0], &room[..length]);
                }
                while let Ok(length) = far.recv(&mut room) {
                    keep(&mut ways[1], &room[..length]);
                }
                if !gate.holds() {
                    let [away, back] = &mut ways;
                    away.drain(..).for_each(|bytes| _ = far.send(&bytes));
                    if let Some(peer) = peer {
                        back.drain(..).for_each(|bytes| _ = near.send_to(&bytes, peer));
                    }
                }
                thread::sleep(LOOK);
            }
        });
        relay
    }

    /// Where it listens.
    pub fn place(&self) -> SocketAddr {
        self.place
    }
}

fn keep(way: &mut VecDeque<Vec<u8>>, bytes: &[u8]) {
    if way.len() >= KEPT {
        way.pop_front();
    }
    way.push_back(bytes.to_vec());
}

impl Held for Datagrams {
    fn hold(&self, holds: bool) {
        self.gate.0[0].store(holds, Ordering::Relaxed);
    }
}

impl Drop for Datagrams {
    fn drop(&mut self) {
        self.gate.0[1].store(true, Ordering::Relaxed);
    }
}
