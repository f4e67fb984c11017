//! The state: a line of text, ten times a second, from which programs take all that they do not ask for. djitellopy does not begin before it has
//! had one.

use super::reply::TelloReply;
use super::text::{self, Hundredths, whole};
use core::fmt;
use stampfly_types::Vec3;

/// The vehicle's state.
///
/// Numbers are rounded to what the line has room for; what is no number is zero. DJI's guide does not say in which frames velocities and forces
/// are; here they are in this stack's.
///
/// ```
/// use stampfly_link::tello::TelloState;
/// use stampfly_types::Vec3;
/// let state = TelloState { force: Vec3::new(0.0, 0.0, -9.80665), height: 0.52, battery: 87, ..Default::default() };
/// let line = state.to_string();
/// assert!(line.starts_with("pitch:0;roll:0;yaw:0;vgx:0;") && line.ends_with("agz:-1000.00;\r\n"));
/// assert!(line.contains(";h:52;bat:87;"));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TelloState {
    /// Roll, pitch, yaw, rad.
    pub attitude: Vec3,
    /// Velocity, world NED, m/s. Whole cm/s.
    pub velocity: Vec3,
    /// The coolest and the hottest temperature, °C.
    pub temperature: [i16; 2],
    /// Distance below, m. Whole cm.
    pub below: f32,
    /// Height above the take-off spot, m, up. Whole cm.
    pub height: f32,
    /// %.
    pub battery: u8,
    /// Height by the barometer, m, up. Whole cm.
    pub barometer: f32,
    /// Time in the air, s.
    pub time: u32,
    /// Specific force, body FRD, m/s². Thousandths of gravity.
    pub force: Vec3,
}

impl TelloState {
    /// Room for every line.
    pub const LONGEST: usize = 300;

    /// Writes it as it travels and returns how long it is; `None` when `out` is too short.
    #[must_use]
    pub fn write(&self, out: &mut [u8]) -> Option<usize> {
        text::write(self, out)
    }
}

impl fmt::Display for TelloState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let centi = |metres: f32| whole(metres * 1e2);
        let [x, y, z] = self.velocity.to_array().map(centi);
        let [low, high] = self.temperature;
        TelloReply::Attitude(self.attitude).fmt(f)?;
        write!(f, "vgx:{x};vgy:{y};vgz:{z};templ:{low};temph:{high};")?;
        write!(f, "tof:{};h:{};bat:{};", centi(self.below), centi(self.height), self.battery)?;
        write!(f, "baro:{};time:{};", Hundredths(self.barometer), self.time)?;
        write!(f, "{}\r\n", TelloReply::Acceleration(self.force))
    }
}
