//! Messages → frames.

use super::frame::{LONGEST, SIGNED, STX_2};
use super::signing::Signer;
use crate::crc16::crc16;
use mavlink::{MAVLinkV1MessageRaw, MAVLinkV2MessageRaw, MavHeader, MavlinkVersion, Message};
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

    /// The frame of a message by its number and fields, in version 2: for values that the dialect's types do not have, such as the
    /// acknowledgement of a command that it does not know. `None` when the payload is too long.
    ///
    /// ```
    /// use stampfly_link::mavlink::dialects::common::MavMessage;
    /// use stampfly_link::mavlink::{LONGEST, MavlinkWriter};
    /// // COMMAND_ACK: command 31000, unsupported.
    /// let ([low, high], mut buffer) = (31_000_u16.to_le_bytes(), [0; LONGEST]);
    /// let frame = MavlinkWriter::new(1, 1).write_payload::<MavMessage>(77, &[low, high, 3, 0, 0, 0, 0, 0, 0, 0], &mut buffer);
    /// assert_eq!(frame.map(<[u8]>::len), Some(10 + 3 + 2), "without the zeros at its end");
    /// ```
    pub fn write_payload<'b, M: Message>(
        &mut self,
        id: u32,
        payload: &[u8],
        buffer: &'b mut [u8; LONGEST],
    ) -> Option<&'b [u8]> {
        // Zeros at the end are left out, but for the first byte.
        let length = payload.iter().rposition(|byte| *byte != 0).map_or(1, |last| last + 1).min(payload.len());
        let [i0, i1, i2, _] = id.to_le_bytes();
        let (system, component) = (self.system, self.component);
        let header = [STX_2, u8::try_from(length).ok()?, 0, 0, self.sequence, system, component, i0, i1, i2];
        let checked = header.len() + length;
        put(buffer, &header)?;
        put(buffer.get_mut(header.len()..)?, payload.get(..length)?)?;
        let crc = crc16(buffer.get(1..checked)?, M::extra_crc(id)).to_le_bytes();
        put(buffer.get_mut(checked..)?, &crc)?;
        self.sequence = self.sequence.wrapping_add(1);
        buffer.get(..checked + crc.len())
    }

    /// The same as [`write`](Self::write), signed, in version 2.
    pub fn write_signed<'b, M: Message>(
        &mut self,
        now: Instant,
        message: &M,
        signer: &mut Signer,
        buffer: &'b mut [u8; LONGEST],
    ) -> Option<&'b [u8]> {
        let length = self.write(MavlinkVersion::V2, message, buffer)?.len();
        sign::<M>(now, message.message_id(), signer, buffer, length)
    }

    /// The same as [`write_payload`](Self::write_payload), signed.
    pub fn write_payload_signed<'b, M: Message>(
        &mut self,
        now: Instant,
        id: u32,
        payload: &[u8],
        signer: &mut Signer,
        buffer: &'b mut [u8; LONGEST],
    ) -> Option<&'b [u8]> {
        let length = self.write_payload::<M>(id, payload, buffer)?.len();
        sign::<M>(now, id, signer, buffer, length)
    }
}

/// Signs the frame of `length` bytes at the front.
fn sign<'b, M: Message>(
    now: Instant,
    id: u32,
    signer: &mut Signer,
    buffer: &'b mut [u8; LONGEST],
    length: usize,
) -> Option<&'b [u8]> {
    // The checksum is over the flag that says that a signature follows.
    *buffer.get_mut(2)? |= SIGNED;
    let crc = crc16(buffer.get(1..length.checked_sub(2)?)?, M::extra_crc(id));
    *buffer.get_mut(..length)?.last_chunk_mut()? = crc.to_le_bytes();
    let signature = signer.sign(now, buffer.get(..length)?).to_bytes();
    let end = length + signature.len();
    buffer.get_mut(length..end)?.copy_from_slice(&signature);
    buffer.get(..end)
}

fn put(buffer: &mut [u8], bytes: &[u8]) -> Option<usize> {
    buffer.get_mut(..bytes.len())?.copy_from_slice(bytes);
    Some(bytes.len())
}
