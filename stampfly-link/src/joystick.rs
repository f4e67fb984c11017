//! Joystick packet: what M5Stack's own transmitter for the StampFly sends, 100 times a second. For a vehicle that is to be flown with that
//! transmitter as it is sold; the ecosystem's transmitters send a [`ControlPacket`](crate::ControlPacket).
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | 3 × u8 | last three bytes of the vehicle's address |
//! | 3 | f32 | rudder, right counts up |
//! | 7 | f32 | throttle, up counts up |
//! | 11 | f32 | aileron, right counts up |
//! | 15 | f32 | elevator, back counts up |
//! | 19 | u8 | button for take-off and landing, 1 for 0.2 s after it was pressed |
//! | 20 | u8 | button for a flip, 1 while it is down |
//! | 21 | u8 | 0 sticks command angles, 1 rates |
//! | 22 | u8 | 4 height is held, 5 it is not |
//! | 23 | u8 | 1 for 0.2 s when the vehicle is to take its attitude as level |
//! | 24 | u8 | sum of the bytes before, modulo 256 |
//!
//! Little-endian. A stick is the distance of a 12-bit conversion from where it rested when the button was pressed last, divided by 2048. So it
//! is within ±1 but for that offset, and never beyond ±2: what is beyond it no transmitter has sent. From `src/rc.cpp` of
//! `m5stack/M5StampFly` and `examples/StampFlyController` of `m5stack/Atom-JoyStick`. It calls for its vehicle with the
//! [`PairingPacket`](crate::PairingPacket).

use crate::fields::{Fields, Places};
use crate::{Address, checksum};
use stampfly_types::messages::{FlightMode, PilotInput, stick};

/// The farthest that a stick can be from where it rested.
const MOST: f32 = 2.0;
const HEIGHT_HELD: u8 = 4;
const HEIGHT_FREE: u8 = 5;

/// Sticks and buttons as they travel.
///
/// ```
/// use stampfly_link::{Address, JoystickError, JoystickPacket};
/// let vehicle = Address([1, 2, 3, 4, 5, 6]);
/// let sent = JoystickPacket { throttle: 0.5, elevator: -1.0, ..JoystickPacket::centred(vehicle) };
/// let mut bytes = sent.to_bytes();
/// let input = JoystickPacket::decode(&bytes, vehicle)?.pilot_input(false);
/// assert_eq!((input.throttle, input.pitch), (0.5, 1.0));
/// bytes[8] ^= 1;
/// assert_eq!(JoystickPacket::decode(&bytes, vehicle), Err(JoystickError::Checksum));
/// # Ok::<(), JoystickError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JoystickPacket {
    /// Last three bytes of the vehicle's address.
    pub vehicle: [u8; 3],
    /// -2 to 2, right counts up.
    pub rudder: f32,
    /// -2 to 2, up counts up.
    pub throttle: f32,
    /// -2 to 2, right counts up.
    pub aileron: f32,
    /// -2 to 2, back counts up.
    pub elevator: f32,
    /// The button for take-off and landing was pressed within the last 0.2 s. See [`ArmButton`].
    pub arm: bool,
    /// The button for a flip is down.
    pub flip: bool,
    /// Sticks command rates.
    pub rates: bool,
    /// Height is held.
    pub hold_height: bool,
    /// The vehicle is to take its attitude as level. This stack does not.
    pub level: bool,
}

/// Why bytes are no joystick packet for this vehicle, in the order it is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum JoystickError {
    /// Not 25 bytes.
    Length,
    /// The sum is wrong.
    Checksum,
    /// Meant for another vehicle.
    OtherVehicle,
    /// A stick that is no number, or beyond ±2.
    Range,
    /// A button or a mode that no transmitter has.
    Content,
}

impl core::fmt::Display for JoystickError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Length => "not the length of a joystick packet",
            Self::Checksum => "wrong checksum",
            Self::OtherVehicle => "meant for another vehicle",
            Self::Range => "a stick that is no number or beyond its range",
            Self::Content => "an unknown button or mode",
        })
    }
}

impl core::error::Error for JoystickError {}

const fn button(byte: u8) -> Result<bool, JoystickError> {
    match byte {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(JoystickError::Content),
    }
}

impl JoystickPacket {
    /// Length on the air.
    pub const LENGTH: usize = 25;

