//! The memory a flight record is written into, and one number for what is in it.

use stampfly_log::FlightHash;
use stampfly_types::Instant;

/// Room for the whole record, bytes.
pub const SIZE: usize = 3 << 20;

/// Bytes that enter the hash together.
const PIECE: usize = 256;

/// Hash over all bytes, as words; what is missing of the last word is zero.
pub fn hash(bytes: &[u8]) -> u64 {
    let mut hash = FlightHash::new();
    for (number, piece) in bytes.chunks(PIECE).enumerate() {
        let mut words = [0; PIECE / 4];
        for (word, part) in words.iter_mut().zip(piece.chunks(4)) {
            let mut whole = [0; 4];
            for (place, byte) in whole.iter_mut().zip(part) {
                *place = *byte;
            }
            *word = u32::from_le_bytes(whole);
        }
        hash.publish(piece.len() as u16, number as u32, Instant::ZERO, &words);
    }
    hash.finish()
}
