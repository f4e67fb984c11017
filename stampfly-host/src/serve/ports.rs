//! The open ports of one vehicle: a thread a socket, one queue of bounded length to the flight.
//!
//! Datagrams that come while the queue is full are lost, as in a socket's own buffer; streams wait.
//! The flight takes a bounded number in a tick, so a flood costs datagrams and no time. What has
//! waited for it for more than a second, it is told to be late.

use super::age::Looks;
use super::connections::{Connections, Door, Ended};
use super::events::{self, Event, Events, POLL, Waiting};
use super::key::Key;
use super::option::PortOption;
use super::terminal;
use stampfly_ground::FRESH;
use stampfly_sim::vehicle::{Client, Guard, Heard, PortSpec, Ports, Signing, Transport};
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
    /// Others could reach it, and its language has no room for a key.
    Loopback,
    /// The key is asked for everywhere, and its language has no room for one.
    Unsigned,
}

impl fmt::Display for OpenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, address, why } = self;
        write!(f, "port '{name}' at {address}: ")?;
        match why {
            Why::Failed(error) => {
                write!(f, "{error}; '--port {name}=NUMBER' chooses another, '--port {name}=off' none")
            }
            Why::NoKey => write!(
                f,
                "programs on other machines reach it and can command the vehicle there, so they must know a key; \
                 '--key FILE' names it, '--port {name}=NUMBER' leaves the port on this machine"
            ),
            Why::Loopback => write!(
                f,
                "programs on other machines would reach it and could command the vehicle there, and its language has no \
                 room for a key; '--port {name}=NUMBER' leaves the port on this machine"
            ),
            Why::Unsigned => {
                write!(f, "stays closed: its language has no room for the key that '--sign-all' asks for everywhere")
            }
        }
    }
}

impl std::error::Error for OpenError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &self.why {
            Why::Failed(error) => Some(error),
            Why::NoKey | Why::Loopback | Why::Unsigned => None,
        }
    }
}

/// A page in browsers, at the other end of a port of [`Transport::Page`].
pub trait Page: Send + Sync {
    /// What was said since the last call, and by whom.
    fn take(&self) -> Vec<(SocketAddr, Vec<u8>)>;

    /// Answers.
    fn deliver(&self, to: SocketAddr, bytes: &[u8]);

    /// Pages that are gone since the last call.
    fn gone(&self) -> Vec<SocketAddr>;

    /// Tells every page.
    fn tell(&self, text: &str);

    /// Tells every page who commands.
    fn tell_commander(&self, who: &str, page: Option<u32>);
}

