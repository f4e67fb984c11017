//! Control packet: sticks and switches, from the transmitter to one vehicle, 50 times a second.
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | 3 × u8 | last three bytes of the vehicle's address |
//! | 3 | u16 | throttle, 0 to 4095, up counts up |
//! | 5 | u16 | roll, right counts up |
//! | 7 | u16 | pitch, back counts up |
//! | 9 | u16 | yaw, right counts up |
//! | 11 | u8 | switches: 0 arm, 1 flip, 2 acro, 3 hold height, 4 hold place |
//! | 12 | u8 | reserved, not looked at |
//! | 13 | u8 | sum of the bytes before, modulo 256 |
//!
//! Little-endian. The sticks are the transmitter's 12-bit conversions, 2048 when let go. The transmitter turns the
//! throttle round so that up counts up and leaves the others as its potentiometers are, hence the sign of pitch. A
//! document of the ecosystem has sticks from 0 to 1000; no transmitter sends them.

use crate::{Address, checksum};
use stampfly_types::messages::{FlightMode, PilotInput, stick};

const CENTRE: u16 = 2048;
const MAX: u16 = 4095;

const ARM: u8 = 1;
const FLIP: u8 = 1 << 1;
const ACRO: u8 = 1 << 2;
const HOLD_HEIGHT: u8 = 1 << 3;
const HOLD_PLACE: u8 = 1 << 4;

/// Sticks and switches as they travel.
///
/// ```
/// use stampfly_link::{Address, ControlError, ControlPacket};
/// let vehicle = Address([1, 2, 3, 4, 5, 6]);
/// let mut bytes = ControlPacket { arm: true, ..ControlPacket::centred(vehicle) }.to_bytes();
/// assert!(ControlPacket::decode(&bytes, vehicle)?.arm);
/// bytes[7] ^= 1;
/// assert_eq!(ControlPacket::decode(&bytes, vehicle), Err(ControlError::Checksum));
/// # Ok::<(), ControlError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControlPacket {
    /// Last three bytes of the vehicle's address.
    pub vehicle: [u8; 3],
    /// 0 to 4095, up counts up.
    pub throttle: u16,
    /// 0 to 4095, right counts up.
    pub roll: u16,
    /// 0 to 4095, back counts up.
    pub pitch: u16,
    /// 0 to 4095, right counts up.
    pub yaw: u16,
    /// Arm switch.
    pub arm: bool,
    /// Flip button. This stack does not flip.
    pub flip: bool,
    /// Sticks command rates.
    pub acro: bool,
    /// Hold height.
    pub hold_height: bool,
    /// Hold place. Wins over the two above.
    pub hold_place: bool,
}

/// Why bytes are no control packet for this vehicle, in the order it is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ControlError {
    /// Not 14 bytes.
    Length,
    /// Meant for another vehicle.
    OtherVehicle,
    /// The sum is wrong.
    Checksum,
    /// A stick beyond 4095.
    Range,
    /// A switch nobody knows.
    Switches,
}

impl core::fmt::Display for ControlError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Length => "not the length of a control packet",
            Self::OtherVehicle => "meant for another vehicle",
            Self::Checksum => "wrong checksum",
            Self::Range => "a stick beyond its range",
            Self::Switches => "an unknown switch",
        })
    }
}

impl core::error::Error for ControlError {}

impl ControlPacket {
    /// Length on the air.
    pub const LENGTH: usize = 14;

    /// Sticks let go, switches off.
    #[must_use]
    pub const fn centred(vehicle: Address) -> Self {
        Self {
            vehicle: vehicle.tail(),
            throttle: CENTRE,
            roll: CENTRE,
            pitch: CENTRE,
            yaw: CENTRE,
            arm: false,
            flip: false,
            acro: false,
            hold_height: false,
            hold_place: false,
        }
    }

