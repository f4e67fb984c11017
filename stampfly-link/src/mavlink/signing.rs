//! MAVLink 2's signatures: a frame that only somebody with the key can have made, and that nobody can send again.
//!
//! A signature has a time in units of 10 µs, and a receiver believes no frame that is not later than the last one of the
//! same sender on the same link. What it costs a receiver: a hash of each frame, and one row a sender.
//! From [Message Signing](https://mavlink.io/en/guide/message_signing.html); SHA-256 is the crate `sha2`'s.
//!
//! The signature is of 48 bits, and payloads are not encrypted. For this project's own links there is a session with a tag of
//! 128 bits; this is for ground stations that speak MAVLink.

use super::frame::MavlinkFrame;
use super::signature::{Signature, time_bytes};
use core::fmt;
use sha2::{Digest, Sha256};
use stampfly_types::Instant;

/// Of the signature's time.
const TICK_US: u64 = 10;
/// Largest time: 48 bits.
const LATEST: u64 = (1 << 48) - 1;
/// Nothing later is believed: half of all times, in the year 2059. A sender whose clock is at the end of all times would leave none for others.
const AHEAD: u64 = LATEST / 2;
/// A new sender's time may be so much before the receiver's own: a minute, as the protocol's guide says.
const OLD: u64 = 60_000_000 / TICK_US;
/// Senders on all links together that are remembered.
pub const SENDERS: usize = 16;

/// A key that a vehicle and a ground station share. Is not printed.
#[derive(Clone, PartialEq, Eq)]
pub struct SigningKey([u8; 32]);

impl SigningKey {
    /// The key of these bytes.
    #[must_use]
    pub const fn new(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// The key of a pass-phrase, as ground stations make it: its SHA-256.
    #[must_use]
    pub fn from_passphrase(text: &str) -> Self {
        Self(Sha256::digest(text.as_bytes()).into())
    }

    /// The key of a vehicle's stations that speak MAVLink: that of the [phrase](crate::secure::Key::phrase) of its own key.
    #[must_use]
    pub fn of(key: &crate::secure::Key) -> Self {
        Self::from_passphrase(key.phrase().as_str())
    }

    fn digest(&self, signed: &[u8], link: u8, time: u64) -> [u8; 6] {
        let mut hash = Sha256::new();
        hash.update(self.0);
        hash.update(signed);
        hash.update([link]);
        hash.update(time_bytes(time));
        let [a, b, c, d, e, f, ..]: [u8; 32] = hash.finalize().into();
        [a, b, c, d, e, f]
    }
}

impl fmt::Debug for SigningKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SigningKey")
    }
}

/// The time of a signature at this instant, if it is `epoch` at the clock's zero, in units of 10 µs.
#[must_use]
pub const fn time(epoch: u64, now: Instant) -> u64 {
    epoch.saturating_add(now.as_micros() / TICK_US)
}

/// Signs frames.
///
/// Its time never stands still and never goes back, whatever the clock does. Over a restart of the vehicle that is the caller's
/// task: begin at the stored time plus what may have been sent since it was stored.
#[derive(Clone, Debug)]
pub struct Signer {
    key: SigningKey,
    link: u8,
    /// What the clock's zero is.
    epoch: u64,
    time: u64,
}

impl Signer {
    /// Signs with this key on this link. `epoch` is the signature time at the clock's zero, in units of 10 µs.
    #[must_use]
    pub const fn new(key: SigningKey, link: u8, epoch: u64) -> Self {
        Self { key, link, epoch, time: epoch }
    }

    /// The time of the last signature: to be stored now and then, see [`Signer`].
    #[must_use]
    pub const fn time(&self) -> u64 {
        self.time
    }

    /// Signs with later times than this one from now on: the largest that was believed. A station whose clock is behind another's takes over the
    /// vehicle's time, so the vehicle must not tell an earlier one than it asks for.
    pub fn not_before(&mut self, time: u64) {
        self.time = self.time.max(time);
    }

    pub(super) fn sign(&mut self, now: Instant, frame: &[u8]) -> Signature {
        let clock = time(self.epoch, now);
        self.time = clock.max(self.time.saturating_add(1)).min(LATEST);
        Signature { link: self.link, time: self.time, digest: self.key.digest(frame, self.link, self.time) }
    }
}

