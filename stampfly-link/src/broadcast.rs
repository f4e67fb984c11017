//! Broadcast packet: what a vehicle of the ecosystem tells every program on its network, by UDP to port 5005, 50 times a second. For displays
//! and plots; no flight depends on it, and a program that steers uses something that can be answered.
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | u16 | CAFE |
//! | 2 | u8 | version, 1 or 2 |
//! | 3 | u8 | 01, the kind of packet |
//! | 4 | u32 | time, µs |
//! | 8 | 3 × f32 | roll, pitch, yaw, rad |
//! | 20 | 3 × f32 | rate, rad/s |
//! | 32 | 3 × f32 | specific force, m/s² |
//! | 44 | 3 × f32 | position, m |
//! | 56 | 3 × f32 | velocity, m/s |
//! | 68 | f32, 3 × f32 | thrust, N; torque, N·m |
//! | 84 | 4 × f32 | duty of the motors |
//! | 100 | u8, 3 × u8 | state; not used |
//!
//! That is all of version 1, 104 bytes. Version 2 has 140:
//!
//! | offset | type | field |
//! |---|---|---|
//! | 104 | f32 | battery, V |
//! | 108 | f32, f32 | distance below and in front, m, -1 without a sensor |
//! | 116 | 2 × u16 | all counts of the flow sensor so far, wrapping around |
//! | 120 | u8 | surface quality of the flow sensor |
//! | 121 | u8 | what is valid: 0 below, 1 in front, 2 flow, 3 magnetometer, 4 barometer, 5 battery |
//! | 122 | u16 | not used |
//! | 124 | 3 × f32 | magnetic field, µT |
//! | 136 | f32 | height by the barometer, m |
//!
//! Little-endian. There is no check but UDP's own, and nobody is authenticated. From `sf_telemetry` of the ecosystem's vehicle. A
//! WiFi broadcast is neither repeated nor acknowledged: two in five were measured to be lost, which is why flow is counted up.

use crate::fields::{Fields, Places};
use stampfly_types::{Duration, Vec3};

const MARK: [u8; 2] = 0xCAFE_u16.to_le_bytes();
const KIND: u8 = 1;
const SHORT: usize = 104;
const LONG: usize = 140;

/// What a vehicle tells every program.
///
/// Numbers travel as they are: what is none at one end is none at the other, and a program that computes with it has to look.
///
/// ```
/// use stampfly_link::{BroadcastPacket, BroadcastSensors};
/// let told = BroadcastPacket {
///     time: u32::MAX,
///     sensors: Some(BroadcastSensors { flow: [65_530, 4], ..Default::default() }),
///     ..Default::default()
/// };
/// let mut bytes = [0; BroadcastPacket::LONGEST];
/// let length = told.write(&mut bytes).expect("there is room");
/// let read = BroadcastPacket::decode(&bytes[..length])?;
/// assert_eq!((length, read), (140, told));
/// // Counters wrap around.
/// let later = BroadcastSensors { flow: [4, 65_530], ..Default::default() };
/// assert_eq!(later.flow_since(&told.sensors.unwrap_or_default()), [10, -10]);
/// # Ok::<(), stampfly_link::BroadcastError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BroadcastPacket {
    /// The vehicle's time, µs. Wraps around after 71.6 minutes.
    pub time: u32,
    /// Roll, pitch, yaw, rad.
    pub attitude: Vec3,
    /// Rate, body FRD, rad/s.
    pub rate: Vec3,
    /// Specific force, body FRD, m/s².
    pub force: Vec3,
    /// Position, world NED, m.
    pub position: Vec3,
    /// Velocity, world NED, m/s.
    pub velocity: Vec3,
    /// Thrust that is asked for, N, up.
    pub thrust: f32,
    /// Torque that is asked for, body FRD, N·m.
    pub torque: Vec3,
    /// Duty of the motors, 0 to 1: front right, rear right, rear left, front left.
    pub duty: [f32; 4],
    /// The vehicle's state, by its firmware's own number.
    pub state: u8,
    /// What version 2 has and version 1 has not.
    pub sensors: Option<BroadcastSensors>,
}

/// What version 2 of a broadcast packet adds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BroadcastSensors {
    /// Battery voltage, V.
    pub voltage: f32,
    /// Distance below, m.
    pub below: f32,
    /// Distance in front, m; -1 without a sensor.
    pub in_front: f32,
    /// All counts of the flow sensor so far, its x and y. They wrap around.
    pub flow: [u16; 2],
    /// Surface quality of the flow sensor.
    pub surface_quality: u8,
    /// What is valid, see the constants.
    pub valid: u8,
    /// Magnetic field, body FRD, µT.
    pub field: Vec3,
    /// Height by the barometer, m, up.
    pub height: f32,
}

