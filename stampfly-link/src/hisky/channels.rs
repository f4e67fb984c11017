//! Sticks and switches: eight channels of ten bits.
//!
//! | byte | what |
//! |---|---|
//! | 0 to 7 | low 8 bits of channels 1 to 8 |
//! | 8 | high 2 bits of channels 1 to 4, the first in the lowest |
//! | 9 | high 2 bits of channels 5 to 8 |

use super::PAYLOAD;

/// The end of a stick's travel.
const MAX: u16 = 1000;

/// Channels as they travel, 0 to 1000 each: aileron, elevator, throttle, rudder, gear, pitch, gyro, and one more. Elevator and throttle are the
/// wrong way round: 1000 is a throttle that is down.
///
/// ```
/// use stampfly_link::hisky::HiskyChannels;
/// let channels = HiskyChannels([500, 500, 1000, 500, 0, 0, 0, 0]);
/// assert_eq!(HiskyChannels::decode(&channels.to_bytes()), channels);
/// let [roll, pitch, yaw, throttle, ..] = channels.values();
/// assert_eq!([roll, pitch, yaw, throttle], [0.5, 0.5, 0.5, 0.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HiskyChannels(pub [u16; 8]);

impl HiskyChannels {
    /// Reads a packet. Any ten bytes are one, because nothing but the radio's CRC is checked; what is beyond 1000 is 1000.
    #[must_use]
    pub fn decode(packet: &[u8; PAYLOAD]) -> Self {
        let [low @ .., first, second] = packet;
        let mut high = u16::from_le_bytes([*first, *second]);
        Self(low.map(|low| {
            let channel = (high & 3) << 8 | u16::from(low);
            high >>= 2;
            channel.min(MAX)
        }))
    }

    /// Writes it. Of what is beyond 1000, 1000.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; PAYLOAD] {
        let mut packet = [0; PAYLOAD];
        let [low @ .., first, second] = &mut packet;
        let mut high = 0_u16;
        for (place, channel) in low.iter_mut().zip(self.0).rev() {
            let channel = channel.min(MAX);
            *place = channel as u8;
            high = high << 2 | channel >> 8;
        }
        [*first, *second] = high.to_le_bytes();
        packet
    }

    /// Roll, pitch, yaw, throttle, gear, pitch, gyro and one more, 0 to 1 each, the right way round: a throttle that is down is 0.
    #[must_use]
    pub fn values(&self) -> [f32; 8] {
        let [aileron, elevator, throttle, rudder, gear, pitch, gyro, more] = self.0.map(|channel| channel.min(MAX));
        [aileron, MAX - elevator, rudder, MAX - throttle, gear, pitch, gyro, more]
            .map(|channel| f32::from(channel) / f32::from(MAX))
    }
}
