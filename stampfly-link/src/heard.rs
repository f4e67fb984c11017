//! The bytes that a decoder has heard and not made a frame of yet: oldest first, counted when they are given up.

/// Room for `N` bytes, which is the longest frame.
#[derive(Clone, Debug)]
pub struct Heard<const N: usize> {
    bytes: [u8; N],
    length: usize,
    discarded: u32,
}

impl<const N: usize> Heard<N> {
    pub const fn new() -> Self {
        Self { bytes: [0; N], length: 0, discarded: 0 }
    }

    /// Bytes so far that were part of no frame. Wraps around.
    pub const fn discarded(&self) -> u32 {
        self.discarded
    }

    #[inline]
    pub const fn is_full(&self) -> bool {
        self.length == N
    }

    #[inline]
    pub const fn len(&self) -> usize {
        self.length
    }

    #[inline]
    pub const fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// All of them.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// All of them, when they fill the room.
    pub const fn whole(&self) -> Option<&[u8; N]> {
        if self.is_full() { Some(&self.bytes) } else { None }
    }

    /// One more, and whether they fill the room now. Nothing happens when there is no room.
    #[inline]
    pub fn push(&mut self, byte: u8) -> bool {
        let Some(place) = self.bytes.get_mut(self.length) else { return true };
        *place = byte;
        self.length += 1;
        self.length == N
    }

    /// One more, unless it is the first or fills the room: says whether it was neither. Most bytes are, for one comparison.
    #[inline]
    pub fn put_inside(&mut self, byte: u8) -> bool {
        let is_inside = self.length.wrapping_sub(1) < N - 2;
        if let Some(place) = self.bytes.get_mut(self.length).filter(|_| is_inside) {
            *place = byte;
            self.length += 1;
        }
        is_inside
    }

    /// As many as there is room for, of `count` at most, off the front of `bytes`.
    pub fn fill(&mut self, count: usize, bytes: &mut &[u8]) {
        let room = self.bytes.get_mut(self.length..).unwrap_or_default();
        let count = count.min(room.len()).min(bytes.len());
        if let (Some(places), Some((taken, rest))) = (room.get_mut(..count), bytes.split_at_checked(count)) {
            places.copy_from_slice(taken);
            self.length += count;
            *bytes = rest;
        }
    }

    /// So many bytes that begin nothing, while there are no others.
    #[inline]
    pub const fn skip(&mut self, count: usize) {
        self.discarded = self.discarded.wrapping_add(count as u32);
    }

    /// The oldest were a frame.
    pub fn take(&mut self, count: usize) {
        // Nothing is left most of the time.
        let end = self.length.min(N);
        if count < end {
            self.bytes.copy_within(count..end, 0);
        }
        self.length = self.length.saturating_sub(count);
    }

    /// All of them were a frame.
    #[inline]
    pub const fn take_all(&mut self) {
        self.length = 0;
    }

    /// All of them are part of no frame.
    #[inline]
    pub const fn discard_all(&mut self) {
        self.skip(self.length);
        self.length = 0;
    }

    /// The oldest are part of no frame.
    pub fn discard(&mut self, count: usize) {
        self.take(count);
        self.skip(count);
    }
}
