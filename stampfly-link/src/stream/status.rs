//! Status packet: battery, state and gains, once a second.
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | u8 | 0x4F |
//! | 1 | u16 | counter of packets |
//! | 3 | u8 | 1 |
//! | 4 | u32 | time since power-on, ms |
//! | 8 | f32 | battery, V |
//! | 12 | 4 × u8 | state, sensors that are well, state of the estimator, why it was started |
//! | 16 | 9 × f32 | gains |
//! | 52 | f32 | current, mA |
//! | last | u8 | exclusive or of all before |
//!
//! New fields came at the end: the oldest packets have 17 bytes and no gains, those after them 53 and no current, and the present ones 57. The length
//! alone tells which it is.

use super::packet::{StreamError, open};
use crate::fields::{Fields, Places, exclusive_or};

const STATUS: u8 = 0x4F;
const OLDEST: usize = 17;
const WITH_GAINS: usize = 53;
const PRESENT: usize = 57;

/// Battery, state and gains.
///
/// ```
/// use stampfly_link::stream::{StreamGains, StreamStatus};
/// let told = StreamStatus { voltage: 3.9, gains: Some(StreamGains::default()), ..Default::default() };
/// let mut bytes = [0; StreamStatus::LONGEST];
/// let length = told.write(&mut bytes).expect("there is room");
/// assert_eq!((length, StreamStatus::decode(&bytes[..length])), (53, Ok(told)));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamStatus {
    /// Counts packets, wraps around.
    pub sequence: u16,
    /// Time since power-on, ms. Wraps around after 49.7 days.
    pub uptime: u32,
    /// Battery voltage, V.
    pub voltage: f32,
    /// The vehicle's state, by its firmware's number.
    pub state: u8,
    /// A bit for each sensor that is well.
    pub health: u8,
    /// Bit 0: the estimator is running.
    pub estimator: u8,
    /// Why the vehicle was started, by the number of Espressif's library: 1 power, 3 software, 4 panic, 5 and 6 watchdogs, 9 brown-out.
    pub reset_reason: u8,
    /// Gains, and what came after them; not in the oldest packets.
    pub gains: Option<StreamGains>,
}

/// Gains of the rate controllers, and what came after them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamGains {
    /// Roll, pitch and yaw: proportional gain, integral time in s, derivative time in s.
    pub rate: [[f32; 3]; 3],
    /// Battery current, mA; not in older packets.
    pub current: Option<f32>,
}

impl StreamStatus {
    /// Length of the present version.
    pub const LONGEST: usize = PRESENT;

    /// Writes it and returns how long it is; `None` when `out` is too short.
    #[must_use]
    pub fn write(&self, out: &mut [u8]) -> Option<usize> {
        let length = match &self.gains {
            None => OLDEST,
            Some(StreamGains { current: None, .. }) => WITH_GAINS,
            Some(_) => PRESENT,
        };
        let (check, before) = out.get_mut(..length)?.split_last_mut()?;
        let mut places = Places(before);
        places.put([STATUS]);
        places.u16(self.sequence);
        places.put([1]);
        places.u32(self.uptime);
        places.f32(self.voltage);
        places.put([self.state, self.health, self.estimator, self.reset_reason]);
        if let Some(gains) = &self.gains {
            let numbers = gains.rate.iter().flatten().chain(&gains.current);
            numbers.for_each(|number| places.f32(*number));
        }
        *check = exclusive_or(before);
        Some(length)
    }

    /// Reads it, each of its three lengths.
    ///
    /// # Errors
    /// When it is none.
    pub fn decode(bytes: &[u8]) -> Result<Self, StreamError> {
        let (with_gains, with_current) = match bytes.len() {
            OLDEST => (false, false),
            WITH_GAINS => (true, false),
            PRESENT => (true, true),
            _ => return Err(StreamError::Length),
        };
        let (sequence, rest) = open(bytes, STATUS, 1)?;
        let mut fields = Fields(rest);
        let (uptime, voltage) = (fields.u32(), fields.f32());
        let [state, health, estimator, reset_reason] = fields.array();
        let gains = with_gains.then(|| StreamGains {
            rate: [[(); 3]; 3].map(|axis| axis.map(|()| fields.f32())),
            current: with_current.then(|| fields.f32()),
        });
        Ok(Self { sequence, uptime, voltage, state, health, estimator, reset_reason, gains })
    }
}
