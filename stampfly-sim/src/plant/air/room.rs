//! Recirculation in a small room: the wake goes down, along the floor, up the walls and returns.
//!
//! The wake of a multirotor is a round turbulent jet from two or three diameters on (Bauersfeld et
//! al., Robotics meets fluid dynamics, arXiv 2403.13321). Far from its origin a jet depends on its
//! momentum only: speeds are multiples of `√(T/ρ)/L` at distance L. In a closed room of side L the
//! returning air is assumed to have this as standard deviation along each axis: 0.18 m/s for a
//! StampFly in a room of 3 m, less than half of the 0.43 m/s on the axis of the jet after three
//! sides (7.0·√(T/ρ) divided by the distance). It builds up and wanders with the turnover time of
//! the air in the room; these factors are *unverified*.

use super::DENSITY;
use crate::noise::Noise;
use crate::normals::Normals;
use nalgebra::Vector3;

/// Correlation time in turnover times, side divided by velocity.
const MEMORY: f64 = 0.25;
/// Period of the slow update, s.
const PERIOD: f64 = 0.01;

/// Recirculating air of a small room.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Room {
    noise: Normals,
    /// Standard deviation of the velocity in a long hover, m/s.
    deviation: f64,
    /// Correlation time, s.
    time: f64,
    /// Direction and relative magnitude of the flow: a process of unit variance per axis.
    swirl: Vector3<f64>,
    /// Low-passed squared rotor speed: thrust whose wake has returned, in weights.
    stirred: f64,
    since: f64,
}

impl Room {
    /// A room with this side, m, and a vehicle of this weight, N.
    pub fn new(side: f64, weight: f64, mut noise: Noise) -> Self {
        let deviation = (weight / DENSITY).sqrt() / side;
        // The direction is drawn at once; its strength grows with `stirred`, so the air is still at
        // first.
        let swirl = noise.normal3();
        let time = MEMORY * side / deviation.max(1e-3);
        Self { noise: noise.into(), deviation, time, swirl, stirred: 0.0, since: 0.0 }
    }

    /// Advances by `dt` seconds with rotors at the share `share` of their hover speed and returns
    /// the velocity.
    pub fn step(&mut self, dt: f64, share: f64) -> Vector3<f64> {
        self.since += dt;
        if self.since >= PERIOD {
            let keep = libm::exp(-self.since / self.time);
            let drive = (1.0 - keep * keep).sqrt();
            self.swirl = self.swirl * keep + Vector3::from(self.noise.next()) * drive;
            // The returning flow follows the thrust with the correlation time.
            self.stirred += (share * share - self.stirred) * (1.0 - keep);
            self.since = 0.0;
        }
        self.velocity()
    }

    /// Velocity of the recirculating air, world, m/s.
    pub fn velocity(&self) -> Vector3<f64> {
        self.swirl * (self.deviation * self.stirred.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hovering_vehicle_stirs_a_small_room_and_a_large_one_less() {
        for (side, expected) in [(3.0, 0.183), (6.0, 0.091)] {
            let mut room = Room::new(side, 0.361, Noise::new(1, 1));
            assert_eq!(room.step(0.001, 1.0).norm(), 0.0, "the air is still at first");
            let count = 400_000;
            let squares: f64 = (0..count).map(|_| room.step(0.02, 1.0).norm_squared() / 3.0).sum();
            let deviation = (squares / f64::from(count)).sqrt();
            assert!((deviation / expected - 1.0).abs() < 0.12, "{side} m: {deviation} m/s");
        }
    }

    #[test]
    fn it_calms_down_when_the_rotors_stand_still() {
        let mut room = Room::new(3.0, 0.361, Noise::new(1, 1));
        (0..6_000).for_each(|_| _ = room.step(0.01, 1.0));
        let stirred = room.stirred;
        (0..6_000).for_each(|_| _ = room.step(0.01, 0.0));
        assert!(stirred > 0.99 && room.stirred < 0.01, "{stirred} {}", room.stirred);
    }
}