/// The open ports of one vehicle.
pub struct OpenPorts {
    events: Events,
    heard: Mutex<Receiver<Waiting>>,
    /// Sockets of datagrams by port.
    sockets: Vec<Option<UdpSocket>>,
    connections: Arc<Connections>,
    page: Option<(usize, Box<dyn Page>)>,
    places: Vec<(&'static PortSpec, SocketAddr)>,
    missed: Vec<OpenError>,
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
    /// Opens those of the `number`-th vehicle, from zero, where the options want them. At ports
    /// that others can reach, and with a [key for everywhere](Key::everywhere) at all, commands
    /// need the key.
    ///
    /// # Errors
    /// When one that is named in the options cannot be opened, or must not: others could command
    /// the vehicle there without a key. One that is not named is [missed](Self::missed) when
    /// another program has it.
    pub fn open(
        ports: &'static [PortSpec],
        options: &[PortOption],
        number: usize,
        key: Option<Key>,
    ) -> Result<Self, OpenError> {
        let (events, heard) = events::queue();
        let mut opened = Self {
            heard: Mutex::new(heard),
            sockets: Vec::new(),
            connections: Arc::default(),
            page: None,
            places: Vec::new(),
            missed: Vec::new(),
            terminals: Vec::new(),
            key,
            specs: ports,
            events,
        };
        for (port, spec) in ports.iter().enumerate() {
            let is_named = options.iter().any(|option| option.name == spec.name);
            let socket = match PortOption::place(options, spec, number).filter(|_| opened.is_of_use(spec, is_named)) {
                None => None,
                Some(address) => {
                    opened.may_open(spec, address).map_err(|why| OpenError { name: spec.name, address, why })?;
                    if opened.is_without_the_key(spec) {
                        opened.missed.push(OpenError { name: spec.name, address, why: Why::Unsigned });
                        opened.sockets.push(None);
                        continue;
                    }
                    match opened.open_one(port, spec, address) {
                        Ok(socket) => socket,
                        Err(error) => {
                            let error = OpenError { name: spec.name, address, why: Why::Failed(error) };
                            if is_named {
                                return Err(error);
                            }
                            opened.missed.push(error);
                            None
                        }
                    }
                }
            };
            opened.sockets.push(socket);
        }
        Ok(opened)
    }

    /// Is there anything to be said at this port?
    fn is_of_use(&self, spec: &PortSpec, is_named: bool) -> bool {
        // A named port is always tried, so that its failure is reported.
        (*spec != PortSpec::SEALED || self.key.is_some())
            && (is_named || !spec.when_named)
            && (is_named || !self.is_without_the_key(spec))
            && (is_named || spec.transport != Transport::Terminal || terminal::EXIST)
    }

    fn may_open(&self, spec: &PortSpec, address: SocketAddr) -> Result<(), Why> {
        let is_public = !address.ip().is_loopback() && spec.transport != Transport::Terminal;
        match spec.guard {
            Guard::Loopback if is_public => Err(Why::Loopback),
            Guard::Key | Guard::Secret if is_public && self.key.is_none() => Err(Why::NoKey),
            _ => Ok(()),
        }
    }

    /// Is the key asked for everywhere, and can this port not ask for it? A pseudo-terminal belongs
    /// to the account that has made it.
    fn is_without_the_key(&self, spec: &PortSpec) -> bool {
        let has_room = spec.guard != Guard::Loopback || spec.transport == Transport::Terminal;
        !has_room && self.key.as_ref().is_some_and(Key::is_everywhere)
    }

    /// Does what is said at this port count only when it is signed with the key?
    fn asks_for_key(&self, spec: &PortSpec, address: SocketAddr) -> bool {
        let is_asked = |key: &Key| key.is_everywhere() || !address.ip().is_loopback();
        spec.guard == Guard::Key && self.key.as_ref().is_some_and(is_asked)
    }

    /// Opens this one. Returns its socket, if it is one of datagrams.
    fn open_one(
        &mut self,
        port: usize,
        spec: &'static PortSpec,
        address: SocketAddr,
    ) -> std::io::Result<Option<UdpSocket>> {
        let (connections, events) = (Arc::clone(&self.connections), self.events.clone());
        let socket = match spec.transport {
            Transport::Udp => Some(UdpSocket::bind(address)?),
            Transport::UdpTo => {
                let from = if address.ip().is_loopback() { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED };
                let socket = UdpSocket::bind((from, 0))?;
                events.offer(Client { port, address }, Heard::Opened, Instant::now());
                Some(socket)
            }
            Transport::Tcp => {
                let listener = TcpListener::bind(address)?;
                self.places.push((spec, listener.local_addr()?));
                let door = Door { port, spec, asks_for_key: self.asks_for_key(spec, address) };
                std::thread::spawn(move || connections.accept(door, &listener, &events));
                return Ok(None);
            }
            Transport::Terminal => {
                let name = terminal::open(Client { port, address }, &connections, &events)?;
                self.terminals.push((spec, name));
                return Ok(None);
            }
            // Served for all vehicles together.
            Transport::Page => None,
        };
        if let Some(socket) = &socket {
            let socket = socket.try_clone()?;
            socket.set_read_timeout(Some(POLL))?;
            std::thread::spawn(move || receive(port, &socket, &events));
        }
        let place = match (spec.transport, &socket) {
            (Transport::Udp, Some(socket)) => socket.local_addr()?,
            _ => address,
        };
        self.places.push((spec, place));
        Ok(socket)
    }

    /// Those that another program has, or the system refuses. They were not asked for by name.
    #[must_use]
    pub fn missed(&self) -> &[OpenError] {
        &self.missed
    }

    /// Calls this for every connection that is ended because it does not speak its port's language.
    pub fn tell(&self, told: impl Fn(Ended) + Send + Sync + 'static) {
        self.connections.tell(Box::new(told));
    }

    /// Connections that were ended because they do not speak the language of their port.
    #[must_use]
    pub fn ended(&self) -> u64 {
        self.connections.ended()
    }

    /// Where each port is that is open.
    #[must_use]
    pub fn places(&self) -> &[(&'static PortSpec, SocketAddr)] {
        &self.places
    }

    /// What the page's address ends with, where others could open it otherwise.
    #[must_use]
    pub fn page_secret(&self) -> Option<String> {
        let (_, address) = self.places.iter().find(|(spec, _)| spec.transport == Transport::Page)?;
        let key = self.key.as_ref().filter(|key| key.is_everywhere() || !address.ip().is_loopback())?;
        Some(key.page_secret())
    }

    /// The name of each port that is a pseudo-terminal.
    #[must_use]
    pub fn terminals(&self) -> &[(&'static PortSpec, String)] {
        &self.terminals
    }

    /// The vehicle was restarted and has no clients: every open connection is announced to it
    /// again.
    pub fn reopen(&self) {
        let targets = self.places.iter().filter(|(spec, _)| spec.transport == Transport::UdpTo);
        let targets = targets.filter_map(|(spec, address)| {
            let port = self.specs.iter().position(|other| other.name == spec.name)?;
            Some(Client { port, address: *address })
        });
        targets
            .chain(self.connections.all())
            .for_each(|client| self.events.offer(client, Heard::Opened, Instant::now()));
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
    let (mut buffer, mut looks) = ([0; LONGEST], Looks::begin(Instant::now()));
    let mut patience = POLL;
    while events.are_open() {
        if patience != looks.patience() && socket.set_read_timeout(Some(looks.patience())).is_ok() {
            patience = looks.patience();
        }
        match socket.recv_from(&mut buffer) {
            Ok((length, address)) => {
                let since = looks.found(Instant::now());
                events.offer(Client { port, address }, Heard::Bytes(buffer.get(..length).unwrap_or_default()), since);
            }
            // The time is over, or an answer found its receiver gone.
            Err(error) => looks.failed(Instant::now(), &error),
        }
    }
}

impl Ports for OpenPorts {
    fn receive(&self, until: Option<Instant>, hear: &mut dyn FnMut(Client, Heard<'_>)) {
        if let Some((port, page)) = &self.page {
            for (address, bytes) in page.take() {
                hear(Client { port: *port, address }, Heard::Bytes(&bytes));
            }
            for address in page.gone() {
                hear(Client { port: *port, address }, Heard::Closed);
            }
        }
        let heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        for _ in 0..HEARD {
            let next = match until {
                Some(until) => heard.recv_timeout(until.saturating_duration_since(Instant::now())).ok(),
                None => heard.try_recv().ok(),
            };
            let Some((client, event, since)) = next else { return };
            match &event {
                Event::Opened => hear(client, Heard::Opened),
                Event::Bytes(bytes) if since.elapsed() > FRESH => hear(client, Heard::Late(bytes)),
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

    fn believe(&self, client: &Client) {
        self.connections.show(client);
    }

    fn tell(&self, text: &str) {
        if let Some((_, page)) = &self.page {
            page.tell(text);
        }
    }

    fn tell_commander(&self, who: &str, number: Option<u32>) {
        if let Some((_, page)) = &self.page {
            page.tell_commander(who, number);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_that_another_program_has_is_missed_unless_it_is_named() {
        let taken = UdpSocket::bind("127.0.0.1:0").expect("a port");
        let number = taken.local_addr().expect("an address").port();
        let ports: &[_] = Box::leak(Box::new([PortSpec::udp("taken", number, ""), PortSpec::udp("free", 0, "")]));
        let opened = OpenPorts::open(ports, &[], 0, None).expect("it flies without");
        assert_eq!((opened.missed().len(), opened.places().len()), (1, 1));
        assert!(opened.missed()[0].to_string().contains("'taken'"));
        let named = [format!("taken={number}").parse().expect("an option")];
        assert!(OpenPorts::open(ports, &named, 0, None).is_err());
    }

    #[test]
    fn a_port_that_is_for_when_it_is_wanted_is_closed_until_it_is_named() {
        let ports: &[_] = Box::leak(Box::new([PortSpec { when_named: true, ..PortSpec::udp("wanted", 0, "") }]));
        assert_eq!(OpenPorts::open(ports, &[], 0, None).expect("open").places().len(), 0);
        let named = ["wanted=0".parse().expect("an option")];
        assert_eq!(OpenPorts::open(ports, &named, 0, None).expect("open").places().len(), 1);
    }
}
