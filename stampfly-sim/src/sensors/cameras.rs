//! Motion capture: cameras in the room that observe the vehicle's markers at 100 Hz.
//!
//! A pose has a standard deviation of 1 mm and 0.003 rad and arrives 30 ms old: exposure,
//! triangulation, radio. The origin of the system's frame is the initial pose of the vehicle. Poses
//! are lost when fewer than three markers are visible, here one in a hundred.

use super::schedule::Schedule;
use crate::noise::{Noise, Stream};
use crate::time::Clock;
use crate::world::World;
use core::convert::Infallible;
use nalgebra::{UnitQuaternion, Vector3};
use stampfly_drivers::{MotionCapture, Sample};
use stampfly_types::Duration;
use stampfly_types::messages::ExternalPose;

const RATE: f64 = 100.0;
/// Delay from the exposure to the arrival on board.
const LATENCY: Duration = Duration::from_micros(30_000);
/// Standard deviations, m and rad.
const POSITION: f64 = 0.001;
const ATTITUDE: f64 = 0.003;
/// Share of lost poses.
const LOST: f64 = 0.01;

/// Model of the motion capture system. Implements [`MotionCapture`].
#[derive(Debug)]
pub struct CameraModel {
    world: World,
    clock: Clock,
    noise: Noise,
    schedule: Schedule,
    origin: Vector3<f64>,
    turn: UnitQuaternion<f64>,
}

impl CameraModel {
    pub(crate) fn new(world: &World, clock: &Clock, seed: u64) -> Self {
        let mut noise = Noise::stream(seed, Stream::Cameras);
        let start = world.motion_at(clock.now());
        let (_, _, yaw) = start.attitude.euler_angles();
        Self {
            schedule: Schedule::new(clock.now(), RATE, 0.0, &mut noise),
            origin: start.position,
            turn: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -yaw),
            noise,
            world: world.clone(),
            clock: clock.clone(),
        }
    }
}

impl MotionCapture for CameraModel {
    type Error = Infallible;

    async fn next(&mut self) -> Result<Sample<ExternalPose>, Infallible> {
        loop {
            let number = self.schedule.upcoming(self.clock.now(), LATENCY.as_micros() as f64);
            let at = self.schedule.instant(number);
            self.clock.sleep_until(at + LATENCY).await;
            self.schedule.reported(number);
            let position = self.noise.normal3() * POSITION;
            let attitude = self.noise.normal3() * ATTITUDE;
            if self.noise.unit() < LOST {
                continue;
            }
            let motion = self.world.motion_at(at);
            let data = ExternalPose {
                position: (self.turn * (motion.position - self.origin) + position).cast::<f32>().into(),
                attitude: (self.turn * motion.attitude * UnitQuaternion::from_scaled_axis(attitude))
                    .cast::<f32>()
                    .into(),
                position_sigma: POSITION as f32,
                attitude_sigma: ATTITUDE as f32,
            };
            return Ok(Sample { at, data });
        }
    }
}
