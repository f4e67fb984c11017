//! Little-endian numbers of packets, one after the other. For packets whose length has been looked at: past the end everything is zero, and
//! nothing is written.

use stampfly_types::Vec3;

/// Takes numbers off the front.
pub struct Fields<'b>(pub &'b [u8]);

impl Fields<'_> {
    pub fn array<const N: usize>(&mut self) -> [u8; N] {
        let (taken, rest) = self.0.split_first_chunk().unwrap_or((&[0; N], &[]));
        self.0 = rest;
        *taken
    }

    pub fn u8(&mut self) -> u8 {
        let [byte] = self.array();
        byte
    }

    pub fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.array())
    }

    pub fn i16(&mut self) -> i16 {
        i16::from_le_bytes(self.array())
    }

    pub fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.array())
    }

    pub fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.array())
    }

    pub fn vector(&mut self) -> Vec3 {
        Vec3::from_fn(|_| self.f32())
    }
}

/// Puts numbers into the front.
pub struct Places<'b>(pub &'b mut [u8]);

impl Places<'_> {
    pub fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        if let Some((place, rest)) = core::mem::take(&mut self.0).split_first_chunk_mut() {
            *place = bytes;
            self.0 = rest;
        }
    }

    pub fn u16(&mut self, value: u16) {
        self.put(value.to_le_bytes());
    }

    pub fn i16(&mut self, value: i16) {
        self.put(value.to_le_bytes());
    }

    pub fn u32(&mut self, value: u32) {
        self.put(value.to_le_bytes());
    }

    pub fn f32(&mut self, value: f32) {
        self.put(value.to_le_bytes());
    }

    pub fn vector(&mut self, vector: &Vec3) {
        vector.iter().for_each(|value| self.f32(*value));
    }
}

/// The check of packets that have one: all bytes before it, combined by exclusive or.
pub fn exclusive_or(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |all, byte| all ^ byte)
}
