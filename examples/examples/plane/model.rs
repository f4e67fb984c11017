//! A point that flies like an aeroplane: thrust, drag, a bank that turns it, a wing that can only carry so much, a runway.

use super::geometry::Point;
use stampfly_types::{GRAVITY, math};

/// kg, m².
const MASS: f32 = 1.5;
const WING: f32 = 0.6;
/// kg/m³.
const AIR: f32 = 1.225;
/// Drag without lift, drag by lift, largest lift.
const DRAG: f32 = 0.03;
const INDUCED: f32 = 0.0497;
const LIFT: f32 = 1.6;
/// N.
const THRUST: f32 = 12.0;
/// Rolling friction; with brakes.
const ROLLING: f32 = 0.04;
const BRAKING: f32 = 0.3;
/// Time constants of path angle and bank, s.
const PATH_LAG: f32 = 0.8;
const BANK_LAG: f32 = 0.4;
/// Largest rate of turn on wheels, rad/s.
const WHEELS: f32 = 0.8;

/// What moves it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Controls {
    /// rad.
    pub bank: f32,
    /// Of the wheel: how far to turn, rad.
    pub steering: f32,
    /// Path angle, rad.
    pub path: f32,
    /// Share.
    pub throttle: f32,
    pub brake: bool,
}

/// How it moves.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    pub position: Point,
    /// m/s.
    pub airspeed: f32,
    /// Where the nose points, rad.
    pub heading: f32,
    /// rad, upwards.
    pub path: f32,
    /// rad.
    pub bank: f32,
    pub on_ground: bool,
    /// Altitude of the field, m.
    pub field: f32,
    /// m/s, northwards and eastwards.
    pub wind: [f32; 2],
}

impl Motion {
    /// Over the ground, northwards and eastwards, m/s.
    fn velocity(&self) -> [f32; 2] {
        let (sin, cos) = math::sin_cos(self.heading);
        let speed = self.airspeed * math::cos(self.path);
        // Wheels do not drift.
        let wind = if self.on_ground { [0.0; 2] } else { self.wind };
        [speed * cos + wind[0], speed * sin + wind[1]]
    }

    /// Direction over the ground, rad.
    pub fn track(&self) -> f32 {
        let [north, east] = self.velocity();
        // At rest there is no track; the nose is as good.
        if self.airspeed < 0.1 { self.heading } else { math::atan2(east, north) }
    }

    /// The next `dt` seconds.
    pub fn step(&mut self, controls: &Controls, dt: f32) {
        let pressure = 0.5 * AIR * self.airspeed * self.airspeed * WING;
        self.bank += (controls.bank - self.bank) / BANK_LAG * dt;
        let needed = MASS * GRAVITY * math::cos(self.path) / math::cos(self.bank);
        let lift = needed.min(LIFT * pressure);
        let coefficient = if pressure > 0.0 { lift / pressure } else { 0.0 };
        let drag = pressure * (DRAG + INDUCED * coefficient * coefficient);
        let pull = THRUST * controls.throttle - drag;
        if self.on_ground {
            let load = (MASS * GRAVITY - lift).max(0.0);
            let friction = if controls.brake { BRAKING } else { ROLLING } * load;
            self.airspeed = (self.airspeed + (pull - friction) / MASS * dt).max(0.0);
            let turn = (2.0 * controls.steering).clamp(-WHEELS, WHEELS);
            self.heading += if self.airspeed > 0.2 { turn * dt } else { 0.0 };
            (self.path, self.bank) = (0.0, 0.0);
            self.on_ground = !(lift >= needed && controls.path > 0.0);
        } else {
            self.airspeed += (pull / MASS - GRAVITY * math::sin(self.path)) * dt;
            // A wing that cannot carry the weight lets the path fall.
            let falls = (lift - needed) / (MASS * self.airspeed.max(1.0));
            self.path += ((controls.path - self.path) / PATH_LAG + falls) * dt;
            self.heading += GRAVITY * math::tan(self.bank) / self.airspeed.max(1.0) * dt;
        }
        self.heading = math::wrap_angle(self.heading);
        let [north, east] = self.velocity();
        self.position.north += north * dt;
        self.position.east += east * dt;
        self.position.altitude += self.airspeed * math::sin(self.path) * dt;
        if self.position.altitude <= self.field {
            self.position.altitude = self.field;
            self.on_ground |= self.path < 0.0;
        }
    }
}
