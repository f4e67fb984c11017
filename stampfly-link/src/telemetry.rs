//! Telemetry packet: what the vehicle tells its pilot, 50 times a second.
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | u8 | AA |
//! | 1 | u8 | 01, the kind of packet |
//! | 2 | u8 | counter |
//! | 3 | u16 | battery, mV |
//! | 5 | i16 | height, cm, up |
//! | 7 | 3 × i16 | velocity north, east, down, mm/s |
//! | 13 | 3 × i16 | roll, pitch, yaw, 0.1° |
//! | 19 | u8 | state |
//! | 20 | u8 | warnings: 0 low battery, 1 sensor error, 2 link lost, 3 calibrating |
//! | 21 | u8 | sum of the bytes before, modulo 256 |
//!
//! Little-endian. Of the ecosystem's two documents on the last byte, this follows the one that agrees with the control
//! packet.

use crate::checksum;
use stampfly_types::Vec3;
use stampfly_types::messages::FlightPhase;

const MARK: u8 = 0xAA;
const KIND: u8 = 1;
const DEGREES: f32 = 180.0 / core::f32::consts::PI;

/// The vehicle's state as the transmitter shows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkState {
    /// Starting.
    #[default]
    Init = 0,
    /// Motors off.
    Idle = 1,
    /// Standing, motors may turn.
    Armed = 2,
    /// In the air.
    Flying = 3,
    /// Descending to the ground.
    Landing = 4,
    /// Out of order.
    Error = 5,
}

impl LinkState {
    const ALL: [Self; 6] = [Self::Init, Self::Idle, Self::Armed, Self::Flying, Self::Landing, Self::Error];
}

impl From<FlightPhase> for LinkState {
    fn from(phase: FlightPhase) -> Self {
        match phase {
            FlightPhase::Init => Self::Init,
            FlightPhase::IdleGround | FlightPhase::IdleHeld => Self::Idle,
            FlightPhase::Armed => Self::Armed,
            FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Flip => Self::Flying,
            FlightPhase::Landing => Self::Landing,
        }
    }
}

/// What the vehicle tells its pilot. Numbers the packet has no room for end at its limits; those that are none are zero.
///
/// ```
/// use stampfly_link::{LinkState, TelemetryPacket};
/// let told = TelemetryPacket { battery: 3.85, height: 1.2, state: LinkState::Flying, ..Default::default() };
/// let read = TelemetryPacket::decode(&told.to_bytes())?;
/// assert_eq!(read.state, LinkState::Flying);
/// assert!((read.battery - 3.85).abs() < 1e-3 && (read.height - 1.2).abs() < 1e-2);
/// # Ok::<(), stampfly_link::TelemetryError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TelemetryPacket {
    /// Counts packets, so that the other end sees what it has missed.
    pub counter: u8,
    /// Battery voltage, V.
    pub battery: f32,
    /// Height above the take-off spot, m, up.
    pub height: f32,
    /// Velocity, world NED, m/s.
    pub velocity: Vec3,
    /// Roll, pitch, yaw, rad.
    pub attitude: Vec3,
    /// State.
    pub state: LinkState,
    /// Battery at the warning level or below.
    pub low_battery: bool,
    /// A sensor the vehicle flies with is silent.
    pub sensor_error: bool,
    /// The vehicle has not heard its transmitter for too long.
    pub link_lost: bool,
    /// Still-calibration has not finished.
    pub calibrating: bool,
}

/// Why bytes are no telemetry packet, in the order it is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TelemetryError {
    /// Not 22 bytes.
    Length,
    /// Does not start with AA 01.
    Mark,
    /// The sum is wrong.
    Checksum,
    /// A state or a warning nobody knows.
    State,
}

impl core::fmt::Display for TelemetryError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Length => "not the length of a telemetry packet",
            Self::Mark => "not marked as a telemetry packet",
            Self::Checksum => "wrong checksum",
            Self::State => "an unknown state or warning",
        })
    }
}

impl core::error::Error for TelemetryError {}

impl TelemetryPacket {
    /// Length on the air.
    pub const LENGTH: usize = 22;

    /// Writes it.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::LENGTH] {
        let mut bytes = [0; Self::LENGTH];
        let [a, b] = unsigned(self.battery * 1e3).to_le_bytes();
        let [c, d] = signed(self.height * 1e2).to_le_bytes();
        let head = [MARK, KIND, self.counter, a, b, c, d];
        let vectors = [self.velocity * 1e3, self.attitude * (10.0 * DEGREES)];
        let vectors = vectors.iter().flat_map(|vector| vector.iter()).flat_map(|value| signed(*value).to_le_bytes());
        let warnings = [self.low_battery, self.sensor_error, self.link_lost, self.calibrating];
        let warnings = warnings.iter().rev().fold(0, |all, on| (all << 1) | u8::from(*on));
        let content = head.into_iter().chain(vectors).chain([self.state as u8, warnings]);
        for (place, byte) in bytes.iter_mut().zip(content) {
            *place = byte;
        }
        let [body @ .., sum] = &mut bytes;
        *sum = checksum(body);
        bytes
    }

    /// Reads it.
    ///
    /// # Errors
    /// When it is none.
    pub fn decode(bytes: &[u8]) -> Result<Self, TelemetryError> {
        let bytes: &[u8; Self::LENGTH] = bytes.try_into().map_err(|_| TelemetryError::Length)?;
        let [mark, kind, counter, b0, b1, h0, h1, vectors @ .., state, warnings, sum] = bytes;
        if (*mark, *kind) != (MARK, KIND) {
            return Err(TelemetryError::Mark);
        }
        let (body, _) = bytes.split_at(Self::LENGTH - 1);
        if checksum(body) != *sum {
            return Err(TelemetryError::Checksum);
        }
        let state = LinkState::ALL.get(usize::from(*state)).ok_or(TelemetryError::State)?;
        if *warnings & !0x0F != 0 {
            return Err(TelemetryError::State);
        }
        let mut values = vectors.chunks_exact(2).map(|pair| match pair {
            [low, high] => f32::from(i16::from_le_bytes([*low, *high])),
            _ => 0.0,
        });
        let mut vector = || Vec3::from_fn(|_| values.next().unwrap_or(0.0));
        let on = |bit: u8| *warnings & (1 << bit) != 0;
        Ok(Self {
            counter: *counter,
            battery: f32::from(u16::from_le_bytes([*b0, *b1])) / 1e3,
            height: f32::from(i16::from_le_bytes([*h0, *h1])) / 1e2,
            velocity: vector() / 1e3,
            attitude: vector() / (10.0 * DEGREES),
            state: *state,
            low_battery: on(0),
            sensor_error: on(1),
            link_lost: on(2),
            calibrating: on(3),
        })
    }
}

/// Rounded; `as` ends at the limits and makes zero of what is no number.
fn signed(value: f32) -> i16 {
    (value + 0.5f32.copysign(value)) as i16
}

fn unsigned(value: f32) -> u16 {
    (value + 0.5) as u16
}
