//! Binding: four packets in which a transmitter says what its address and its channels are.
//!
//! | packet | bytes |
//! |---|---|
//! | 1 | FF AA 55, address (5), 2 that are not used |
//! | 2 | sum (2), 00, channels 0 to 6 |
//! | 3 | sum (2), 01, channels 7 to 13 |
//! | 4 | sum (2), 02, channels 14 to 19, 1 that is not used |
//!
//! The sum is that of the address's bytes, little-endian. It is at most 04FB, so no other packet begins as the first.

use super::{HOPS, PAYLOAD};

const MARK: [u8; 3] = [0xFF, 0xAA, 0x55];
/// Channels in a packet; the last one has one less.
const EACH: usize = 7;
/// The radio's last channel.
const LAST: u8 = 125;

/// A transmitter: what a receiver has to know to follow it, and stores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HiskyLink {
    /// In the order of the radio's register.
    pub address: [u8; 5],
    /// Channels in the order in which they are used, 0 to 125. Transmitters use 2 to 77.
    pub hops: [u8; HOPS],
}

impl HiskyLink {
    fn sum(&self) -> u16 {
        self.address.iter().map(|byte| u16::from(*byte)).sum()
    }

    /// The four packets that a transmitter sends while it binds, over and over.
    ///
    /// ```
    /// use stampfly_link::hisky::HiskyLink;
    /// let link = HiskyLink { address: [1, 2, 3, 4, 5], hops: core::array::from_fn(|hop| 10 + hop as u8) };
    /// let [first, second, ..] = link.bind_packets();
    /// assert_eq!(first, [0xFF, 0xAA, 0x55, 1, 2, 3, 4, 5, 0, 0]);
    /// assert_eq!(second, [15, 0, 0, 10, 11, 12, 13, 14, 15, 16]);
    /// ```
    #[must_use]
    pub fn bind_packets(&self) -> [[u8; PAYLOAD]; 4] {
        let ([a, b, c], [v, w, x, y, z]) = (MARK, self.address);
        let [low, high] = self.sum().to_le_bytes();
        let mut packets = [[a, b, c, v, w, x, y, z, 0, 0], [0; PAYLOAD], [0; PAYLOAD], [0; PAYLOAD]];
        let [_, lists @ ..] = &mut packets;
        for ((list, index), hops) in lists.iter_mut().zip(0..).zip(self.hops.chunks(EACH)) {
            for (place, byte) in list.iter_mut().zip([low, high, index].iter().chain(hops)) {
                *place = *byte;
            }
        }
        packets
    }
}

/// A receiver that listens for a transmitter that binds.
///
/// It takes the first packet, and then the others in their order and with the same sum. What is lost comes again; packets between do not matter.
/// The first packet of another transmitter begins anew.
///
/// ```
/// use stampfly_link::hisky::{HiskyBinding, HiskyLink};
/// let link = HiskyLink { address: [9; 5], hops: [42; 20] };
/// let mut binding = HiskyBinding::default();
/// let [first, second, third, fourth] = link.bind_packets();
/// let heard = [second, first, third, fourth, first, second, third].map(|packet| binding.take(&packet));
/// assert_eq!(heard, [None; 7]);
/// assert_eq!(binding.take(&fourth), Some(link));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HiskyBinding {
    /// What is known so far, and how many lists of channels that is.
    heard: Option<(HiskyLink, u8)>,
}

impl HiskyBinding {
    /// Takes a packet. Returns the transmitter when it is the last one.
    pub fn take(&mut self, packet: &[u8; PAYLOAD]) -> Option<HiskyLink> {
        if let [a, b, c, v, w, x, y, z, _, _] = *packet
            && [a, b, c] == MARK
        {
            let address = [v, w, x, y, z];
            if self.heard.is_none_or(|(link, _)| link.address != address) {
                self.heard = Some((HiskyLink { address, hops: [0; HOPS] }, 0));
            }
            return None;
        }
        let (link, lists) = self.heard.as_mut()?;
        let [low, high, index, channels @ ..] = packet;
        if u16::from_le_bytes([*low, *high]) != link.sum() || index != lists {
            return None;
        }
        let places = link.hops.chunks_mut(EACH).nth(usize::from(*index))?;
        let channels = channels.get(..places.len())?;
        if channels.iter().any(|channel| *channel > LAST) {
            return None;
        }
        places.copy_from_slice(channels);
        *lists += 1;
        if *lists < 3 {
            return None;
        }
        self.heard.take().map(|(link, _)| link)
    }
}
