//! What is spoken at a vehicle's ports: the loop between [`Ends`], MAVLink and the secure link.
//!
//! | port | who is answered |
//! |---|---|
//! | UDP [`MAVLINK_UDP`](super::MAVLINK_UDP), TCP [`MAVLINK_TCP`](super::MAVLINK_TCP) | whoever signs with the vehicle's key |
//! | UDP [`SEALED_UDP`](super::SEALED_UDP) | a station that seals with it; an empty datagram asks for an offer of a session |
//!
//! Whoever connects to the stream is told the vehicle's state, signed, so that a station can take over the vehicle's time; it has to sign within
//! [ten seconds](UNSIGNED), for there is one stream. Parameters are in MAVLink and in sealed frames. There is no command line but in
//! sealed frames: a terminal cannot sign.

use super::ends::{Client, Ends, Heard};
use super::routes::Routes;
use crate::access::VehicleAccess;
use crate::mavlink::{Identity, Mavlink};
use core::net::SocketAddrV4;
use stampfly_link::Address;
use stampfly_link::mavlink::signing::SigningKey;
use stampfly_link::secure::{Key, MAX_FRAME, MIN_FRAME};
use stampfly_types::{Duration, Instant};

/// Clients of MAVLink at once: one of the stream, one of datagrams.
pub const CLIENTS: usize = 2;
/// Between two turns of MAVLink's streams.
const PERIOD: Duration = Duration::from_millis(20);
/// Whoever has the stream and has not signed anything for this long loses it.
pub const UNSIGNED: Duration = Duration::from_secs(10);
/// Sealed frames that are looked at in one turn.
const SEALED_AT_ONCE: usize = 4;

/// The secure link, as a network sees it.
pub trait Door {
    /// Where the newest authentic frame came from.
    fn station(&self) -> Option<Address>;

    /// Takes a sealed frame. What is refused is counted there.
    fn take(&mut self, now: Instant, source: Address, frame: &mut [u8]);

    /// The offer of a session that is in force, for a sender that asks for it. `None` when there is none.
    fn offer<'r>(&self, room: &'r mut [u8; MAX_FRAME]) -> Option<&'r [u8]>;
}

/// What is spoken at the ports.
///
/// `examples/ports.rs` has it on a computer's sockets, `tests/services/network` on a [`Stack`](super::Stack).
#[derive(Clone, Debug)]
pub struct Ports<const ITEMS: usize> {
    mavlink: Mavlink<Client, CLIENTS, ITEMS>,
    next: Instant,
    /// Who has the stream, and since when.
    stream: Option<(Client, Instant)>,
}

impl<const ITEMS: usize> Ports<ITEMS> {
    /// Those of a vehicle with this key. `epoch` as in [`Mavlink::with_key`].
    #[must_use]
    pub fn new(identity: Identity, key: &Key, epoch: u64) -> Self {
        let mavlink = Mavlink::for_clients(identity).with_key(SigningKey::of(key), epoch);
        Self { mavlink, next: Instant::ZERO, stream: None }
    }

    /// The latest time of a signature, see [`Mavlink::signature_time`].
    #[must_use]
    pub fn signature_time(&self, now: Instant) -> u64 {
        self.mavlink.signature_time(now).unwrap_or_default()
    }

    /// Frames of MAVLink that did nothing, because they were not signed as they must be.
    #[must_use]
    pub const fn untrusted(&self) -> u32 {
        self.mavlink.untrusted()
    }

    /// MAVLink's turn: does what has come, and sends what is due. About a hundred times a second.
    pub fn turn(&mut self, now: Instant, ends: &mut impl Ends, access: &mut dyn VehicleAccess) {
        let Self { mavlink, next, stream } = self;
        let mut answers = Answers::default();
        ends.hear(&mut |client, heard| match heard {
            Heard::Opened => {
                *stream = Some((client, now));
                // Whoever has connected is told the vehicle's time before it signs.
                mavlink.open(now, client, true);
            }
            Heard::Bytes(bytes) => mavlink.hear(now, client, bytes, access, &mut |to, frame| answers.put(*to, frame)),
            Heard::Closed => {
                *stream = None;
                mavlink.close(client, access);
            }
        });
        answers.send(ends);
        if let Some((client, since)) = *stream
            && now.since(since) >= UNSIGNED
            && !mavlink.is_believed(client)
        {
            ends.close(client);
        }
        if now >= *next {
            *next = now + PERIOD;
            mavlink.poll(now, access, &mut |to, frame| ends.send(*to, frame));
        }
    }

    /// The secure link's turn: hands over what has come. About a hundred times a second.
    pub fn open(now: Instant, ends: &mut impl Ends, routes: &mut Routes, door: &mut impl Door) {
        let mut room = [0; MAX_FRAME];
        for _ in 0..SEALED_AT_ONCE {
            let Some((from, frame)) = ends.hear_sealed(&mut room) else { break };
            // What is shorter is no sealed frame, and would pass for a packet that authenticates nobody. An empty one asks for an offer, and is answered at once: nothing is noted of
            // those who ask, so no number of them keeps a station out.
            if frame.is_empty() {
                if let Some(offer) = door.offer(&mut room) {
                    ends.send_sealed(from, offer);
                }
            } else if frame.len() >= MIN_FRAME {
                let source = routes.source(now, from, door.station());
                door.take(now, source, frame);
            }
        }
    }

    /// Sends a frame of the secure link that is for this address, if it is on the network. One for everybody goes to whoever has spoken just now.
    /// `false`: it is for the radio, too.
    pub fn send_sealed(now: Instant, ends: &mut impl Ends, routes: &Routes, to: Address, frame: &[u8]) -> bool {
        if to == Address::BROADCAST {
            routes.recent(now).for_each(|place: SocketAddrV4| ends.send_sealed(place, frame));
            return false;
        }
        let Some(place) = routes.place(to) else { return false };
        ends.send_sealed(place, frame);
        true
    }
}

/// Answers that wait until everything that has come is heard, because ends cannot do both at once.
#[derive(Default)]
struct Answers {
    frames: heapless::Vec<u8, { 3 * 512 }>,
    each: heapless::Vec<(Client, usize), 16>,
}

impl Answers {
    /// What there is no room for is lost; stations ask again.
    fn put(&mut self, to: Client, frame: &[u8]) {
        if !self.each.is_full() && self.frames.extend_from_slice(frame).is_ok() {
            _ = self.each.push((to, frame.len()));
        }
    }

    fn send(&self, ends: &mut impl Ends) {
        let mut rest = &self.frames[..];
        for (to, length) in &self.each {
            let Some((frame, behind)) = rest.split_at_checked(*length) else { return };
            ends.send(*to, frame);
            rest = behind;
        }
    }
}