/// Why a frame is not believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Untrusted {
    /// It is not signed.
    Unsigned,
    /// Somebody without the key made it, or it was changed.
    WrongSignature,
    /// It was sent before, or long ago.
    Old,
    /// Its time leaves too few later ones.
    Ahead,
    /// There are too many senders.
    TooManySenders,
}

impl fmt::Display for Untrusted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unsigned => "it is not signed",
            Self::WrongSignature => "the signature is not of this key",
            Self::Old => "it is older than the last one",
            Self::Ahead => "its time is too far ahead",
            Self::TooManySenders => "there are too many senders",
        })
    }
}

impl core::error::Error for Untrusted {}

/// Says which frames may be believed.
///
/// ```
/// use stampfly_link::mavlink::dialects::common::{HEARTBEAT_DATA, MavMessage};
/// use stampfly_link::mavlink::signing::{Signer, SigningKey, Untrusted, Verifier};
/// use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkWriter};
/// use stampfly_types::Instant;
///
/// let key = SigningKey::from_passphrase("a long sentence that nobody guesses");
/// let (mut signer, mut verifier) = (Signer::new(key.clone(), 0, 0), Verifier::new(key, 0));
/// let mut bytes = [0; LONGEST];
/// let message = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
/// let sent = MavlinkWriter::new(255, 190).write_signed(Instant::from_millis(1), &message, &mut signer, &mut bytes);
///
/// let mut decoder = MavlinkDecoder::<MavMessage>::new();
/// let mut judge = |bytes: &[u8]| bytes.iter().find_map(|byte| decoder.feed(*byte).map(|frame| verifier.verify(&frame)));
/// assert_eq!(judge(sent.unwrap_or_default()), Some(Ok(())));
/// assert_eq!(judge(sent.unwrap_or_default()), Some(Err(Untrusted::Old)), "sent again");
/// ```
#[derive(Clone, Debug)]
pub struct Verifier {
    key: SigningKey,
    /// Nothing older is believed of a sender that is new.
    time: u64,
    /// System, component, link, time of the last frame.
    senders: heapless::Vec<(u8, u8, u8, u64), SENDERS>,
}

impl Verifier {
    /// Believes frames with this key. `time` is the latest signature time that was seen or made before, in units of 10 µs: a
    /// frame of an unknown sender from more than a minute before it is not believed.
    #[must_use]
    pub const fn new(key: SigningKey, time: u64) -> Self {
        Self { key, time, senders: heapless::Vec::new() }
    }

    /// The latest time that was believed; to be stored now and then.
    #[must_use]
    pub const fn time(&self) -> u64 {
        self.time
    }

    /// Judges a frame, and remembers it when it is believed.
    ///
    /// # Errors
    /// When it is not to be believed. Nothing is remembered of it then.
    pub fn verify(&mut self, frame: &MavlinkFrame<'_>) -> Result<(), Untrusted> {
        let signature = frame.signature.ok_or(Untrusted::Unsigned)?;
        let signed = frame.bytes.len().checked_sub(Signature::LENGTH).and_then(|end| frame.bytes.get(..end));
        let digest = self.key.digest(signed.unwrap_or_default(), signature.link, signature.time);
        // Without an early end, so that the time it takes says nothing about the right bytes.
        let difference = digest.iter().zip(signature.digest).fold(0, |sum, (a, b)| sum | (a ^ b));
        if core::hint::black_box(difference) != 0 {
            return Err(Untrusted::WrongSignature);
        }
        if signature.time > AHEAD {
            return Err(Untrusted::Ahead);
        }
        let sender = (frame.system, frame.component, signature.link);
        let row = self.senders.iter_mut().find(|(system, component, link, _)| (*system, *component, *link) == sender);
        match row {
            Some((.., last)) if signature.time <= *last => return Err(Untrusted::Old),
            Some((.., last)) => *last = signature.time,
            None if signature.time.saturating_add(OLD) < self.time => return Err(Untrusted::Old),
            None => {
                let row = (frame.system, frame.component, signature.link, signature.time);
                self.senders.push(row).map_err(|_| Untrusted::TooManySenders)?;
            }
        }
        self.time = self.time.max(signature.time);
        Ok(())
    }
}
