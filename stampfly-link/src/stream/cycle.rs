//! A control cycle as it travels: three blocks, which stand apart in a packet.
//!
//! | block | offset | type | field |
//! |---|---|---|---|
//! | inertial and attitude, 80 bytes | 0 | u32 | time, µs |
//! | | 4 | 3 × f32 | rate, rad/s |
//! | | 16 | 3 × f32 | specific force, m/s² |
//! | | 28 | 3 × f32 | rate before filters |
//! | | 40 | 3 × f32 | specific force before filters |
//! | | 52 | 4 × f32 | attitude, w x y z |
//! | | 68 | 3 × i16 | bias of the rate, 0.0001 rad/s |
//! | | 74 | 3 × i16 | bias of the specific force, 0.0001 m/s² |
//! | position and velocity, 28 bytes | 0 | u32 | time, µs |
//! | | 4 | 3 × f32 | position, m |
//! | | 16 | 3 × f32 | velocity, m/s |
//! | rate that is wanted, 6 bytes | 0 | 3 × i16 | 0.001 rad/s |

use super::scaled::{self, COARSE, FINE};
use crate::fields::{Fields, Places};
use stampfly_types::{Quat, Vec3};

/// What happened in a control cycle.
///
/// Times wrap around after 71.6 minutes. Biases and the wanted rate travel in 16 bits, rounded; beyond ±3.2767, or ±32.767 rad/s, they end at the
/// limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamCycle {
    /// When the inertial sample was taken, the vehicle's time, µs.
    pub time: u32,
    /// Rate, body FRD, rad/s, as the estimator gets it.
    pub rate: Vec3,
    /// Specific force, body FRD, m/s², as the estimator gets it.
    pub force: Vec3,
    /// Rate before filters, body FRD, rad/s.
    pub raw_rate: Vec3,
    /// Specific force before filters, body FRD, m/s².
    pub raw_force: Vec3,
    /// Attitude, body to world.
    pub attitude: Quat,
    /// Bias of the rate, rad/s.
    pub rate_bias: Vec3,
    /// Bias of the specific force, m/s².
    pub force_bias: Vec3,
    /// What the position is of, the vehicle's time, µs.
    pub position_time: u32,
    /// Position, world NED, m.
    pub position: Vec3,
    /// Velocity, world NED, m/s.
    pub velocity: Vec3,
    /// The rate that is wanted, body FRD, rad/s.
    pub wanted_rate: Vec3,
}

impl StreamCycle {
    pub(super) const INERTIAL: usize = 80;
    pub(super) const POSITION: usize = 28;
    pub(super) const WANTED: usize = 6;

    /// Writes the three blocks; `None` when a number that travels in 16 bits is none.
    pub(super) fn write(&self, inertial: &mut [u8], position: &mut [u8], wanted: &mut [u8]) -> Option<()> {
        let mut places = Places(inertial);
        places.u32(self.time);
        [&self.rate, &self.force, &self.raw_rate, &self.raw_force].into_iter().for_each(|vector| places.vector(vector));
        self.attitude.wxyz().into_iter().for_each(|part| places.f32(part));
        scaled::put_vector(&mut places, &self.rate_bias, FINE)?;
        scaled::put_vector(&mut places, &self.force_bias, FINE)?;
        let mut places = Places(position);
        places.u32(self.position_time);
        places.vector(&self.position);
        places.vector(&self.velocity);
        scaled::put_vector(&mut Places(wanted), &self.wanted_rate, COARSE)
    }

    /// Reads the three blocks.
    pub(super) fn read(inertial: &[u8], position: &[u8], wanted: &[u8]) -> Self {
        let (mut fields, mut place) = (Fields(inertial), Fields(position));
        // In the order of the table: expressions of a literal are evaluated as they are written.
        Self {
            time: fields.u32(),
            rate: fields.vector(),
            force: fields.vector(),
            raw_rate: fields.vector(),
            raw_force: fields.vector(),
            attitude: {
                let [w, x, y, z] = [(); 4].map(|()| fields.f32());
                Quat::new_unchecked(w, x, y, z)
            },
            rate_bias: scaled::get_vector(&mut fields, FINE),
            force_bias: scaled::get_vector(&mut fields, FINE),
            position_time: place.u32(),
            position: place.vector(),
            velocity: place.vector(),
            wanted_rate: scaled::get_vector(&mut Fields(wanted), COARSE),
        }
    }
}
