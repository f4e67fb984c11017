//! A check sum for what goes over lines that garble: CRC-32 (ISO-HDLC: polynomial 0x04C11DB7, reflected). No protection from people.

/// CRC-32, four bits at a time: sixteen words of table instead of a kilobyte.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crc(u32);

impl Crc {
    pub(crate) const START: Self = Self(u32::MAX);
    const TABLE: [u32; 16] = {
        let (mut table, mut nibble) = ([0; 16], 0);
        while nibble < 16 {
            let (mut value, mut bit) = (nibble as u32, 0);
            while bit < 4 {
                value = if value & 1 == 0 { value >> 1 } else { value >> 1 ^ 0xEDB8_8320 };
                bit += 1;
            }
            table[nibble] = value;
            nibble += 1;
        }
        table
    };

    pub(crate) fn add(&mut self, byte: u8) {
        self.0 ^= u32::from(byte);
        for _ in 0..2 {
            let [entry, ..] = self.0.to_le_bytes();
            self.0 = self.0 >> 4 ^ Self::TABLE.get(usize::from(entry & 0xf)).copied().unwrap_or_default();
        }
    }

    pub(crate) fn finish(self) -> u32 {
        !self.0
    }
}
