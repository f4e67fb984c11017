//! The last seconds of a compact record in memory, dropped from one key frame to the next.

use heapless::Deque;

/// Takes the bytes of a compact record.
pub trait Store {
    /// A part begins that can be read by itself: a key frame of so many bytes comes next. Returns whether it has room for it.
    fn begin(&mut self, bytes: usize) -> bool;

    /// Takes the next bytes. Returns whether it did; if not, it gets no more until the next [`begin`](Self::begin).
    fn put(&mut self, bytes: &[u8]) -> bool;
}

/// Most parts that are in a ring at a time.
const PARTS: usize = 32;

/// A ring: when it is full, the oldest part goes.
///
/// ```
/// use stampfly_flight::compact::{Ring, Store};
/// let mut memory = [0; 4];
/// let mut ring = Ring::new(&mut memory);
/// for byte in 1..=5 {
///     assert!(ring.begin(1) && ring.put(&[byte]));
/// }
/// assert_eq!(ring.bytes().collect::<Vec<_>>(), [2, 3, 4, 5]);
/// ```
#[derive(Debug)]
pub struct Ring<'m> {
    memory: &'m mut [u8],
    /// Where each part begins, in bytes since the first. Wrapping is more than a century away.
    parts: Deque<u64, PARTS>,
    end: u64,
    /// Where the next byte goes: a remainder of 64 bits costs a small core hundreds of instructions.
    place: usize,
    /// Has it taken everything since the last part began?
    is_whole: bool,
}

impl<'m> Ring<'m> {
    /// With nothing in it.
    pub const fn new(memory: &'m mut [u8]) -> Self {
        Self { memory, parts: Deque::new(), end: 0, place: 0, is_whole: false }
    }

    /// Bytes in it.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parts.front().map_or(0, |begin| (self.end - begin) as usize)
    }

    /// Is nothing in it?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes it has taken so far, those that have gone included.
    #[must_use]
    pub const fn taken(&self) -> u64 {
        self.end
    }

    /// What is in it, oldest first.
    pub fn bytes(&self) -> impl Iterator<Item = u8> {
        let (length, size) = (self.len() as u64, self.memory.len().max(1) as u64);
        (self.end - length..self.end).filter_map(move |place| self.memory.get((place % size) as usize).copied())
    }

    /// Makes room, if it can without the part that grows.
    fn has_room(&mut self, bytes: usize) -> bool {
        while self.len() + bytes > self.memory.len() {
            if self.parts.len() < 2 {
                return false;
            }
            self.parts.pop_front();
        }
        true
    }
}

impl Store for Ring<'_> {
    fn begin(&mut self, bytes: usize) -> bool {
        if self.parts.is_full() {
            self.parts.pop_front();
        }
        self.is_whole = bytes <= self.memory.len() && self.parts.push_back(self.end).is_ok() && self.has_room(bytes);
        self.is_whole
    }

    fn put(&mut self, bytes: &[u8]) -> bool {
        self.is_whole = self.is_whole && self.has_room(bytes.len());
        if !self.is_whole {
            return false;
        }
        let size = self.memory.len();
        let (now, later) = bytes.split_at_checked(size - self.place).unwrap_or((bytes, &[]));
        for (at, part) in [(self.place, now), (0, later)] {
            if let Some(into) = self.memory.get_mut(at..at + part.len()) {
                into.copy_from_slice(part);
            }
        }
        self.place = if later.is_empty() { self.place + now.len() } else { later.len() };
        self.end += bytes.len() as u64;
        true
    }
}
