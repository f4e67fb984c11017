//! Sixteen channels of eleven bits: how SBUS and CRSF carry sticks.

/// Positions of sticks and switches, 0 to 2047 each.
///
/// | raw | µs of a servo pulse | [`unit`](Self::unit) |
/// |---|---|---|
/// | 172 | 987.5 | -1.0006 |
/// | 992 | 1500 | 0 |
/// | 1811 | 2011.9 | 0.9994 |
///
/// ```
/// use stampfly_link::serial::Channels;
/// let mut channels = Channels([992; 16]);
/// channels.0[2] = 172;
/// assert_eq!(channels.microseconds(0), Some(1500.0));
/// assert!(channels.unit(2).is_some_and(|down| down < -0.99));
/// assert_eq!(channels.unit(16), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channels(pub [u16; 16]);

/// Where a stick rests.
const CENTRE: f32 = 992.0;
/// From the centre to the end of a stick's travel; more is for trims.
const TRAVEL: f32 = 819.5;
const BITS: u32 = 11;
const MASK: u32 = (1 << BITS) - 1;

impl Channels {
    /// Bytes of sixteen channels.
    pub(super) const PACKED: usize = 22;

    /// The pulse that a servo on this channel would get, µs (`raw · 5/8 + 880`); `None` for a channel there is none of.
    #[must_use]
    pub fn microseconds(&self, channel: usize) -> Option<f32> {
        self.0.get(channel).map(|raw| f32::from(*raw) * 0.625 + 880.0)
    }

    /// The stick, -1 to 1 at its ends and a quarter more with trims; `None` for a channel there is none of.
    #[must_use]
    pub fn unit(&self, channel: usize) -> Option<f32> {
        self.0.get(channel).map(|raw| (f32::from(*raw) - CENTRE) / TRAVEL)
    }

    /// Least significant bit first.
    #[inline]
    pub(super) fn unpack(bytes: &[u8; Self::PACKED]) -> Self {
        // Five channels are in eight bytes, wherever they begin in the first one.
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v] = *bytes;
        let first = u64::from_le_bytes([a, b, c, d, e, f, g, h]);
        let second = u64::from_le_bytes([g, h, i, j, k, l, m, n]) >> 7;
        let third = u64::from_le_bytes([n, o, p, q, r, s, t, u]) >> 6;
        let last = u64::from(u16::from_le_bytes([u, v]) >> 5);
        let channel = |bits: u64, place: u32| (bits >> (place * BITS)) as u16 & MASK as u16;
        let five = |bits| [0, 1, 2, 3, 4].map(|place| channel(bits, place));
        let ([a, b, c, d, e], [f, g, h, i, j], [k, l, m, n, o]) = (five(first), five(second), five(third));
        Self([a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, channel(last, 0)])
    }

    /// Positions beyond 2047 are 2047.
    pub(super) fn pack(&self) -> [u8; Self::PACKED] {
        let (mut bits, mut count, mut rest) = (0_u32, 0, self.0.iter());
        [(); Self::PACKED].map(|()| {
            if count < 8 {
                bits |= rest.next().map_or(0, |channel| u32::from(*channel).min(MASK)) << count;
                count += BITS;
            }
            let byte = bits as u8;
            bits >>= 8;
            count -= 8;
            byte
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Channels;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_packed_is_unpacked(channels in prop::array::uniform16(0..2048_u16)) {
            prop_assert_eq!(Channels::unpack(&Channels(channels).pack()), Channels(channels));
        }

        #[test]
        fn every_bit_is_somebodys(bytes in prop::array::uniform22(any::<u8>())) {
            prop_assert_eq!(Channels::unpack(&bytes).pack(), bytes);
        }
    }

    #[test]
    fn too_much_is_the_most() {
        assert_eq!(Channels([u16::MAX; 16]).pack(), [0xFF; 22]);
    }
}
