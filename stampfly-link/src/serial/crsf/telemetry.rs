//! Payloads of CRSF: what receiver and vehicle tell the pilot. Numbers are big-endian.

use stampfly_types::math;

/// How well the radio is heard, at both ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkStatistics {
    /// Strength at the receiver's two antennas, -dBm.
    pub up_strength: [u8; 2],
    /// Packets that arrived at the receiver, %.
    pub up_quality: u8,
    /// Signal to noise at the receiver, dB.
    pub up_noise: i8,
    /// The antenna that is used.
    pub antenna: u8,
    /// Packet rate, by the manufacturer's own number.
    pub mode: u8,
    /// The transmitter's power, by its number in the format's list: 0, 10, 25, 100, 500, 1000, 2000, 250, 50 mW.
    pub power: u8,
    /// Strength at the transmitter, -dBm.
    pub down_strength: u8,
    /// Packets that arrived at the transmitter, %.
    pub down_quality: u8,
    /// Signal to noise at the transmitter, dB.
    pub down_noise: i8,
}

impl LinkStatistics {
    pub(super) fn read(bytes: &[u8; 10]) -> Self {
        let [first, second, up_quality, up_noise, antenna, mode, power, down_strength, down_quality, down_noise] =
            *bytes;
        let (up_noise, down_noise) = (up_noise.cast_signed(), down_noise.cast_signed());
        Self {
            up_strength: [first, second],
            up_quality,
            up_noise,
            antenna,
            mode,
            power,
            down_strength,
            down_quality,
            down_noise,
        }
    }

    pub(super) fn to_bytes(self) -> [u8; 10] {
        let [first, second] = self.up_strength;
        [
            first,
            second,
            self.up_quality,
            self.up_noise.cast_unsigned(),
            self.antenna,
            self.mode,
            self.power,
            self.down_strength,
            self.down_quality,
            self.down_noise.cast_unsigned(),
        ]
    }
}

/// The battery, for the pilot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Battery {
    /// V, in steps of 0.1.
    pub voltage: f32,
    /// A, in steps of 0.1.
    pub current: f32,
    /// What was taken out of it, mAh, up to 16 777 215.
    pub used: u32,
    /// What is left, %.
    pub remaining: u8,
}

impl Battery {
    pub(super) fn read(bytes: &[u8; 8]) -> Self {
        let [v1, v0, a1, a0, used @ .., remaining] = *bytes;
        let tenths = |high, low| f32::from(u16::from_be_bytes([high, low])) / 10.0;
        let [high, middle, low] = used;
        Self {
            voltage: tenths(v1, v0),
            current: tenths(a1, a0),
            used: u32::from_be_bytes([0, high, middle, low]),
            remaining,
        }
    }

    pub(super) fn to_bytes(self) -> [u8; 8] {
        // What is no number is zero, what does not fit is the most.
        let tenths = |value: f32| (math::round(value * 10.0) as u16).to_be_bytes();
        let ([v1, v0], [a1, a0]) = (tenths(self.voltage), tenths(self.current));
        let [_, high, middle, low] = self.used.min(0xFF_FFFF).to_be_bytes();
        [v1, v0, a1, a0, high, middle, low, self.remaining]
    }
}

/// The attitude, for the pilot: rad, in steps of 0.0001, up to 3.2767 either way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Attitude {
    /// Nose up is positive.
    pub pitch: f32,
    /// Right wing down is positive.
    pub roll: f32,
    /// From north, clockwise is positive.
    pub yaw: f32,
}

impl Attitude {
    pub(super) fn read(bytes: &[u8; 6]) -> Self {
        let [p1, p0, r1, r0, y1, y0] = *bytes;
        let angle = |high, low| f32::from(i16::from_be_bytes([high, low])) / 10_000.0;
        Self { pitch: angle(p1, p0), roll: angle(r1, r0), yaw: angle(y1, y0) }
    }

    pub(super) fn to_bytes(self) -> [u8; 6] {
        let angle = |value: f32| (math::round(value * 10_000.0) as i16).to_be_bytes();
        let ([p1, p0], [r1, r0], [y1, y0]) = (angle(self.pitch), angle(self.roll), angle(self.yaw));
        [p1, p0, r1, r0, y1, y0]
    }
}

