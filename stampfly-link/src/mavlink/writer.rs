//! Messages → frames.

use super::frame::{LONGEST, SIGNED};
use super::signing::Signer;
use mavlink::{MAVLinkV1MessageRaw, MAVLinkV2MessageRaw, MavHeader, MavlinkVersion, Message, calculate_crc};
use stampfly_types::Instant;

/// Writes the frames of one sender, and counts them.
///
/// One for each line: a receiver tells from the count how many frames the line has lost. See [`MavlinkDecoder`](super::MavlinkDecoder) for an example.
#[derive(Clone, Debug)]
pub struct MavlinkWriter {
    system: u8,
    component: u8,
    sequence: u8,
}

impl MavlinkWriter {
    /// One for this system and component.
    #[must_use]
    pub const fn new(system: u8, component: u8) -> Self {
        Self { system, component, sequence: 0 }
    }

    /// The frame of a message. `None` for one that version 1 does not have.
    pub fn write<'b, M: Message>(
        &mut self,
        version: MavlinkVersion,
        message: &M,
        buffer: &'b mut [u8; LONGEST],
    ) -> Option<&'b [u8]> {
        let header = MavHeader { system_id: self.system.into(), component_id: self.component, sequence: self.sequence };
        let length = match version {
            MavlinkVersion::V1 if message.message_id() > 255 => return None,
            MavlinkVersion::V1 => {
                let mut raw = MAVLinkV1MessageRaw::new();
                raw.serialize_message(header, message);
                put(buffer, raw.raw_bytes())
            }
            MavlinkVersion::V2 => {
                let mut raw = MAVLinkV2MessageRaw::new();
                raw.serialize_message(header, message);
                put(buffer, raw.raw_bytes())
            }
        }?;
        self.sequence = self.sequence.wrapping_add(1);
        buffer.get(..length)
    }

    /// The same, signed, in version 2.
    pub fn write_signed<'b, M: Message>(
        &mut self,
        now: Instant,
        message: &M,
        signer: &mut Signer,
        buffer: &'b mut [u8; LONGEST],
    ) -> Option<&'b [u8]> {
        let length = self.write(MavlinkVersion::V2, message, buffer)?.len();
        // The checksum is over the flag that says that a signature follows.
        *buffer.get_mut(2)? |= SIGNED;
        let crc = calculate_crc(buffer.get(1..length.checked_sub(2)?)?, M::extra_crc(message.message_id()));
        *buffer.get_mut(..length)?.last_chunk_mut()? = crc.to_le_bytes();
        let signature = signer.sign(now, buffer.get(..length)?).to_bytes();
        let end = length + signature.len();
        buffer.get_mut(length..end)?.copy_from_slice(&signature);
        buffer.get(..end)
    }
}

fn put(buffer: &mut [u8], bytes: &[u8]) -> Option<usize> {
    buffer.get_mut(..bytes.len())?.copy_from_slice(bytes);
    Some(bytes.len())
}
