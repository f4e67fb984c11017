//! A network of one cable: the vehicle's stack at one end, a computer at the other, whose own stack hands out addresses.

use smoltcp::iface::{Config, Interface, SocketHandle, SocketSet};
use smoltcp::phy::{Device, DeviceCapabilities, Medium, RxToken, TxToken};
use smoltcp::socket::{tcp, udp};
use smoltcp::wire::{
    DhcpMessageType, DhcpPacket, DhcpRepr, EthernetAddress, HardwareAddress, IpCidr, IpEndpoint, Ipv4Address,
};
use stampfly_types::Instant;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

pub const VEHICLE: Ipv4Address = Ipv4Address::new(192, 0, 2, 7);
const COMPUTER: Ipv4Address = Ipv4Address::new(192, 0, 2, 1);
/// Packets that a radio keeps before it loses some.
const KEPT: usize = 32;

type Queue = Rc<RefCell<VecDeque<Vec<u8>>>>;

/// One end of the cable.
#[derive(Clone)]
pub struct End {
    come: Queue,
    go: Queue,
}

pub fn cable() -> (End, End) {
    let (one, two) = (Queue::default(), Queue::default());
    (End { come: one.clone(), go: two.clone() }, End { come: two, go: one })
}

pub struct In(Vec<u8>);
pub struct Out(Queue);

impl RxToken for In {
    fn consume<R, F: FnOnce(&[u8]) -> R>(self, take: F) -> R {
        take(&self.0)
    }
}

impl TxToken for Out {
    fn consume<R, F: FnOnce(&mut [u8]) -> R>(self, length: usize, fill: F) -> R {
        let mut packet = vec![0; length];
        let filled = fill(&mut packet);
        let mut queue = self.0.borrow_mut();
        if queue.len() < KEPT {
            queue.push_back(packet);
        }
        filled
    }
}

impl Device for End {
    type RxToken<'a> = In;
    type TxToken<'a> = Out;

    fn receive(&mut self, _: smoltcp::time::Instant) -> Option<(In, Out)> {
        let packet = self.come.borrow_mut().pop_front()?;
        Some((In(packet), Out(self.go.clone())))
    }

    fn transmit(&mut self, _: smoltcp::time::Instant) -> Option<Out> {
        Some(Out(self.go.clone()))
    }

    fn capabilities(&self) -> DeviceCapabilities {
        let mut capabilities = DeviceCapabilities::default();
        capabilities.max_transmission_unit = 700;
        capabilities.medium = Medium::Ethernet;
        capabilities
    }
}

/// Whoever is at the other end.
pub struct Computer {
    end: End,
    interface: Interface,
    sockets: SocketSet<'static>,
    addresses: SocketHandle,
    ports: u16,
}

fn at(now: Instant) -> smoltcp::time::Instant {
    smoltcp::time::Instant::from_micros(now.as_micros() as i64)
}

fn datagrams() -> udp::Socket<'static> {
    let room = || udp::PacketBuffer::new(vec![udp::PacketMetadata::EMPTY; 64], vec![0; 16 * 1024]);
    udp::Socket::new(room(), room())
}

impl Computer {
    pub fn new(mut end: End) -> Self {
        let hardware = HardwareAddress::Ethernet(EthernetAddress([2, 0, 0, 0, 0, 1]));
        let mut interface = Interface::new(Config::new(hardware), &mut end, at(Instant::ZERO));
        interface.update_ip_addrs(|all| all.push(IpCidr::new(COMPUTER.into(), 24)).expect("room"));
        let mut sockets = SocketSet::new(Vec::new());
        let addresses = sockets.add(datagrams());
        sockets.get_mut::<udp::Socket<'_>>(addresses).bind(67).expect("free");
        Self { end, interface, sockets, addresses, ports: 40_000 }
    }

    pub fn poll(&mut self, now: Instant) {
        let Self { end, interface, sockets, .. } = self;
        interface.poll(at(now), end, sockets);
        self.hand_out();
        let Self { end, interface, sockets, .. } = self;
        interface.poll(at(now), end, sockets);
    }

    /// Every question for an address has the same answer.
    fn hand_out(&mut self) {
        let socket = self.sockets.get_mut::<udp::Socket<'_>>(self.addresses);
        while let Some(bytes) = socket.recv().ok().map(|(bytes, _)| bytes.to_vec()) {
            let packet = DhcpPacket::new_checked(&bytes[..]).expect("whole");
            let asked = DhcpRepr::parse(&packet).expect("a question");
            let message_type = match asked.message_type {
                DhcpMessageType::Discover => DhcpMessageType::Offer,
                _ => DhcpMessageType::Ack,
            };
            let answer = DhcpRepr {
                message_type,
                your_ip: VEHICLE,
                server_ip: COMPUTER,
                router: Some(COMPUTER),
                subnet_mask: Some(Ipv4Address::new(255, 255, 255, 0)),
                server_identifier: Some(COMPUTER),
                client_identifier: None,
                parameter_request_list: None,
                requested_ip: None,
                lease_duration: Some(3_600),
                broadcast: true,
                ..asked
            };
            let mut packet = vec![0; answer.buffer_len()];
            answer.emit(&mut DhcpPacket::new_unchecked(&mut packet)).expect("room");
            socket.send_slice(&packet, IpEndpoint::new(Ipv4Address::BROADCAST.into(), 68)).expect("room");
        }
    }

    /// A socket of datagrams at a port of its own.
    pub fn open(&mut self) -> SocketHandle {
        let handle = self.sockets.add(datagrams());
        self.rebind(handle);
        handle
    }

    /// Gives it another port, as if it were somebody else.
    pub fn rebind(&mut self, handle: SocketHandle) {
        self.ports = if self.ports == 60_000 { 40_000 } else { self.ports + 1 };
        let socket = self.sockets.get_mut::<udp::Socket<'_>>(handle);
        socket.close();
        socket.bind(self.ports).expect("free");
    }

    pub fn send(&mut self, handle: SocketHandle, port: u16, bytes: &[u8]) {
        let socket = self.sockets.get_mut::<udp::Socket<'_>>(handle);
        // What the cable does not take is lost.
        _ = socket.send_slice(bytes, IpEndpoint::new(VEHICLE.into(), port));
    }

    pub fn receive(&mut self, handle: SocketHandle) -> Option<Vec<u8>> {
        self.sockets.get_mut::<udp::Socket<'_>>(handle).recv().ok().map(|(bytes, _)| bytes.to_vec())
    }

    /// A connection.
    pub fn connect(&mut self, port: u16) -> SocketHandle {
        self.ports += 1;
        let room = || tcp::SocketBuffer::new(vec![0; 4096]);
        let handle = self.sockets.add(tcp::Socket::new(room(), room()));
        let socket = self.sockets.get_mut::<tcp::Socket<'_>>(handle);
        socket
            .connect(self.interface.context(), IpEndpoint::new(VEHICLE.into(), port), self.ports)
            .expect("a connection");
        handle
    }

    pub fn stream(&mut self, handle: SocketHandle) -> &mut tcp::Socket<'static> {
        self.sockets.get_mut(handle)
    }

    pub fn read(&mut self, handle: SocketHandle) -> Vec<u8> {
        let mut read = Vec::new();
        let socket = self.stream(handle);
        while socket.can_recv() {
            read.extend(socket.recv(|bytes| (bytes.len(), bytes.to_vec())).expect("open"));
        }
        read
    }
}