/// The flight mode's name, for the pilot: up to 15 visible characters. Transmitters show some ten of them.
///
/// ```
/// use stampfly_link::serial::crsf::FlightModeName;
/// assert_eq!(FlightModeName::new("ALT HOLD").map(|name| name.to_string()).as_deref(), Some("ALT HOLD"));
/// assert_eq!(FlightModeName::new("a name that is too long"), None);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FlightModeName {
    /// Zeros follow the name; the last byte is one.
    bytes: [u8; NAME + 1],
}

/// Characters of a flight mode's name.
const NAME: usize = 15;

impl FlightModeName {
    /// The most characters.
    pub const LONGEST: usize = NAME;

    /// A name; `None` when it is too long, or has characters other than visible ASCII ones and spaces.
    #[must_use]
    pub fn new(name: &str) -> Option<Self> {
        Self::of(name.as_bytes())
    }

    fn of(name: &[u8]) -> Option<Self> {
        let mut bytes = [0; NAME + 1];
        let places = bytes.get_mut(..NAME)?.get_mut(..name.len())?;
        places.iter_mut().zip(name).for_each(|(place, byte)| *place = *byte);
        name.iter().all(|byte| *byte == b' ' || byte.is_ascii_graphic()).then_some(Self { bytes })
    }

    /// What stands before the first zero.
    pub(super) fn read(payload: &[u8]) -> Option<Self> {
        Self::of(payload.split(|byte| *byte == 0).next()?)
    }

    /// The name and a zero.
    pub(super) fn terminated(&self) -> &[u8] {
        let length = self.bytes.iter().position(|byte| *byte == 0).unwrap_or(NAME);
        self.bytes.get(..=length).unwrap_or_default()
    }

    /// The name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        let name = self.terminated().split_last().map(|(_, name)| name).unwrap_or_default();
        core::str::from_utf8(name).unwrap_or_default()
    }
}

impl core::fmt::Display for FlightModeName {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Where the vehicle is, for the pilot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gps {
    /// 10⁻⁷ °, north is positive.
    pub latitude: i32,
    /// 10⁻⁷ °, east is positive.
    pub longitude: i32,
    /// Speed over ground, m/s, in steps of 0.1 km/h.
    pub speed: f32,
    /// Course over ground, rad from north, clockwise is positive; in steps of 0.01°.
    pub course: f32,
    /// Altitude, whole m from -1000.
    pub altitude: f32,
    /// Satellites that are used.
    pub satellites: u8,
}

/// 0.1 km/h in a m/s.
const SPEED_STEPS: f32 = 36.0;
/// 0.01° in a radian.
const COURSE_STEPS: f32 = 18_000.0 / core::f32::consts::PI;
/// 0.01° in a turn.
const TURN: f32 = 36_000.0;
/// What zero means, m.
const LOWEST: f32 = -1_000.0;

impl Gps {
    pub(super) fn read(bytes: &[u8; 15]) -> Self {
        let [a, b, c, d, e, f, g, h, s1, s0, c1, c0, h1, h0, satellites] = *bytes;
        let number = |high, low| f32::from(u16::from_be_bytes([high, low]));
        Self {
            latitude: i32::from_be_bytes([a, b, c, d]),
            longitude: i32::from_be_bytes([e, f, g, h]),
            speed: number(s1, s0) / SPEED_STEPS,
            course: number(c1, c0) / COURSE_STEPS,
            altitude: number(h1, h0) + LOWEST,
            satellites,
        }
    }

    pub(super) fn to_bytes(self) -> [u8; 15] {
        // What is no number is zero, what does not fit is at the limit.
        let number = |value: f32| (math::round(value) as u16).to_be_bytes();
        let course = math::round(self.course * COURSE_STEPS);
        let course = if course < 0.0 { course + TURN } else { course };
        let ([a, b, c, d], [e, f, g, h]) = (self.latitude.to_be_bytes(), self.longitude.to_be_bytes());
        let ([s1, s0], [c1, c0]) = (number(self.speed * SPEED_STEPS), number(course));
        let [h1, h0] = number(self.altitude - LOWEST);
        [a, b, c, d, e, f, g, h, s1, s0, c1, c0, h1, h0, self.satellites]
    }
}

/// How fast the vehicle climbs, for the pilot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vario {
    /// m/s, up is positive; in steps of 0.01, up to 327.67 either way.
    pub climb: f32,
}

impl Vario {
    pub(super) fn read(bytes: &[u8; 2]) -> Self {
        Self { climb: f32::from(i16::from_be_bytes(*bytes)) / 100.0 }
    }

    pub(super) fn to_bytes(self) -> [u8; 2] {
        (math::round(self.climb * 100.0) as i16).to_be_bytes()
    }
}
