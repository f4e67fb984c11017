//! A network stack of fixed size on an Ethernet-like device: DHCP, two ports of datagrams, one stream. The crate `smoltcp`, with its memory and its work bounded.
//!
//! | socket | waits in, bytes | out |
//! |---|---|---|
//! | MAVLink, UDP | [`DATAGRAMS`] | [`DATAGRAMS_OUT`] |
//! | MAVLink, TCP, one connection | [`STREAM`] | [`STREAM_OUT`] |
//! | sealed frames, UDP | [`SEALED`] | [`SEALED_OUT`] |
//!
//! What finds no room is lost and counted. IPv4 without fragments, because everything that is said here fits into one frame. Not for whoever has an operating
//! system: its sockets are better.

use super::ends::{Client, Ends, Heard, MAVLINK_TCP, MAVLINK_UDP, SEALED_UDP};
use core::net::{Ipv4Addr, SocketAddrV4};
use heapless::Vec;
use smoltcp::iface::{Config, Interface, PollIngressSingleResult, PollResult, SocketHandle, SocketSet, SocketStorage};
use smoltcp::phy::Device;
use smoltcp::socket::{dhcpv4, tcp, udp};
use smoltcp::wire::{EthernetAddress, HardwareAddress, IpAddress, IpCidr, IpEndpoint, Ipv4Cidr};
use stampfly_types::{Duration, Instant};

/// Bytes of datagrams of MAVLink that have come. A burst of a list that a station asks for.
pub const DATAGRAMS: usize = 1024;
/// And that are to go: what a turn of 20 ms makes for two clients.
pub const DATAGRAMS_OUT: usize = 1536;
/// Bytes of the stream that have come: the window that its sender is told.
pub const STREAM: usize = 512;
/// And that are to go.
pub const STREAM_OUT: usize = 1536;
/// Bytes of sealed frames that have come: four of the longest.
pub const SEALED: usize = 1024;
/// And that are to go: six of the longest.
pub const SEALED_OUT: usize = 1536;
/// Datagrams that wait in each direction of a socket.
const WAITING: usize = 8;
/// MAVLink's frames for one client leave together in a datagram of at most this many bytes.
const TOGETHER: usize = 512;
/// Packets taken from the device in one turn. More wait there, or are lost there.
const AT_ONCE: usize = 8;
/// Rounds of sending in one turn: each socket sends one packet a round.
const ROUNDS: usize = 4;
/// A stream that has taken nothing for this long although there was something to send has nobody who reads.
const STUCK: Duration = Duration::from_secs(5);
/// A stream whose other end does not answer is dead after this many seconds, and asked whether it lives after a third of it.
const DEAD: u64 = 15;