impl BroadcastSensors {
    /// [`below`](Self::below) is valid.
    pub const BELOW: u8 = 1;
    /// [`in_front`](Self::in_front) is valid.
    pub const IN_FRONT: u8 = 1 << 1;
    /// [`flow`](Self::flow) is valid.
    pub const FLOW: u8 = 1 << 2;
    /// [`field`](Self::field) is valid.
    pub const FIELD: u8 = 1 << 3;
    /// [`height`](Self::height) is valid.
    pub const HEIGHT: u8 = 1 << 4;
    /// [`voltage`](Self::voltage) is valid.
    pub const VOLTAGE: u8 = 1 << 5;

    /// Counts of the flow sensor since an earlier packet. Right as long as fewer than 32,768 came between them.
    #[must_use]
    pub fn flow_since(&self, earlier: &Self) -> [i16; 2] {
        let ([x, y], [old_x, old_y]) = (self.flow, earlier.flow);
        [x.wrapping_sub(old_x).cast_signed(), y.wrapping_sub(old_y).cast_signed()]
    }
}

/// Why bytes are no broadcast packet, in the order it is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BroadcastError {
    /// Neither 104 nor 140 bytes.
    Length,
    /// Does not start with CAFE.
    Mark,
    /// A version there is none of, or not the one of this length.
    Version,
    /// Another kind of packet.
    Kind,
}

impl core::fmt::Display for BroadcastError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Length => "not the length of a broadcast packet",
            Self::Mark => "not marked as a broadcast packet",
            Self::Version => "not a version of this length",
            Self::Kind => "another kind of packet",
        })
    }
}

impl core::error::Error for BroadcastError {}

impl BroadcastPacket {
    /// Length of version 2.
    pub const LONGEST: usize = LONG;
    /// The port it is sent to.
    pub const PORT: u16 = 5005;
    /// A packet that is older is shown as old.
    pub const STALE: Duration = Duration::from_millis(500);

    /// The time between an earlier packet and this one, less than 71.6 minutes.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> Duration {
        Duration::from_micros(self.time.wrapping_sub(earlier.time).into())
    }

    /// Writes it, version 2 with [`sensors`](Self::sensors) and else version 1, and returns how long it is; `None` when `out` is too short.
    #[must_use]
    pub fn write(&self, out: &mut [u8]) -> Option<usize> {
        let (length, version) = if self.sensors.is_some() { (LONG, 2) } else { (SHORT, 1) };
        let mut places = Places(out.get_mut(..length)?);
        places.put(MARK);
        places.put([version, KIND]);
        places.u32(self.time);
        [&self.attitude, &self.rate, &self.force, &self.position, &self.velocity]
            .into_iter()
            .for_each(|vector| places.vector(vector));
        places.f32(self.thrust);
        places.vector(&self.torque);
        self.duty.iter().for_each(|duty| places.f32(*duty));
        places.put([self.state, 0, 0, 0]);
        if let Some(sensors) = &self.sensors {
            [sensors.voltage, sensors.below, sensors.in_front].into_iter().for_each(|value| places.f32(value));
            sensors.flow.iter().for_each(|counts| places.u16(*counts));
            places.put([sensors.surface_quality, sensors.valid, 0, 0]);
            places.vector(&sensors.field);
            places.f32(sensors.height);
        }
        Some(length)
    }

    /// Reads it, either version. Bytes that are not used may be anything.
    ///
    /// # Errors
    /// When it is none.
    pub fn decode(bytes: &[u8]) -> Result<Self, BroadcastError> {
        let version = match bytes.len() {
            SHORT => 1,
            LONG => 2,
            _ => return Err(BroadcastError::Length),
        };
        let mut fields = Fields(bytes);
        if fields.array() != MARK {
            return Err(BroadcastError::Mark);
        }
        if fields.u8() != version {
            return Err(BroadcastError::Version);
        }
        if fields.u8() != KIND {
            return Err(BroadcastError::Kind);
        }
        // In the order of the table: expressions of a literal are evaluated as they are written.
        let mut packet = Self {
            time: fields.u32(),
            attitude: fields.vector(),
            rate: fields.vector(),
            force: fields.vector(),
            position: fields.vector(),
            velocity: fields.vector(),
            thrust: fields.f32(),
            torque: fields.vector(),
            duty: [(); 4].map(|()| fields.f32()),
            state: fields.u8(),
            sensors: None,
        };
        let _: [u8; 3] = fields.array();
        if version == 2 {
            let (voltage, below, in_front) = (fields.f32(), fields.f32(), fields.f32());
            let flow = [fields.u16(), fields.u16()];
            let [surface_quality, valid, _, _] = fields.array();
            let (field, height) = (fields.vector(), fields.f32());
            packet.sensors =
                Some(BroadcastSensors { voltage, below, in_front, flow, surface_quality, valid, field, height });
        }
        Ok(packet)
    }
}
