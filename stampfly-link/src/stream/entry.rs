//! Entries: what a packet carries besides its control cycles, each with an id and a length, so that a reader passes over what it does not know.
//!
//! | id | bytes | fields |
//! |---|---|---|
//! | 0x42 | 20 | time, throttle, roll, pitch, yaw f32 |
//! | 0x43 | 9 | time, 2 × i16 counts, u8 surface quality |
//! | 0x44, 0x47 | 9 | time, distance f32, u8 status: below, in front |
//! | 0x45 | 12 | time, height f32, pressure f32 in hPa |
//! | 0x46 | 16 | time, field 3 × f32 in µT |
//! | 0x48 | 30 | time, u8 mode, u8 not used, 2 × i16 angle in 0.0001 rad, thrust f32, duty 4 × f32 |
//! | 0x4A | 64 | duty 8 × 4 × u16, 65535 is 1 |
//! | 0x4B | 128 | 8 × thrust f32, torque 3 × f32 |
//! | 0x4C | 40 | 8 × u8 state, u8 phase and u8 result of a flip, i16 its angle in 0.001 rad |
//! | 0x4D | 8 | time, u8 buttons, u8 flags, u8 and u8 why arming is refused |
//!
//! A time is a u32 in µs that wraps around. 0x49 is taken by a program that reads these packets, and is never written.

use super::CYCLES;
use super::scaled::{self, COARSE, FINE};
use crate::fields::{Fields, Places};
use stampfly_types::Vec3;

const PILOT: u8 = 0x42;
const FLOW: u8 = 0x43;
const BELOW: u8 = 0x44;
const BAROMETER: u8 = 0x45;
const MAGNETOMETER: u8 = 0x46;
const IN_FRONT: u8 = 0x47;
const WANTED: u8 = 0x48;
const DUTY: u8 = 0x4A;
const OUTPUT: u8 = 0x4B;
const PHASE: u8 = 0x4C;
const FLAGS: u8 = 0x4D;

/// What the controller asked of the motors in a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamOutput {
    /// Thrust, N, up.
    pub thrust: f32,
    /// Torque, body FRD, N·m.
    pub torque: Vec3,
}

/// The flight's phase in a cycle, by the numbers of the vehicle's firmware.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamPhase {
    /// The vehicle's state.
    pub state: u8,
    /// What a flip is doing.
    pub flip: u8,
    /// What became of the last flip.
    pub result: u8,
    /// How far it has turned, rad; rounded to 0.001, ends at ±32.767.
    pub angle: f32,
}

/// An entry of a packet. `time` is when it was measured, the vehicle's time in µs.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum StreamEntry<'d> {
    /// The pilot's sticks.
    Pilot {
        /// µs.
        time: u32,
        /// 0 to 1.
        throttle: f32,
        /// -1 to 1, right positive.
        roll: f32,
        /// -1 to 1.
        pitch: f32,
        /// -1 to 1, clockwise positive.
        yaw: f32,
    },
    /// The flow sensor.
    Flow {
        /// µs.
        time: u32,
        /// Counts since the entry before, its x and y.
        counts: [i16; 2],
        /// Surface quality.
        surface_quality: u8,
    },
    /// The distance below.
    Below {
        /// µs.
        time: u32,
        /// m.
        distance: f32,
        /// Zero is valid.
        status: u8,
    },
    /// The distance in front.
    InFront {
        /// µs.
        time: u32,
        /// m.
        distance: f32,
        /// Zero is valid.
        status: u8,
    },
    /// The barometer.
    Barometer {
        /// µs.
        time: u32,
        /// Above where it was switched on, m.
        height: f32,
        /// hPa.
        pressure: f32,
    },
    /// The magnetometer.
    Magnetometer {
        /// µs.
        time: u32,
        /// Body FRD, µT.
        field: Vec3,
    },
    /// What the controller wanted.
    Wanted {
        /// µs.
        time: u32,
        /// 0 rates, 1 attitude, 2 height, 3 place.
        mode: u8,
        /// Roll and pitch, rad; rounded to 0.0001, end at ±3.2767.
        angle: [f32; 2],
        /// Thrust, N.
        thrust: f32,
        /// Motors, 0 to 1: front right, rear right, rear left, front left.
        duty: [f32; 4],
    },
    /// Duty of the motors in each cycle, 0 to 1, in steps of 1/65535: front right, rear right, rear left, front left.
    Duty([[f32; 4]; CYCLES]),
    /// What the controller asked of the motors in each cycle.
    Output([StreamOutput; CYCLES]),
    /// The flight's phase in each cycle.
    Phase([StreamPhase; CYCLES]),
    /// Buttons and reasons, by the numbers of the vehicle's firmware.
    Flags {
        /// µs.
        time: u32,
        /// Buttons that are down.
        buttons: u8,
        /// Flags.
        flags: u8,
        /// Why nothing happened.
        blocked: u8,
        /// Why it did not arm.
        arming: u8,
    },
    /// Something else, or of another length than is known here.
    Other {
        /// Its id.
        id: u8,
        /// Up to 255 bytes.
        data: &'d [u8],
    },
}

impl<'d> StreamEntry<'d> {
    /// Taken by a program that reads these packets.
    pub(super) const RESERVED: u8 = 0x49;

