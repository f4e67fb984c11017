//! `TUNNEL`: bytes of anybody's own protocol between two MAVLink systems.
//!
//! The dialect's enumeration has the registered types alone, and refuses others; this reads and writes any. From the
//! [message's definition](https://mavlink.io/en/messages/common.html#TUNNEL).

use heapless::Vec;

/// One `TUNNEL`.
///
/// ```
/// use stampfly_link::mavlink::Tunnel;
/// let tunnel = Tunnel::new(0xF000, [1, 1], b"hello").expect("it is short");
/// assert_eq!(Tunnel::read(&tunnel.payload()), Some(tunnel));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tunnel {
    /// What the bytes are: from 32768 on anybody's.
    pub kind: u16,
    /// System and component that it is for; zero is everybody.
    pub target: [u8; 2],
    /// The bytes.
    pub bytes: Vec<u8, { Self::LONGEST }>,
}

impl Tunnel {
    /// The message's number.
    pub const ID: u32 = 385;
    /// Most bytes.
    pub const LONGEST: usize = 128;
    /// Bytes before them.
    const HEADER: usize = 5;

    /// One with these bytes; `None` when they are too many.
    #[must_use]
    pub fn new(kind: u16, target: [u8; 2], bytes: &[u8]) -> Option<Self> {
        Some(Self { kind, target, bytes: Vec::from_slice(bytes).ok()? })
    }

    /// Reads a message's payload, whose zeros at the end were left out.
    #[must_use]
    pub fn read(payload: &[u8]) -> Option<Self> {
        let mut whole = [0; Self::HEADER + Self::LONGEST];
        whole.iter_mut().zip(payload).for_each(|(to, from)| *to = *from);
        let (&[k0, k1, system, component, length], bytes) = whole.split_first_chunk::<{ Self::HEADER }>()?;
        Self::new(u16::from_le_bytes([k0, k1]), [system, component], bytes.get(..length.into())?)
    }

    /// The message's payload, for [`MavlinkWriter::write_payload`](super::MavlinkWriter::write_payload).
    #[must_use]
    pub fn payload(&self) -> Vec<u8, { Self::HEADER + Self::LONGEST }> {
        let ([k0, k1], [system, component]) = (self.kind.to_le_bytes(), self.target);
        let mut payload = Vec::new();
        // There is room for both.
        _ = payload.extend_from_slice(&[k0, k1, system, component, self.bytes.len() as u8]);
        _ = payload.extend_from_slice(&self.bytes);
        payload
    }
}
