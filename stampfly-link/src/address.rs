//! The hardware address of a station.

use core::fmt;
use stampfly_types::message;

/// A station's 48-bit hardware address, first byte on the air first.
///
/// ```
/// use stampfly_link::Address;
/// let address = Address([0x34, 0x85, 0x18, 0xAB, 0xCD, 0xEF]);
/// assert_eq!(address.to_string(), "34:85:18:AB:CD:EF");
/// assert_eq!(address.tail(), [0xAB, 0xCD, 0xEF]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Address(pub [u8; 6]);

impl Address {
    /// Everybody.
    pub const BROADCAST: Self = Self([0xFF; 6]);

    /// The last three bytes, by which a control packet names its vehicle.
    #[must_use]
    pub const fn tail(self) -> [u8; 3] {
        let [.., a, b, c] = self.0;
        [a, b, c]
    }

    /// Can a single station have it? Groups, which everybody's address is one of, have the lowest bit of the first byte
    /// set, and nobody is all zeros.
    #[must_use]
    pub const fn is_station(self) -> bool {
        let [first, b, c, d, e, f] = self.0;
        first & 1 == 0 && (first | b | c | d | e | f) != 0
    }
}

impl fmt::Display for Address {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c, d, e, f] = self.0;
        write!(formatter, "{a:02X}:{b:02X}:{c:02X}:{d:02X}:{e:02X}:{f:02X}")
    }
}

message! {
    /// A transmitter's address.
    pub struct LinkPeer {
        /// Its six bytes, the first one highest.
        address: u64,
    }
}

impl From<Address> for LinkPeer {
    fn from(Address([a, b, c, d, e, f]): Address) -> Self {
        Self { address: u64::from_be_bytes([0, 0, a, b, c, d, e, f]) }
    }
}

impl From<LinkPeer> for Address {
    fn from(peer: LinkPeer) -> Self {
        let [_, _, a, b, c, d, e, f] = peer.address.to_be_bytes();
        Self([a, b, c, d, e, f])
    }
}
