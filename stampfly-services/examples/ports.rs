//! A vehicle's ports on this computer's sockets: `cargo run -p stampfly-services --features mavlink --example ports -- 10`.
//!
//! The loop is the firmware's, [`Ports`]; only [`Ends`] are others. It says where they are, and serves for so many seconds; without a number, for none.

use stampfly_link::mavlink::dialects::common::MavType;
use stampfly_link::secure::Key;
use stampfly_param::{ParameterError, ParameterInfo, Parameters};
use stampfly_services::mavlink::Identity;
use stampfly_services::network::{Client, Ends, Heard, Ports};
use stampfly_services::{Connection, Places, Refusal, Requester, Samples, VehicleAccess, View};
use stampfly_types::Instant;
use stampfly_types::messages::{GuidedCommand, PilotInput};
use std::cell::RefCell;
use std::error::Error;
use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, TcpListener, TcpStream, UdpSocket};
use std::time::Duration;

/// What `mavlink_ports.py` is given. Not a secret: it is good for this vehicle.
const KEY: [u8; 32] = {
    let (mut key, mut place) = ([0; 32], 0);
    while place < key.len() {
        key[place] = place as u8;
        place += 1;
    }
    key
};
/// What was reserved before a restart, in units of 10 µs since 2015: a time in the year 2040, ahead of every station's clock.
const EPOCH: u64 = 25 * 365 * 86_400 * 100_000;

/// A vehicle that does nothing, with one parameter.
#[derive(Default)]
struct Vehicle {
    gain: f32,
    places: Places,
    commands: usize,
    connections: Connection,
}

struct Nothing;

impl Samples for Nothing {
    fn words(&self, _: usize) -> Option<(Instant, &[u32])> {
        None
    }
}

impl Parameters for Vehicle {
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
        (index == 0).then_some(ParameterInfo {
            name: "rate.roll.kp",
            unit: "1",
            min: 0.0,
            max: 1.0,
            meaning: "",
            in_flight: true,
        })
    }

    fn get(&self, index: usize) -> Option<f32> {
        (index == 0).then_some(self.gain)
    }

    fn set(&mut self, _: usize, value: f32) -> Result<(), ParameterError> {
        self.gain = value;
        Ok(())
    }

    fn check(&self, _: Option<usize>) -> Result<(), ParameterError> {
        Ok(())
    }
}

impl VehicleAccess for Vehicle {
    fn view(&self) -> View<'_> {
        View::new(&Nothing, &self.places)
    }

    fn guide(&mut self, _: Instant, _: Requester, _: GuidedCommand) -> Result<(), Refusal> {
        self.commands += 1;
        Ok(())
    }

    fn connection(&mut self) -> Connection {
        self.connections += 1;
        self.connections
    }

    fn leave(&mut self, _: &dyn Fn(Requester) -> bool) {}

    fn steer(&mut self, _: Instant, _: Requester, _: &PilotInput) -> Result<(), Refusal> {
        Ok(())
    }

    fn alive(&mut self, _: Instant, _: Requester) {}

    fn parameters(&mut self) -> &mut dyn Parameters {
        self
    }
}

/// Sockets of this computer.
struct Sockets {
    datagrams: UdpSocket,
    sealed: UdpSocket,
    listener: TcpListener,
    stream: RefCell<Option<(SocketAddrV4, TcpStream)>>,
}

const fn v4(address: SocketAddr) -> Option<SocketAddrV4> {
    match address {
        SocketAddr::V4(address) => Some(address),
        SocketAddr::V6(_) => None,
    }
}

impl Sockets {
    fn open() -> std::io::Result<Self> {
        let here = (Ipv4Addr::LOCALHOST, 0);
        let (datagrams, sealed, listener) = (UdpSocket::bind(here)?, UdpSocket::bind(here)?, TcpListener::bind(here)?);
        datagrams.set_nonblocking(true)?;
        sealed.set_nonblocking(true)?;
        listener.set_nonblocking(true)?;
        println!("mavlink-udp {}", datagrams.local_addr()?);
        println!("sealed-udp {}", sealed.local_addr()?);
        println!("mavlink-tcp {}", listener.local_addr()?);
        Ok(Self { datagrams, sealed, listener, stream: RefCell::new(None) })
    }
}

impl Ends for Sockets {
    fn hear(&mut self, hear: &mut dyn FnMut(Client, Heard<'_>)) {
        let mut room = [0; 2048];
        while let Ok((length, from)) = self.datagrams.recv_from(&mut room) {
            if let (Some(from), Some(bytes)) = (v4(from), room.get(..length)) {
                hear(Client::Datagrams(from), Heard::Bytes(bytes));
            }
        }
        let mut stream = self.stream.borrow_mut();
        // There is one stream: whoever comes second sees its connection closed.
        while let Ok((next, SocketAddr::V4(from))) = self.listener.accept() {
            if stream.is_none() && next.set_nonblocking(true).is_ok() {
                *stream = Some((from, next));
                hear(Client::Stream(from), Heard::Opened);
            }
        }
        if let Some((from, open)) = stream.as_mut() {
            let client = Client::Stream(*from);
            match open.read(&mut room) {
                Ok(length) if length > 0 => hear(client, Heard::Bytes(room.get(..length).unwrap_or_default())),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                _ => {
                    *stream = None;
                    hear(client, Heard::Closed);
                }
            }
        }
    }

    fn send(&mut self, to: Client, frame: &[u8]) {
        // What is not taken is lost.
        match to {
            Client::Datagrams(to) => _ = self.datagrams.send_to(frame, to),
            Client::Stream(to) => {
                if let Some((_, open)) = self.stream.borrow_mut().as_mut().filter(|(at, _)| *at == to) {
                    _ = open.write_all(frame);
                }
            }
        }
    }

    fn close(&mut self, client: Client) {
        if let Some((from, open)) = self.stream.borrow().as_ref()
            && client == Client::Stream(*from)
        {
            // The next reading says that it is over.
            _ = open.shutdown(std::net::Shutdown::Both);
        }
    }

    fn hear_sealed<'r>(&mut self, room: &'r mut [u8]) -> Option<(SocketAddrV4, &'r mut [u8])> {
        let (length, from) = self.sealed.recv_from(room).ok()?;
        Some((v4(from)?, room.get_mut(..length)?))
    }

    fn send_sealed(&mut self, to: SocketAddrV4, frame: &[u8]) {
        _ = self.sealed.send_to(frame, to);
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let seconds: u64 = std::env::args().nth(1).map_or(Ok(0), |text| text.parse())?;
    let identity = Identity {
        system: 1,
        kind: MavType::MAV_TYPE_QUADROTOR,
        take_off_height: 0.5,
        reach: 0.25,
        version: [1, 0, 0],
    };
    let key = Key::generate(1, KEY)?;
    println!("phrase {}", key.phrase());
    let mut ports = Ports::<16>::new(identity, &key, EPOCH);
    let (mut sockets, mut vehicle) = (Sockets::open()?, Vehicle { gain: 0.25, ..Vehicle::default() });
    let start = std::time::Instant::now();
    while start.elapsed() < Duration::from_secs(seconds) {
        let now = Instant::from_micros(start.elapsed().as_micros() as u64);
        ports.turn(now, &mut sockets, &mut vehicle);
        std::thread::sleep(Duration::from_millis(10));
    }
    println!("{} frames were not signed with the key, {} commands", ports.untrusted(), vehicle.commands);
    Ok(())
}
