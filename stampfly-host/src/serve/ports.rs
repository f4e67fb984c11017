//! The open ports of one vehicle: a thread a socket, one queue of bounded length to the flight.
//!
//! Datagrams that come while the queue is full are lost, as in a socket's own buffer; streams wait. The flight takes a bounded
//! number in a tick, so a flood costs datagrams and no time.

use super::connections::Connections;
use super::events::{self, Event, Events, POLL};
use super::key::Key;
use super::option::PortOption;
use super::terminal;
use stampfly_sim::vehicle::{Client, Heard, PortSpec, Ports, Signing, Transport};
use std::fmt;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, UdpSocket};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Heard in one tick.
const HEARD: usize = 256;
/// Longest datagram, bytes: the most that goes through a network in one frame, with room.
const LONGEST: usize = 2048;

/// A port cannot be opened.
#[derive(Debug)]
pub struct OpenError {
    name: &'static str,
    address: SocketAddr,
    why: Why,
}

#[derive(Debug)]
enum Why {
    Failed(std::io::Error),
    /// Others could reach it, and there is no key.
    NoKey,
}

impl fmt::Display for OpenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, address, why } = self;
        match why {
            Why::Failed(error) => write!(
                f,
                "port '{name}' at {address}: {error}; '--port {name}=NUMBER' chooses another, '--port {name}=off' none"
            ),
            Why::NoKey => write!(
                f,
                "port '{name}' at {address}: others than programs on this machine reach it, so what is said there must be \
                 signed; '--key FILE' names the key, '--port {name}=NUMBER' leaves the port on this machine"
            ),
        }
    }
}

impl std::error::Error for OpenError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &self.why {
            Why::Failed(error) => Some(error),
            Why::NoKey => None,
        }
    }
}

/// A page in browsers, at the other end of a port of [`Transport::Page`].
pub trait Page: Send + Sync {
    /// What was said since the last call, and by whom.
    fn take(&self) -> Vec<(SocketAddr, Vec<u8>)>;

    /// Answers.
    fn deliver(&self, to: SocketAddr, bytes: &[u8]);
}

/// The open ports of one vehicle.
pub struct OpenPorts {
    events: Events,
    heard: Mutex<Receiver<(Client, Event)>>,
    /// Sockets of datagrams by port.
    sockets: Vec<Option<UdpSocket>>,
    connections: Arc<Connections>,
    page: Option<(usize, Box<dyn Page>)>,
    places: Vec<(&'static PortSpec, SocketAddr)>,
    terminals: Vec<(&'static PortSpec, String)>,
    key: Option<Key>,
    specs: &'static [PortSpec],
}

impl fmt::Debug for OpenPorts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OpenPorts").field("places", &self.places).finish_non_exhaustive()
    }
}

impl OpenPorts {
    /// Opens those of the `number`-th vehicle, from zero, where the options want them. What is said at ports that others can reach is signed with the key.
    ///
    /// # Errors
    /// When one cannot be opened: another program has it, or it must be signed and there is no key.
    pub fn open(
        ports: &'static [PortSpec],
        options: &[PortOption],
        number: usize,
        key: Option<Key>,
    ) -> Result<Self, OpenError> {
        let (events, heard) = events::queue();
        let connections = Arc::new(Connections::default());
        let mut opened = Self {
            heard: Mutex::new(heard),
            sockets: Vec::new(),
            connections: Arc::clone(&connections),
            page: None,
            places: Vec::new(),
            terminals: Vec::new(),
            key,
            specs: ports,
            events: events.clone(),
        };
        for (port, spec) in ports.iter().enumerate() {
            let mut socket = None;
            // Without a key nobody can say anything there.
            let is_of_use = *spec != PortSpec::SEALED || opened.key.is_some();
            // Where there are no pseudo-terminals, only one that is asked for by its name is an
            // error.
            let is_of_use = is_of_use
                && (spec.transport != Transport::Terminal
                    || terminal::EXIST
                    || options.iter().any(|option| option.name == spec.name));
            if let Some(address) = PortOption::place(options, spec, number).filter(|_| is_of_use) {
                let failed = |error| OpenError { name: spec.name, address, why: Why::Failed(error) };
                if spec.signed && !address.ip().is_loopback() && opened.key.is_none() {
                    return Err(OpenError { name: spec.name, address, why: Why::NoKey });
                }
                let place = match spec.transport {
                    Transport::Udp => {
                        socket = Some(UdpSocket::bind(address).map_err(failed)?);
                        socket.as_ref().map_or(Ok(address), UdpSocket::local_addr).map_err(failed)?
                    }
                    Transport::UdpTo => {
                        let from = if address.ip().is_loopback() { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED };
                        socket = Some(UdpSocket::bind((from, 0)).map_err(failed)?);
                        events.offer(Client { port, address }, Heard::Opened);
                        address
                    }
                    Transport::Tcp => {
                        let listener = TcpListener::bind(address).map_err(failed)?;
                        let place = listener.local_addr().map_err(failed)?;
                        let (connections, events) = (Arc::clone(&connections), events.clone());
                        std::thread::spawn(move || connections.accept(port, &listener, &events));
                        place
                    }
                    Transport::Terminal => {
                        let name = terminal::open(Client { port, address }, &connections, &events).map_err(failed)?;
                        opened.terminals.push((spec, name));
                        opened.sockets.push(None);
                        continue;
                    }
                    // Served for all vehicles together.
                    Transport::Page => address,
                };
                if let Some(socket) = &socket {
                    let (socket, events) = (socket.try_clone().map_err(failed)?, events.clone());
                    socket.set_read_timeout(Some(POLL)).map_err(failed)?;
                    std::thread::spawn(move || receive(port, &socket, &events));
                }
                opened.places.push((spec, place));
            }
            opened.sockets.push(socket);
        }
        Ok(opened)
    }

