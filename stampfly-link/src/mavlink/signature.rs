//! What stands at the end of a signed frame: link, time, and the beginning of a hash.

/// What stands at the end of a signed frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signature {
    /// Which of the sender's links.
    pub link: u8,
    /// In units of 10 µs.
    pub time: u64,
    /// The beginning of the hash.
    pub digest: [u8; 6],
}

impl Signature {
    /// Bytes of it.
    pub const LENGTH: usize = 13;

    pub(super) fn read(bytes: &[u8; Self::LENGTH]) -> Self {
        let [link, t0, t1, t2, t3, t4, t5, digest @ ..] = *bytes;
        Self { link, time: u64::from_le_bytes([t0, t1, t2, t3, t4, t5, 0, 0]), digest }
    }

    /// As it is sent.
    #[must_use]
    pub fn to_bytes(self) -> [u8; Self::LENGTH] {
        let [t0, t1, t2, t3, t4, t5] = time_bytes(self.time);
        let [d0, d1, d2, d3, d4, d5] = self.digest;
        [self.link, t0, t1, t2, t3, t4, t5, d0, d1, d2, d3, d4, d5]
    }
}

/// A time as it travels: 48 bits.
pub(super) fn time_bytes(time: u64) -> [u8; 6] {
    let [a, b, c, d, e, f, ..] = time.to_le_bytes();
    [a, b, c, d, e, f]
}
