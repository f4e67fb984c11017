//! Pulses for the speed controllers of brushless motors: a share of full speed to counts of a timer.
//!
//! Use it with a timer of ten bits that compares. Digital protocols (DShot) are not here.
//!
//! 1024 counts are a whole period. 502 are a stopped motor and 1004 a full one: at 3922 Hz, 125 and 250 µs (Oneshot125); at 490 Hz, 1 and 2 ms.

/// How pulses are sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Protocol {
    /// 125 to 250 µs, 3922 times a second.
    #[default]
    Oneshot125,
    /// 1 to 2 ms, 490 times a second, as servos have it.
    Pwm,
}

/// Counts in a period.
pub const PERIOD: u16 = 1024;
/// Counts of a motor that stands.
const STOPPED: u16 = 502;
/// And of how many more a motor that turns at full speed.
const SPAN: f32 = 502.0;

impl Protocol {
    /// Periods in a second, Hz.
    #[must_use]
    pub const fn frequency(self) -> u32 {
        match self {
            Self::Oneshot125 => 3_922,
            Self::Pwm => 490,
        }
    }

    /// How long this many counts are, µs.
    #[must_use]
    pub fn microseconds(self, counts: u16) -> f32 {
        f32::from(counts) * 1e6 / (f32::from(PERIOD) * self.frequency() as f32)
    }

    /// The share that a speed controller makes of a pulse of this length, µs: nothing below the shortest, all above the longest.
    #[must_use]
    pub fn share(self, microseconds: f32) -> f32 {
        let [stopped, full] = [STOPPED, STOPPED + SPAN as u16].map(|counts| self.microseconds(counts));
        ((microseconds - stopped) / (full - stopped)).clamp(0.0, 1.0)
    }
}

/// Counts of a share of full speed, 0 to 1; what is no number stands.
///
/// ```
/// use stampfly_control::esc::{Protocol, counts};
/// assert!((Protocol::Oneshot125.microseconds(counts(0.0)) - 125.0).abs() < 0.01);
/// assert!((Protocol::Pwm.microseconds(counts(1.0)) - 2_001.0).abs() < 1.0);
/// assert_eq!(counts(f32::NAN), counts(0.0));
/// ```
#[must_use]
pub fn counts(share: f32) -> u16 {
    // A conversion of what is no number is zero. It cuts off, as the original does.
    STOPPED + (SPAN * share.clamp(0.0, 1.0)) as u16
}