    /// Reads a packet for this vehicle.
    ///
    /// # Errors
    /// When it is none, or not for this vehicle; nothing of it may be used then.
    pub fn decode(bytes: &[u8], vehicle: Address) -> Result<Self, ControlError> {
        let bytes: &[u8; Self::LENGTH] = bytes.try_into().map_err(|_| ControlError::Length)?;
        let &[a, b, c, t0, t1, r0, r1, p0, p1, y0, y1, switches, _, sum] = bytes;
        if [a, b, c] != vehicle.tail() {
            return Err(ControlError::OtherVehicle);
        }
        let (body, _) = bytes.split_at(Self::LENGTH - 1);
        if checksum(body) != sum {
            return Err(ControlError::Checksum);
        }
        let sticks = [[t0, t1], [r0, r1], [p0, p1], [y0, y1]].map(u16::from_le_bytes);
        if sticks.iter().any(|stick| *stick > MAX) {
            return Err(ControlError::Range);
        }
        if switches & !(ARM | FLIP | ACRO | HOLD_HEIGHT | HOLD_PLACE) != 0 {
            return Err(ControlError::Switches);
        }
        let [throttle, roll, pitch, yaw] = sticks;
        let on = |switch: u8| switches & switch != 0;
        Ok(Self {
            vehicle: [a, b, c],
            throttle,
            roll,
            pitch,
            yaw,
            arm: on(ARM),
            flip: on(FLIP),
            acro: on(ACRO),
            hold_height: on(HOLD_HEIGHT),
            hold_place: on(HOLD_PLACE),
        })
    }

    /// Writes it.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::LENGTH] {
        let [a, b, c] = self.vehicle;
        let [[t0, t1], [r0, r1], [p0, p1], [y0, y1]] =
            [self.throttle, self.roll, self.pitch, self.yaw].map(u16::to_le_bytes);
        let switches = [
            (self.arm, ARM),
            (self.flip, FLIP),
            (self.acro, ACRO),
            (self.hold_height, HOLD_HEIGHT),
            (self.hold_place, HOLD_PLACE),
        ];
        let switches = switches.iter().filter(|(on, _)| *on).fold(0, |all, (_, switch)| all | switch);
        let body = [a, b, c, t0, t1, r0, r1, p0, p1, y0, y1, switches, 0];
        let [a, b, c, d, e, f, g, h, i, j, k, l, m] = body;
        [a, b, c, d, e, f, g, h, i, j, k, l, m, checksum(&body)]
    }

    /// What the pilot means by it.
    #[must_use]
    pub fn pilot_input(&self) -> PilotInput {
        let mode = match (self.hold_place, self.hold_height, self.acro) {
            (true, ..) => FlightMode::PosHold,
            (_, true, _) => FlightMode::AltHold,
            (.., true) => FlightMode::Acro,
            _ => FlightMode::Stabilize,
        };
        PilotInput {
            roll: share(self.roll),
            pitch: -share(self.pitch),
            yaw: share(self.yaw),
            throttle: share(self.throttle),
            mode,
            arm: self.arm,
            kill: false,
        }
    }

    /// A packet that means this, to within a step of the sticks. There is no switch for the emergency stop: it is left
    /// out. Sticks that are not finite count as let go; others are clamped to ±1.
    #[must_use]
    pub fn from_pilot(vehicle: Address, input: &PilotInput) -> Self {
        // A mode without a bit of its own would arrive as STABILIZE, in which throttle is thrust.
        let [acro, hold_height, hold_place] = match input.mode {
            FlightMode::Acro => [true, false, false],
            FlightMode::Stabilize => [false; 3],
            FlightMode::AltHold => [false, true, false],
            FlightMode::PosHold => [false, false, true],
        };
        Self {
            vehicle: vehicle.tail(),
            throttle: counts(input.throttle),
            roll: counts(input.roll),
            pitch: counts(-input.pitch),
            yaw: counts(input.yaw),
            arm: input.arm,
            flip: false,
            acro,
            hold_height,
            hold_place,
        }
    }
}

/// Counts to a share of the deflection: both ends are ±1 and the centre is zero, although one side has a step more.
fn share(counts: u16) -> f32 {
    let offset = f32::from(counts) - f32::from(CENTRE);
    offset / f32::from(if counts > CENTRE { MAX - CENTRE } else { CENTRE })
}

fn counts(share: f32) -> u16 {
    let share = stick(share);
    let steps = share * f32::from(if share > 0.0 { MAX - CENTRE } else { CENTRE });
    // Between 0 and 4095; the half rounds, because `as` cuts off.
    (f32::from(CENTRE) + steps + 0.5) as u16
}