/// Memory for packets. Lives as long as its stack; in a static, for instance.
pub struct Memory {
    sockets: [SocketStorage<'static>; 4],
    datagrams: ([udp::PacketMetadata; WAITING], [u8; DATAGRAMS]),
    datagrams_out: ([udp::PacketMetadata; WAITING], [u8; DATAGRAMS_OUT]),
    stream: ([u8; STREAM], [u8; STREAM_OUT]),
    sealed: ([udp::PacketMetadata; WAITING], [u8; SEALED]),
    sealed_out: ([udp::PacketMetadata; WAITING], [u8; SEALED_OUT]),
}

impl Memory {
    /// Nothing in it.
    #[must_use]
    pub const fn new() -> Self {
        const NONE: [udp::PacketMetadata; WAITING] = [udp::PacketMetadata::EMPTY; WAITING];
        Self {
            sockets: [SocketStorage::EMPTY; 4],
            datagrams: (NONE, [0; DATAGRAMS]),
            datagrams_out: (NONE, [0; DATAGRAMS_OUT]),
            stream: ([0; STREAM], [0; STREAM_OUT]),
            sealed: (NONE, [0; SEALED]),
            sealed_out: (NONE, [0; SEALED_OUT]),
        }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// What was lost since the beginning. Each wraps around.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lost {
    /// Frames of MAVLink for which there was no room.
    pub frames: u32,
    /// Sealed frames for which there was no room.
    pub sealed: u32,
    /// Streams that were ended because nobody read.
    pub stuck: u32,
}

/// The stack. Call [`poll`](Self::poll) about a hundred times a second.
pub struct Stack {
    interface: Interface,
    sockets: SocketSet<'static>,
    dhcp: SocketHandle,
    datagrams: SocketHandle,
    stream: SocketHandle,
    sealed: SocketHandle,
    is_up: bool,
    now: Instant,
    /// Who has the stream.
    connected: Option<SocketAddrV4>,
    /// Since when it has taken nothing.
    stuck: Option<Instant>,
    /// What leaves together, and for whom.
    together: (Option<SocketAddrV4>, Vec<u8, TOGETHER>),
    lost: Lost,
}

const fn instant(now: Instant) -> smoltcp::time::Instant {
    smoltcp::time::Instant::from_micros_const(now.as_micros() as i64)
}

const fn place(endpoint: IpEndpoint) -> Option<SocketAddrV4> {
    match endpoint.addr {
        IpAddress::Ipv4(address) => Some(SocketAddrV4::new(address, endpoint.port)),
        // With a feature of `smoltcp` that somebody else asks for, there is another version.
        #[allow(unreachable_patterns)]
        _ => None,
    }
}

impl Stack {
    /// A stack without an address yet. `seed` are random bits: they make the numbers of connections and leases, which strangers must not guess.
    pub fn new(
        memory: &'static mut Memory,
        device: &mut impl Device,
        hardware: [u8; 6],
        seed: u64,
        now: Instant,
    ) -> Self {
        let mut config = Config::new(HardwareAddress::Ethernet(EthernetAddress(hardware)));
        config.random_seed = seed;
        let interface = Interface::new(config, device, instant(now));
        let Memory { sockets, datagrams, datagrams_out, stream, sealed, sealed_out } = memory;
        let mut sockets = SocketSet::new(&mut sockets[..]);
        let dhcp = sockets.add(dhcpv4::Socket::new());
        let socket =
            |(metadata, bytes): (&'static mut [udp::PacketMetadata], &'static mut [u8]),
             (metadata_out, bytes_out): (&'static mut [udp::PacketMetadata], &'static mut [u8])| {
                let socket = udp::PacketBuffer::new(metadata, bytes);
                udp::Socket::new(socket, udp::PacketBuffer::new(metadata_out, bytes_out))
            };
        let datagrams =
            sockets.add(socket((&mut datagrams.0, &mut datagrams.1), (&mut datagrams_out.0, &mut datagrams_out.1)));
        let sealed = sockets.add(socket((&mut sealed.0, &mut sealed.1), (&mut sealed_out.0, &mut sealed_out.1)));
        let mut tcp =
            tcp::Socket::new(tcp::SocketBuffer::new(&mut stream.0[..]), tcp::SocketBuffer::new(&mut stream.1[..]));
        tcp.set_nagle_enabled(false);
        tcp.set_timeout(Some(smoltcp::time::Duration::from_secs(DEAD)));
        tcp.set_keep_alive(Some(smoltcp::time::Duration::from_secs(DEAD / 3)));
        let stream = sockets.add(tcp);
        Self {
            interface,
            sockets,
            dhcp,
            datagrams,
            stream,
            sealed,
            is_up: false,
            now,
            connected: None,
            stuck: None,
            together: (None, Vec::new()),
            lost: Lost::default(),
        }
    }

    /// The vehicle's address, as soon as it has one.
    #[must_use]
    pub fn address(&self) -> Option<Ipv4Addr> {
        self.interface.ipv4_addr()
    }

    /// What was lost.
    #[must_use]
    pub const fn lost(&self) -> Lost {
        self.lost
    }

    /// Takes packets from the device and gives it others, a bounded number. `is_up` says whether the device is connected to a network: the address belongs to it.
    pub fn poll(&mut self, now: Instant, device: &mut impl Device, is_up: bool) {
        self.now = now;
        if core::mem::replace(&mut self.is_up, is_up) != is_up {
            self.begin_again();
        }
        if !is_up {
            return;
        }
        self.flush();
        let at = instant(now);
        let Self { interface, sockets, .. } = self;
        for _ in 0..AT_ONCE {
            if matches!(interface.poll_ingress_single(at, device, sockets), PollIngressSingleResult::None) {
                break;
            }
        }
        for _ in 0..ROUNDS {
            if matches!(interface.poll_egress(at, device, sockets), PollResult::None) {
                break;
            }
        }
        self.configure();
        self.listen();
    }

    /// Another network, or none: nothing of the one before is true.
    fn begin_again(&mut self) {
        self.unconfigure();
        self.sockets.get_mut::<dhcpv4::Socket<'_>>(self.dhcp).reset();
        self.sockets.get_mut::<tcp::Socket<'_>>(self.stream).abort();
        for handle in [self.datagrams, self.sealed] {
            // What waits in them, too.
            self.sockets.get_mut::<udp::Socket<'_>>(handle).close();
        }
        self.together.1.clear();
    }

    fn unconfigure(&mut self) {
        self.interface.update_ip_addrs(|all| all.clear());
        self.interface.routes_mut().remove_default_ipv4_route();
    }

    /// Does what the network's DHCP server says.
    fn configure(&mut self) {
        let configured = match self.sockets.get_mut::<dhcpv4::Socket<'_>>(self.dhcp).poll() {
            None => return,
            Some(dhcpv4::Event::Deconfigured) => None,
            Some(dhcpv4::Event::Configured(config)) => Some((config.address, config.router)),
        };
        match configured {
            None => self.unconfigure(),
            Some((address, router)) => self.set_address(address, router),
        }
    }

    fn set_address(&mut self, address: Ipv4Cidr, router: Option<Ipv4Addr>) {
        self.unconfigure();
        self.interface.update_ip_addrs(|all| _ = all.push(IpCidr::Ipv4(address)));
        if let Some(router) = router {
            // There is room for two.
            _ = self.interface.routes_mut().add_default_ipv4_route(router);
        }
    }