    /// Where each port is that is open.
    #[must_use]
    pub fn places(&self) -> &[(&'static PortSpec, SocketAddr)] {
        &self.places
    }

    /// The name of each port that is a pseudo-terminal.
    #[must_use]
    pub fn terminals(&self) -> &[(&'static PortSpec, String)] {
        &self.terminals
    }

    /// The vehicle was restarted, and knows nobody: it is told again who is connected.
    pub fn reopen(&self) {
        let targets = self.places.iter().filter(|(spec, _)| spec.transport == Transport::UdpTo);
        let targets = targets.filter_map(|(spec, address)| {
            let port = self.specs.iter().position(|other| other.name == spec.name)?;
            Some(Client { port, address: *address })
        });
        targets.chain(self.connections.all()).for_each(|client| self.events.offer(client, Heard::Opened));
    }

    /// Asks for the end of the flight.
    pub fn close(&self) {
        self.events.close();
    }

    /// Connects a page. Nothing happens when the vehicle has no port for one, or it is off.
    #[must_use]
    pub fn with_page(mut self, page: impl Page + 'static) -> Self {
        let port = self.specs.iter().position(|port| port.transport == Transport::Page);
        self.page = port.map(|port| (port, Box::new(page) as Box<dyn Page>));
        self
    }
}

impl Drop for OpenPorts {
    fn drop(&mut self) {
        self.events.close();
    }
}

fn receive(port: usize, socket: &UdpSocket, events: &Events) {
    let mut buffer = [0; LONGEST];
    while events.are_open() {
        // An error says that the time is over, or that an answer found its receiver gone.
        if let Ok((length, address)) = socket.recv_from(&mut buffer) {
            events.offer(Client { port, address }, Heard::Bytes(buffer.get(..length).unwrap_or_default()));
        }
    }
}

impl Ports for OpenPorts {
    fn receive(&self, until: Option<Instant>, hear: &mut dyn FnMut(Client, Heard<'_>)) {
        if let Some((port, page)) = &self.page {
            for (address, bytes) in page.take() {
                hear(Client { port: *port, address }, Heard::Bytes(&bytes));
            }
        }
        let heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        for _ in 0..HEARD {
            let next = match until {
                Some(until) => heard.recv_timeout(until.saturating_duration_since(Instant::now())).ok(),
                None => heard.try_recv().ok(),
            };
            let Some((client, event)) = next else { return };
            match &event {
                Event::Opened => hear(client, Heard::Opened),
                Event::Bytes(bytes) => hear(client, Heard::Bytes(bytes)),
                Event::Closed => hear(client, Heard::Closed),
            }
        }
    }

    fn send(&self, to: &Client, bytes: &[u8]) {
        if let Some(socket) = self.sockets.get(to.port).and_then(Option::as_ref) {
            // An answer that cannot be sent is lost, as on any network.
            _ = socket.send_to(bytes, to.address);
        } else if let Some((_, page)) = self.page.as_ref().filter(|(port, _)| *port == to.port) {
            page.deliver(to.address, bytes);
        } else {
            self.connections.send(to, bytes);
        }
    }

    fn is_local(&self, port: usize) -> bool {
        let name = self.specs.get(port).map(|spec| spec.name);
        let place = self.places.iter().find(|(spec, _)| Some(spec.name) == name);
        let everywhere = self.key.as_ref().is_some_and(Key::is_everywhere);
        place.is_none_or(|(_, address)| address.ip().is_loopback() && !everywhere)
    }

    fn signing(&self) -> Option<Signing> {
        self.key.as_ref().map(Key::signing)
    }

    fn are_closed(&self) -> bool {
        !self.events.are_open()
    }
}
