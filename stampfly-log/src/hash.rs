//! A 64-bit hash of everything that a flight published.
//!
//! Two flights with the same hash published the same words, with the same stamps, in the same
//! order. Compare hashes to verify a replay, another machine or another build profile. Not a
//! cryptographic hash: a collision is easy to construct. Not a checksum for files.
//!
//! # Algorithm
//! Two 64-bit lanes alternate. Each step is `lane = rotate(lane ^ value * SPREAD) * MULTIPLIER`,
//! the shape of the rounds of xxHash. A step is a bijection of the lane for a given value, and of
//! the value for a given lane. Two flights that differ in one word, one stamp, one generation or
//! one topic therefore **always** have different hashes. With more than one difference the
//! probability of equal hashes is about 2⁻⁶⁴.
//!
//! The value is multiplied before it enters: the top bit of a lane survives a multiplication as a
//! single bit, which a second difference could cancel. All arithmetic is wrapping 64-bit
//! arithmetic, so the result is the same on every machine. There are two lanes because a lane has
//! to wait for its own multiplication; four lanes would not fit into the registers of a 32-bit
//! core.
//!
//! A message enters as follows. Lane A takes the topic (bits 0–15), the number of words (16–31) and
//! the generation (32–63); lane B takes the stamp. Then pairs of words, low word first, go to A, B,
//! A, … An odd last word is paired with zero.

use stampfly_types::Instant;

/// Start values: 64 bits of the fractions of √2 and √3.
const SEED: [u64; 2] = [0x6a09_e667_f3bc_c908, 0xbb67_ae85_84ca_a73b];
/// Odd multipliers of the lanes: 64 bits of the fractions of √5 and √7, lowest bit set.
const MULTIPLIER: [u64; 2] = [0x3c6e_f372_fe94_f82b, 0xa54f_f53a_5f1d_36f1];
/// Odd multiplier of the values: 64 bits of the fraction of √11, lowest bit set.
const SPREAD: u64 = 0x510e_527f_ade6_82d1;
/// Rotations that move the well-mixed high bits to low positions.
const ROTATION: [u32; 2] = [29, 37];

/// The hash of a flight, updated with every message.
///
/// ```
/// use stampfly_log::FlightHash;
/// use stampfly_types::Instant;
///
/// let mut flight = FlightHash::new();
/// flight.publish(3, 1, Instant::from_micros(2_500), &[0x3f80_0000, 7]);
/// let mut replay = FlightHash::new();
/// replay.publish(3, 1, Instant::from_micros(2_500), &[0x3f80_0000, 7]);
/// assert_eq!(flight.finish(), replay.finish());
/// replay.publish(3, 2, Instant::from_micros(5_000), &[0x3f80_0000, 7]);
/// assert_ne!(flight.finish(), replay.finish());
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FlightHash {
    lanes: [u64; 2],
    messages: u64,
}

impl Default for FlightHash {
    fn default() -> Self {
        Self::new()
    }
}

impl FlightHash {
    /// The hash of a flight that has published nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { lanes: SEED, messages: 0 }
    }

    /// Adds one published message: its index in the topic table, its generation, its stamp, its
    /// words.
    #[inline]
    pub fn publish(&mut self, topic: u16, generation: u32, at: Instant, words: &[u32]) {
        let [mut a, mut b] = self.lanes;
        // Sixteen bits of the length suffice to distinguish a missing word from a zero word.
        let length = words.len() as u16;
        a = step::<0>(a, pair((u32::from(length) << 16) | u32::from(topic), generation));
        b = step::<1>(b, at.as_micros());
        // Four words at a time, two for each lane, so that the multiplications of the lanes
        // overlap.
        let (fours, rest) = words.as_chunks::<4>();
        for &[w0, w1, w2, w3] in fours {
            a = step::<0>(a, pair(w0, w1));
            b = step::<1>(b, pair(w2, w3));
        }
        match *rest {
            [w0] => a = step::<0>(a, pair(w0, 0)),
            [w0, w1] => a = step::<0>(a, pair(w0, w1)),
            [w0, w1, w2] => {
                a = step::<0>(a, pair(w0, w1));
                b = step::<1>(b, pair(w2, 0));
            }
            _ => {}
        }
        self.lanes = [a, b];
        self.messages = self.messages.wrapping_add(1);
    }

    /// Number of messages added, modulo 2⁶⁴.
    #[must_use]
    pub const fn messages(&self) -> u64 {
        self.messages
    }

    /// The hash of everything published so far. More messages may be added afterwards.
    #[must_use]
    pub const fn finish(&self) -> u64 {
        // A bijection mixes each lane before the two are combined, so a difference in one lane is
        // preserved.
        avalanche(self.lanes[0]) ^ avalanche(self.lanes[1]).rotate_left(32)
    }
}