    /// Sticks let go, no button pressed, height held: how the transmitter starts.
    #[must_use]
    pub const fn centred(vehicle: Address) -> Self {
        Self {
            vehicle: vehicle.tail(),
            rudder: 0.0,
            throttle: 0.0,
            aileron: 0.0,
            elevator: 0.0,
            arm: false,
            flip: false,
            rates: false,
            hold_height: true,
            level: false,
        }
    }

    /// Reads a packet for this vehicle.
    ///
    /// # Errors
    /// When it is none, or not for this vehicle; nothing of it may be used then.
    pub fn decode(bytes: &[u8], vehicle: Address) -> Result<Self, JoystickError> {
        let bytes: &[u8; Self::LENGTH] = bytes.try_into().map_err(|_| JoystickError::Length)?;
        let [body @ .., sum] = bytes;
        if checksum(body) != *sum {
            return Err(JoystickError::Checksum);
        }
        let mut fields = Fields(body);
        let tail: [u8; 3] = fields.array();
        if tail != vehicle.tail() {
            return Err(JoystickError::OtherVehicle);
        }
        let sticks = [(); 4].map(|()| fields.f32());
        // Not of what is no number, either.
        if !sticks.iter().all(|stick| stick.abs() <= MOST) {
            return Err(JoystickError::Range);
        }
        let [rudder, throttle, aileron, elevator] = sticks;
        let [arm, flip, rates, height, level] = fields.array();
        let hold_height = match height {
            HEIGHT_HELD => true,
            HEIGHT_FREE => false,
            _ => return Err(JoystickError::Content),
        };
        Ok(Self {
            vehicle: tail,
            rudder,
            throttle,
            aileron,
            elevator,
            arm: button(arm)?,
            flip: button(flip)?,
            rates: button(rates)?,
            hold_height,
            level: button(level)?,
        })
    }

    /// Writes it. A stick that is no number is written as one, and refused where it arrives.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::LENGTH] {
        let mut bytes = [0; Self::LENGTH];
        let [body @ .., sum] = &mut bytes;
        let mut places = Places(body);
        places.put(self.vehicle);
        [self.rudder, self.throttle, self.aileron, self.elevator].into_iter().for_each(|stick| places.f32(stick));
        let height = if self.hold_height { HEIGHT_HELD } else { HEIGHT_FREE };
        places.put([self.arm.into(), self.flip.into(), self.rates.into(), height, self.level.into()]);
        *sum = checksum(body);
        bytes
    }

    /// What the pilot means by it; sticks end at ±1. `arm` is where the pilot has the arm switch, which this transmitter has none of: see
    /// [`ArmButton`]. Holding height wins over commanding rates.
    #[must_use]
    pub fn pilot_input(&self, arm: bool) -> PilotInput {
        let mode = match (self.hold_height, self.rates) {
            (true, _) => FlightMode::AltHold,
            (_, true) => FlightMode::Acro,
            _ => FlightMode::Stabilize,
        };
        PilotInput {
            roll: stick(self.aileron),
            pitch: stick(-self.elevator),
            yaw: stick(self.rudder),
            throttle: stick(self.throttle),
            mode,
            arm,
            kill: false,
        }
    }
}

/// An arm switch made of a button: each press turns it over.
///
/// The transmitter says for 0.2 s that the button was pressed, in some 20 packets, so a press is seen although most of them are lost. A
/// button that is down in the first packet of all was pressed before anybody listened, and turns nothing over.
///
/// ```
/// use stampfly_link::ArmButton;
/// let mut switch = ArmButton::default();
/// let switched = [true, false, true, true, false, true].map(|down| switch.step(down));
/// assert_eq!(switched, [false, false, true, true, true, false]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArmButton {
    /// In the packet before.
    down: Option<bool>,
    arm: bool,
}

impl ArmButton {
    /// Takes [`arm`](JoystickPacket::arm) of the next packet and returns where the switch is.
    pub fn step(&mut self, down: bool) -> bool {
        if down && self.down == Some(false) {
            self.arm = !self.arm;
        }
        self.down = Some(down);
        self.arm
    }

    /// Turns the switch off, whatever the button does: the vehicle has stopped its motors by itself, or has not heard its pilot for too
    /// long. The next press arms.
    pub fn release(&mut self) {
        self.arm = false;
    }
}
