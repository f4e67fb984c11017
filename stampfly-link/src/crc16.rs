//! CRC-16/MCRF4XX, which MAVLink has: polynomial 0x1021 with the least significant bit first, begun with ones.
//!
//! Two bytes at a time, from two tables of 512 bytes each: a byte waits for the one before it, and two of them wait for it once.

const POLYNOMIAL: u16 = 0x8408;

/// What a byte does to the sum, and what it does when another one follows.
static TABLES: [[u16; 256]; 2] = tables();

const fn tables() -> [[u16; 256]; 2] {
    let mut tables = [[0; 256]; 2];
    let mut byte = 0;
    while byte < 256 {
        let (mut sum, mut bits) = (byte as u16, 0);
        while bits < 8 {
            sum = if sum & 1 == 1 { sum >> 1 ^ POLYNOMIAL } else { sum >> 1 };
            bits += 1;
        }
        tables[0][byte] = sum;
        byte += 1;
    }
    byte = 0;
    while byte < 256 {
        let sum = tables[0][byte];
        tables[1][byte] = sum >> 8 ^ tables[0][(sum & 0xFF) as usize];
        byte += 1;
    }
    tables
}

/// The sum over these bytes and one more.
#[inline]
pub fn crc16(bytes: &[u8], last: u8) -> u16 {
    let [one, two] = &TABLES;
    // A byte is always within its table, and the compiler knows.
    let next = |sum: u16, byte: u8| sum >> 8 ^ one[usize::from(sum as u8 ^ byte)];
    let (pairs, rest) = bytes.as_chunks::<2>();
    let sum = pairs.iter().fold(0xFFFF, |sum, pair| {
        let [low, high] = (sum ^ u16::from_le_bytes(*pair)).to_le_bytes();
        two[usize::from(low)] ^ one[usize::from(high)]
    });
    next(rest.iter().fold(sum, |sum, byte| next(sum, *byte)), last)
}

#[cfg(test)]
mod tests {
    use super::crc16;
    use proptest::prelude::*;

    #[test]
    fn the_check_value_is_that_of_the_catalogue() {
        // CRC RevEng, CRC-16/MCRF4XX.
        assert_eq!(crc16(b"12345678", b'9'), 0x6F91);
    }

    proptest! {
        #[test]
        fn it_is_the_sum_of_the_crate_mavlink(bytes in prop::collection::vec(any::<u8>(), 0..300), last: u8) {
            prop_assert_eq!(crc16(&bytes, last), mavlink::calculate_crc(&bytes, last));
        }
    }
}