/// Two words as one value, the first one in the low half.
#[inline]
const fn pair(low: u32, high: u32) -> u64 {
    low as u64 | (high as u64) << 32
}

#[inline]
const fn step<const LANE: usize>(lane: u64, value: u64) -> u64 {
    (lane ^ value.wrapping_mul(SPREAD)).rotate_left(ROTATION[LANE]).wrapping_mul(MULTIPLIER[LANE])
}

/// Spreads every input bit over all output bits. A bijection, because xor-shifts and odd
/// multiplications are invertible.
const fn avalanche(mut lane: u64) -> u64 {
    lane = (lane ^ (lane >> 32)).wrapping_mul(MULTIPLIER[0]);
    lane = (lane ^ (lane >> 29)).wrapping_mul(MULTIPLIER[1]);
    lane ^ (lane >> 32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    type Published = (u16, u32, u64, Vec<u32>);

    fn hash(flight: &[Published]) -> u64 {
        let mut hash = FlightHash::new();
        for (topic, generation, at, words) in flight {
            hash.publish(*topic, *generation, Instant::from_micros(*at), words);
        }
        hash.finish()
    }

    fn flight() -> impl Strategy<Value = Vec<Published>> {
        let message = (any::<u16>(), any::<u32>(), any::<u64>(), prop::collection::vec(any::<u32>(), 0..12));
        prop::collection::vec(message, 1..8)
    }

    /// Golden values, computed with a Python transcription of the module documentation. Changing
    /// one invalidates every stored flight hash.
    #[test]
    fn the_definition_is_pinned() {
        assert_eq!(hash(&[]), GOLDEN_EMPTY);
        let words: Vec<u32> = (0..7).map(|i| 0x3f80_0000 + i).collect();
        assert_eq!(hash(&[(0, 1, 2_500, words.clone())]), GOLDEN_ONE);
        assert_eq!(hash(&[(0, 1, 2_500, words), (5, 9, u64::MAX, std::vec![u32::MAX; 4])]), GOLDEN_TWO);
    }
    const GOLDEN_EMPTY: u64 = 0x17eb_90f7_48e0_a87c;
    const GOLDEN_ONE: u64 = 0x361b_cea9_2e48_699b;
    const GOLDEN_TWO: u64 = 0x6d98_208f_e7a7_b787;

    #[test]
    fn every_single_bit_counts() {
        let flight = [(1, 2, 3, std::vec![0; 5]), (1, 3, 4, std::vec![7; 2])];
        let mut seen = Vec::from([hash(&flight)]);
        for word in 0..5 {
            for bit in 0..32 {
                let mut changed = flight.clone();
                changed[0].3[word] ^= 1 << bit;
                seen.push(hash(&changed));
            }
        }
        for bit in 0..64 {
            let mut changed = flight.clone();
            changed[1].2 ^= 1 << bit;
            seen.push(hash(&changed));
        }
        let total = seen.len();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), total);
    }

    proptest! {
        #[test]
        fn one_changed_value_is_always_noticed(mut flight in flight(), pick: prop::sample::Index, flip in 1u32..) {
            let before = hash(&flight);
            let index = pick.index(flight.len());
            flight[index].1 ^= flip;
            prop_assert_ne!(hash(&flight), before);
        }

        #[test]
        fn order_counts(flight in flight()) {
            let mut swapped = flight.clone();
            swapped.reverse();
            prop_assert_eq!(hash(&swapped) == hash(&flight), swapped == flight);
        }

        #[test]
        fn a_trailing_zero_word_is_a_word(words in prop::collection::vec(any::<u32>(), 0..9)) {
            let mut longer = words.clone();
            longer.push(0);
            prop_assert_ne!(hash(&[(0, 0, 0, words)]), hash(&[(0, 0, 0, longer)]));
        }
    }
}
