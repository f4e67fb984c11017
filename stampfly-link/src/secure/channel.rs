//! One session, seen from one end: its key, and how far the counters of both directions have come.

use super::cipher::Secret;
use super::clock::Tick;
use super::frame::{Header, Kind, Sender};
use super::refused::{Refused, SealError};

/// What is left of a counter when a new session is asked for: at a thousand frames a second, an hour and more.
const RESERVE: u32 = 1 << 22;
/// HChaCha20's input for the key that seals the handshake.
const HANDSHAKE: [u8; 16] = *b"stampfly-secure1";

/// The key that announcements are sealed with.
pub fn handshake_secret(shared: &Secret) -> Secret {
    shared.derive(HANDSHAKE)
}

/// The key that answers to one announcement are sealed with: one for each, so that a station whose random numbers come again
/// seals no two texts with one nonce.
pub fn answer_secret(handshake: &Secret, [a, b, c, d, e, f, g, h]: [u8; 8]) -> Secret {
    handshake.derive([a, b, c, d, e, f, g, h, 0, 0, 0, 0, 0, 0, 0, 0])
}

/// One end of a session.
#[derive(Clone, Debug)]
pub struct Channel {
    secret: Secret,
    end: Sender,
    key_id: u8,
    session: u32,
    /// The counter of the frame sealed last. The first frame has 1.
    sent: u32,
    /// The counter of the newest frame that was taken.
    heard: u32,
}

impl Channel {
    /// The session that these two random numbers make, at this end of it.
    pub fn new(shared: &Secret, end: Sender, key_id: u8, of_vehicle: [u8; 8], of_station: [u8; 8]) -> Self {
        let [a, b, c, d, e, f, g, h] = of_vehicle;
        let [i, j, k, l, m, n, o, p] = of_station;
        let secret = shared.derive([a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p]);
        let session = u32::from_le_bytes([a, b, c, d]);
        Self { secret, end, key_id, session, sent: 0, heard: 0 }
    }

    pub const fn session(&self) -> u32 {
        self.session
    }

    /// The counter of the frame sealed last.
    pub const fn sent(&self) -> u32 {
        self.sent
    }

    /// Gives up the counters below this one. There is no way back.
    pub const fn skip(&mut self, to: u32) {
        if to > self.sent {
            self.sent = to;
        }
    }

    /// Is it time for another session, because a counter is near its end?
    pub const fn nears_end(&self) -> bool {
        self.sent >= u32::MAX - RESERVE || self.heard >= u32::MAX - RESERVE
    }

    pub fn seal(
        &mut self,
        kind: Kind,
        tick: Tick,
        room: &mut [u8],
        write: impl FnOnce(&mut [u8]) -> Result<usize, SealError>,
    ) -> Result<usize, SealError> {
        let counter = self.sent.checked_add(1).ok_or(SealError::Exhausted)?;
        let header = Header { kind, key_id: self.key_id, session: self.session, counter };
        let length = header.seal(&self.secret, self.end, tick, room, write)?;
        // After it, or what was refused would leave a gap. No two frames have one counter: only what is returned is sent.
        self.sent = counter;
        Ok(length)
    }

    /// May a frame with this header be one of this session, and is it news? Costs nothing, and what it refuses would be
    /// refused with a right tag as well.
    pub const fn admits(&self, header: &Header) -> Result<(), Refused> {
        match (header.session == self.session, header.counter > self.heard) {
            (false, _) => Err(Refused::Session),
            (_, false) => Err(Refused::Old),
            _ => Ok(()),
        }
    }

    /// Opens a frame that was [admitted](Self::admits); an authentic one is the newest from then on.
    pub fn open<'f>(&mut self, header: &Header, frame: &'f mut [u8]) -> Result<(Tick, &'f [u8]), Refused> {
        let other = if self.end == Sender::Vehicle { Sender::Station } else { Sender::Vehicle };
        let opened = header.open(&self.secret, other, frame)?;
        self.heard = header.counter;
        Ok(opened)
    }
}
