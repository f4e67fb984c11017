//! CRC-8/DVB-S2, polynomial 0xD5: what CRSF and MSP 2 check their frames by.

/// The CRC of a byte, and of a byte that another follows, which is zero.
const TABLES: [[u8; 256]; 2] = {
    let one = table();
    let mut two = [0; 256];
    let mut byte = 0;
    while byte < two.len() {
        two[byte] = one[one[byte] as usize];
        byte += 1;
    }
    [one, two]
};

const fn table() -> [u8; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < table.len() {
        let (mut crc, mut bit) = (byte as u8, 0);
        while bit < 8 {
            crc = if crc & 0x80 != 0 { crc << 1 ^ 0xD5 } else { crc << 1 };
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
}

/// The CRC of these bytes. Two at a time: a look into a table waits for the one before it.
pub fn crc8(bytes: &[u8]) -> u8 {
    let [one, two] = &TABLES;
    let of = |table: &[u8; 256], byte: u8| table.get(usize::from(byte)).copied().unwrap_or(0);
    let (pairs, last) = bytes.as_chunks::<2>();
    let crc = pairs.iter().fold(0, |crc, [first, second]| of(two, crc ^ first) ^ of(one, *second));
    last.iter().fold(crc, |crc, byte| of(one, crc ^ byte))
}

#[cfg(test)]
mod tests {
    use super::crc8;
    use proptest::prelude::*;

    #[test]
    fn the_check_value() {
        assert_eq!(crc8(b"123456789"), 0xBC);
    }

    proptest! {
        #[test]
        fn as_by_the_polynomial(bytes in prop::collection::vec(any::<u8>(), 0..70)) {
            let by_bit = bytes.iter().fold(0_u8, |crc, byte| {
                (0..8).fold(crc ^ byte, |crc, _| crc << 1 ^ if crc & 0x80 == 0 { 0 } else { 0xD5 })
            });
            prop_assert_eq!(crc8(&bytes), by_bit);
        }
    }
}
