//! What a program is answered.

use super::command::TelloError;
use super::text::{self, Hundredths, whole};
use core::fmt;
use stampfly_types::Vec3;

/// A degree.
const DEGREES: f32 = 180.0 / core::f32::consts::PI;
/// Standard gravity.
const GRAVITY: f32 = 9.806_65;

/// An answer. It is as text what djitellopy reads as a number where it wants one: a Tello itself says `10dm` and `25s`, which djitellopy 2.5.0 cannot read.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum TelloReply<'t> {
    /// `ok`
    Ok,
    /// `error` and why it was not done.
    Error(&'t str),
    /// `error` and why it is no command.
    Refused(TelloError),
    /// A whole number.
    Number(i32),
    /// A distance in m: `801mm`.
    Distance(f32),
    /// Roll, pitch, yaw in rad: `pitch:0;roll:0;yaw:0;`.
    Attitude(Vec3),
    /// Specific force in m/s², body FRD: `agx:0.00;agy:0.00;agz:-1000.00;`, in thousandths of gravity.
    Acceleration(Vec3),
    /// A word, such as a serial number.
    Text(&'t str),
}

impl TelloReply<'_> {
    /// Room for every answer that has no text of the vehicle's own.
    pub const LONGEST: usize = 64;

    /// Writes it as it travels and returns how long it is; `None` when `out` is too short.
    #[must_use]
    pub fn write(&self, out: &mut [u8]) -> Option<usize> {
        text::write(self, out)
    }
}

impl fmt::Display for TelloReply<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ok => f.write_str("ok"),
            Self::Error(why) => write!(f, "error {why}"),
            Self::Refused(error) => write!(f, "error {error}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Distance(distance) => write!(f, "{}mm", whole(distance * 1e3)),
            Self::Attitude(attitude) => {
                let [roll, pitch, yaw] = attitude.to_array().map(|angle| whole(angle * DEGREES));
                write!(f, "pitch:{pitch};roll:{roll};yaw:{yaw};")
            }
            Self::Acceleration(force) => {
                let [x, y, z] = force.to_array().map(|axis| Hundredths(axis * (1e3 / GRAVITY)));
                write!(f, "agx:{x};agy:{y};agz:{z};")
            }
            Self::Text(word) => f.write_str(word),
        }
    }
}