    /// Its id and how many bytes follow its length; `None` for what is too long.
    pub(super) fn header(&self) -> Option<(u8, u8)> {
        Some(match self {
            Self::Pilot { .. } => (PILOT, 20),
            Self::Flow { .. } => (FLOW, 9),
            Self::Below { .. } => (BELOW, 9),
            Self::InFront { .. } => (IN_FRONT, 9),
            Self::Barometer { .. } => (BAROMETER, 12),
            Self::Magnetometer { .. } => (MAGNETOMETER, 16),
            Self::Wanted { .. } => (WANTED, 30),
            Self::Duty(_) => (DUTY, 64),
            Self::Output(_) => (OUTPUT, 128),
            Self::Phase(_) => (PHASE, 40),
            Self::Flags { .. } => (FLAGS, 8),
            Self::Other { id, data } => (*id, u8::try_from(data.len()).ok()?),
        })
    }

    /// Writes what follows its length; `None` when a number that travels in 16 bits is none.
    pub(super) fn write(&self, out: &mut [u8]) -> Option<()> {
        if let Self::Other { data, .. } = self {
            out.get_mut(..data.len())?.copy_from_slice(data);
            return Some(());
        }
        let mut places = Places(out);
        match self {
            Self::Pilot { time, throttle, roll, pitch, yaw } => {
                places.u32(*time);
                [throttle, roll, pitch, yaw].into_iter().for_each(|stick| places.f32(*stick));
            }
            Self::Flow { time, counts, surface_quality } => {
                places.u32(*time);
                counts.iter().for_each(|counts| places.i16(*counts));
                places.put([*surface_quality]);
            }
            Self::Below { time, distance, status } | Self::InFront { time, distance, status } => {
                places.u32(*time);
                places.f32(*distance);
                places.put([*status]);
            }
            Self::Barometer { time, height, pressure } => {
                places.u32(*time);
                places.f32(*height);
                places.f32(*pressure);
            }
            Self::Magnetometer { time, field } => {
                places.u32(*time);
                places.vector(field);
            }
            Self::Wanted { time, mode, angle, thrust, duty } => {
                places.u32(*time);
                places.put([*mode, 0]);
                angle.iter().try_for_each(|angle| scaled::put(&mut places, *angle, FINE))?;
                places.f32(*thrust);
                duty.iter().for_each(|duty| places.f32(*duty));
            }
            Self::Duty(cycles) => {
                cycles.iter().flatten().try_for_each(|duty| scaled::put_duty(&mut places, *duty))?;
            }
            Self::Output(cycles) => cycles.iter().for_each(|cycle| {
                places.f32(cycle.thrust);
                places.vector(&cycle.torque);
            }),
            Self::Phase(cycles) => cycles.iter().try_for_each(|cycle| {
                places.put([cycle.state, cycle.flip, cycle.result]);
                scaled::put(&mut places, cycle.angle, COARSE)
            })?,
            Self::Flags { time, buttons, flags, blocked, arming } => {
                places.u32(*time);
                places.put([*buttons, *flags, *blocked, *arming]);
            }
            Self::Other { .. } => {}
        }
        Some(())
    }

    /// Reads what follows its length.
    pub(super) fn read(id: u8, data: &'d [u8]) -> Self {
        let mut fields = Fields(data);
        // Expressions of a literal are evaluated as they are written.
        match (id, data.len()) {
            (PILOT, 20) => Self::Pilot {
                time: fields.u32(),
                throttle: fields.f32(),
                roll: fields.f32(),
                pitch: fields.f32(),
                yaw: fields.f32(),
            },
            (FLOW, 9) => {
                Self::Flow { time: fields.u32(), counts: [fields.i16(), fields.i16()], surface_quality: fields.u8() }
            }
            (BELOW, 9) => Self::Below { time: fields.u32(), distance: fields.f32(), status: fields.u8() },
            (IN_FRONT, 9) => Self::InFront { time: fields.u32(), distance: fields.f32(), status: fields.u8() },
            (BAROMETER, 12) => Self::Barometer { time: fields.u32(), height: fields.f32(), pressure: fields.f32() },
            (MAGNETOMETER, 16) => Self::Magnetometer { time: fields.u32(), field: fields.vector() },
            (WANTED, 30) => {
                let time = fields.u32();
                let [mode, _] = fields.array();
                let angle = [(); 2].map(|()| scaled::get(&mut fields, FINE));
                Self::Wanted { time, mode, angle, thrust: fields.f32(), duty: [(); 4].map(|()| fields.f32()) }
            }
            (DUTY, 64) => Self::Duty([[(); 4]; CYCLES].map(|cycle| cycle.map(|()| scaled::get_duty(&mut fields)))),
            (OUTPUT, 128) => {
                Self::Output([(); CYCLES].map(|()| StreamOutput { thrust: fields.f32(), torque: fields.vector() }))
            }
            (PHASE, 40) => Self::Phase([(); CYCLES].map(|()| {
                let [state, flip, result] = fields.array();
                StreamPhase { state, flip, result, angle: scaled::get(&mut fields, COARSE) }
            })),
            (FLAGS, 8) => {
                let time = fields.u32();
                let [buttons, flags, blocked, arming] = fields.array();
                Self::Flags { time, buttons, flags, blocked, arming }
            }
            _ => Self::Other { id, data },
        }
    }
}
