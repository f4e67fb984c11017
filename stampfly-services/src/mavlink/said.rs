//! What is to be sent: a message as its number and bytes.
//!
//! Each message is written by its own type. The dialect's enum would write it with code for all two hundred.

use stampfly_link::mavlink::{MavlinkVersion, MessageData};

/// Bytes of the longest payload.
const LONGEST: usize = 255;

/// A message that is to be sent, in version 2.
#[derive(Clone, Debug)]
pub(super) struct Said {
    pub id: u32,
    length: usize,
    payload: [u8; LONGEST],
}

impl<D: MessageData> From<D> for Said {
    // One frame on the stack for a message's fields, where it is made, is enough.
    #[inline(never)]
    fn from(data: D) -> Self {
        let mut payload = [0; LONGEST];
        let length = data.ser(MavlinkVersion::V2, &mut payload);
        Self { id: D::ID, length, payload }
    }
}

impl Said {
    /// Its fields.
    pub fn payload(&self) -> &[u8] {
        self.payload.get(..self.length).unwrap_or_default()
    }
}
