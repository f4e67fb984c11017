//! The programs that talk to a vehicle by [datagrams](crate::datagram), each in the encoding it uses.
//!
//! Sans I/O: hand in what arrived, hand on what is to be sent. Bytes and JSON lines are told apart by their first byte; what
//! is damaged, old or repeated is dropped; a peer that is silent is forgotten. Use it at the vehicle's end, where anyone may
//! call; a program that talks to one vehicle needs a [`SequenceFilter`] and no list.

use crate::datagram::Body;
use crate::{Datagram, SequenceFilter, json};
use core::fmt;
use stampfly_types::{Duration, Instant};

/// Room for a datagram in either encoding, bytes: what every network passes in one piece.
pub const MAX_DATAGRAM: usize = 1232;

/// A sender silent for this long may have restarted and count from anywhere.
const RESTART: Duration = Duration::from_secs(1);

struct Peer<A, T> {
    address: A,
    uses_json: bool,
    news: SequenceFilter,
    heard: Instant,
    notes: T,
}

/// At most `N` peers with addresses `A`, and what the vehicle notes of each, `T`.
///
/// ```
/// use stampfly_link::{Datagram, DatagramError, Peers, datagrams};
/// use stampfly_types::{Duration, Instant, messages::PowerData};
///
/// datagrams! {
///     /// What a charger says.
///     pub enum Charger, magic b"CHG1";
///     /// Its output.
///     PowerData = 1, valid if |_| true;
/// }
///
/// let (now, power) = (Instant::ZERO, Charger::from(PowerData::default()));
/// let mut buffer = [0; 64];
/// let bytes = Datagram { sequence: 1, time: now, body: power }.write(&mut buffer)?;
///
/// let mut peers = Peers::<u8, bool, 4>::new(Duration::from_secs(2));
/// let (wants_all, body) = peers.hear(now, 7, bytes).expect("a datagram");
/// assert_eq!(body, power);
/// *wants_all = true;
/// assert!(peers.hear::<Charger>(now, 7, bytes).is_none(), "a repetition");
///
/// let mut sent_to = None;
/// peers.send(now, power, |wants_all| *wants_all, &mut |to, _bytes| sent_to = Some(*to));
/// assert_eq!(sent_to, Some(7));
/// # Ok::<(), DatagramError>(())
/// ```
pub struct Peers<A, T, const N: usize> {
    peers: [Option<Peer<A, T>>; N],
    silence: Duration,
    sequence: u32,
}

impl<A: PartialEq, T: Default, const N: usize> Peers<A, T, N> {
    /// Nobody yet. A peer that is silent for longer than `silence` is forgotten.
    #[must_use]
    pub const fn new(silence: Duration) -> Self {
        Self { peers: [const { None }; N], silence, sequence: 0 }
    }

    /// The message that arrived from this address, and what is noted of its sender. `None` when it is none or no news, or when
    /// there are `N` others.
    pub fn hear<B: Body>(&mut self, now: Instant, from: A, bytes: &[u8]) -> Option<(&mut T, B)> {
        let uses_json = bytes.first() == Some(&b'{');
        let Datagram { sequence, body, .. } = match uses_json {
            true => json::read(core::str::from_utf8(bytes).ok()?).ok()?,
            false => Datagram::read(bytes).ok()?,
        };
        for slot in &mut self.peers {
            slot.take_if(|peer| now.since(peer.heard) > self.silence);
        }
        let is_known = |slot: &Option<Peer<A, T>>| slot.as_ref().is_some_and(|peer| peer.address == from);
        let place = self.peers.iter().position(is_known);
        let place = place.or_else(|| self.peers.iter().position(Option::is_none))?;
        let peer = self.peers.get_mut(place)?.get_or_insert_with(|| Peer {
            address: from,
            uses_json,
            news: SequenceFilter::new(RESTART),
            heard: now,
            notes: T::default(),
        });
        if !peer.news.accept(now, sequence) {
            return None;
        }
        (peer.heard, peer.uses_json) = (now, uses_json);
        Some((&mut peer.notes, body))
    }

    /// Hands `put` a message for every peer that wants it, with the peer's address.
    pub fn send<B: Body>(&mut self, now: Instant, body: B, wants: impl Fn(&T) -> bool, put: &mut dyn FnMut(&A, &[u8])) {
        let mut datagram = Datagram { sequence: self.sequence, time: now, body };
        for peer in self.peers.iter().flatten().filter(|peer| wants(&peer.notes)) {
            datagram.sequence = self.sequence;
            self.sequence = self.sequence.wrapping_add(1);
            let mut text = Text { buffer: [0; MAX_DATAGRAM], length: 0 };
            let bytes = match peer.uses_json {
                true => json::write(&datagram, &mut text).ok().and_then(|()| text.buffer.get(..text.length)),
                false => datagram.write(&mut text.buffer).ok().map(|bytes| bytes as &[u8]),
            };
            // What must not be sent is not: the message is not valid.
            if let Some(bytes) = bytes {
                put(&peer.address, bytes);
            }
        }
    }
}

/// Text of limited length.
struct Text {
    buffer: [u8; MAX_DATAGRAM],
    length: usize,
}

impl fmt::Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let end = self.length + text.len();
        self.buffer.get_mut(self.length..end).ok_or(fmt::Error)?.copy_from_slice(text.as_bytes());
        self.length = end;
        Ok(())
    }
}