    /// Every port that is not open is opened.
    fn listen(&mut self) {
        for (handle, port) in [(self.datagrams, MAVLINK_UDP), (self.sealed, SEALED_UDP)] {
            let socket = self.sockets.get_mut::<udp::Socket<'_>>(handle);
            if !socket.is_open() {
                _ = socket.bind(port);
            }
        }
        let socket = self.sockets.get_mut::<tcp::Socket<'_>>(self.stream);
        if self.connected.is_none() && !socket.is_open() {
            _ = socket.listen(MAVLINK_TCP);
        }
    }

    /// Sends what waits to leave together.
    fn flush(&mut self) {
        let (to, bytes) = &mut self.together;
        let Some(to) = to.filter(|_| !bytes.is_empty()) else { return };
        let socket = self.sockets.get_mut::<udp::Socket<'_>>(self.datagrams);
        if socket.send_slice(bytes, IpEndpoint::from(to)).is_err() {
            self.lost.frames = self.lost.frames.wrapping_add(1);
        }
        bytes.clear();
    }

    fn send_stream(&mut self, frame: &[u8]) {
        let socket = self.sockets.get_mut::<tcp::Socket<'_>>(self.stream);
        if !socket.is_active() {
            return;
        }
        let room = socket.send_capacity().saturating_sub(socket.send_queue());
        if socket.may_send() && room >= frame.len() && socket.send_slice(frame).is_ok() {
            self.stuck = None;
            return;
        }
        self.lost.frames = self.lost.frames.wrapping_add(1);
        let since = *self.stuck.get_or_insert(self.now);
        if self.now.since(since) >= STUCK {
            socket.abort();
            self.lost.stuck = self.lost.stuck.wrapping_add(1);
        }
    }
}

impl Ends for Stack {
    fn hear(&mut self, hear: &mut dyn FnMut(Client, Heard<'_>)) {
        let socket = self.sockets.get_mut::<udp::Socket<'_>>(self.datagrams);
        while let Ok((bytes, from)) = socket.recv() {
            if let Some(from) = place(from.endpoint) {
                hear(Client::Datagrams(from), Heard::Bytes(bytes));
            }
        }
        let socket = self.sockets.get_mut::<tcp::Socket<'_>>(self.stream);
        if self.connected.is_none()
            && socket.may_send()
            && let Some(from) = socket.remote_endpoint().and_then(place)
        {
            (self.connected, self.stuck) = (Some(from), None);
            hear(Client::Stream(from), Heard::Opened);
        }
        let Some(from) = self.connected else { return };
        if socket.can_recv() {
            // All there is now: what wraps around in the buffer comes with the next call.
            _ = socket.recv(|bytes| {
                hear(Client::Stream(from), Heard::Bytes(bytes));
                (bytes.len(), ())
            });
        } else if !socket.may_recv() {
            // The other end says no more: so does the vehicle.
            socket.abort();
        }
        if !socket.is_active() {
            self.connected = None;
            hear(Client::Stream(from), Heard::Closed);
        }
    }

    fn send(&mut self, to: Client, frame: &[u8]) {
        match to {
            Client::Stream(to) if self.connected == Some(to) => self.send_stream(frame),
            Client::Stream(_) => {}
            Client::Datagrams(to) => {
                if self.together.0 != Some(to) || self.together.1.len() + frame.len() > TOGETHER {
                    self.flush();
                    self.together.0 = Some(to);
                }
                if self.together.1.extend_from_slice(frame).is_err() {
                    self.lost.frames = self.lost.frames.wrapping_add(1);
                }
            }
        }
    }

    fn close(&mut self, client: Client) {
        if let Client::Stream(place) = client
            && self.connected == Some(place)
        {
            self.sockets.get_mut::<tcp::Socket<'_>>(self.stream).abort();
        }
    }

    fn hear_sealed<'r>(&mut self, room: &'r mut [u8]) -> Option<(SocketAddrV4, &'r mut [u8])> {
        let socket = self.sockets.get_mut::<udp::Socket<'_>>(self.sealed);
        // One that is too long is taken out all the same.
        for _ in 0..WAITING {
            let (bytes, from) = socket.recv().ok()?;
            if let (Some(from), Some(_)) = (place(from.endpoint), room.get(..bytes.len())) {
                let length = bytes.len();
                room.iter_mut().zip(bytes).for_each(|(to, byte)| *to = *byte);
                return Some((from, room.get_mut(..length)?));
            }
        }
        None
    }

    fn send_sealed(&mut self, to: SocketAddrV4, frame: &[u8]) {
        let socket = self.sockets.get_mut::<udp::Socket<'_>>(self.sealed);
        if socket.send_slice(frame, IpEndpoint::from(to)).is_err() {
            self.lost.sealed = self.lost.sealed.wrapping_add(1);
        }
    }
}
