//! A flight record's place in memory: one page, which goes into a hash when it is full, as it would go into flash.

use core::convert::Infallible;
use stampfly_log::FlightHash;
use stampfly_log::ulog::Sink;
use stampfly_types::Micros;

/// A page of flash memory, bytes.
const PAGE: usize = 4096;

/// The page that is being filled, and the hash over those before it.
pub struct Memory {
    page: [u8; PAGE],
    used: usize,
    pages: u32,
    hash: FlightHash,
}

impl Memory {
    /// An empty page.
    pub fn new() -> Self {
        Self { page: [0; PAGE], used: 0, pages: 0, hash: FlightHash::new() }
    }

    /// Bytes written so far, and the hash over all of them.
    pub fn finish(&self) -> (usize, u64) {
        let mut hash = self.hash.clone();
        add(&mut hash, self.pages, self.page.get(..self.used).unwrap_or_default());
        (self.pages as usize * PAGE + self.used, hash.finish())
    }
}

impl Sink for Memory {
    type Error = Infallible;

    fn write(&mut self, mut bytes: &[u8]) -> Result<(), Infallible> {
        while !bytes.is_empty() {
            let room = self.page.get_mut(self.used..).unwrap_or_default();
            let (now, later) = bytes.split_at(bytes.len().min(room.len()));
            for (place, byte) in room.iter_mut().zip(now) {
                *place = *byte;
            }
            self.used += now.len();
            bytes = later;
            if self.used == PAGE {
                add(&mut self.hash, self.pages, &self.page);
                (self.pages, self.used) = (self.pages + 1, 0);
            }
        }
        Ok(())
    }
}

/// Takes a page, or what there is of one, as words; what is missing of the last is zero.
fn add(hash: &mut FlightHash, page: u32, bytes: &[u8]) {
    let (whole, rest) = bytes.as_chunks();
    let mut last = [0; 4];
    for (place, byte) in last.iter_mut().zip(rest) {
        *place = *byte;
    }
    let mut words = [0; PAGE / 4 + 1];
    for (word, bytes) in words.iter_mut().zip(whole.iter().chain([&last])) {
        *word = u32::from_le_bytes(*bytes);
    }
    hash.publish(bytes.len() as u16, page, Micros::ZERO, &words);
}
