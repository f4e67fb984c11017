//! From demands to bank, path angle and throttle: proportional loops, as small as they can be.

use super::geometry::Point;
use super::model::{Controls, Motion};
use super::{Course, Demand, Path, Thrust};
use stampfly_types::math;

/// Bank for an error of the direction.
const BANK_GAIN: f32 = 4.2;
/// Largest bank and path angle, rad: 20°.
const LARGEST: f32 = 20.0 / 180.0 * core::f32::consts::PI;
/// Path angle for an error of the altitude, rad/m: 1°.
const PITCH_GAIN: f32 = core::f32::consts::PI / 180.0;
/// Throttle for an error of the airspeed, s/m.
const THROTTLE_GAIN: f32 = 0.8;
/// How much it turns towards a line, 1/m: in the air, and on its wheels.
const LINE_GAIN: f32 = 0.01;
const LINE_GAIN_WHEELS: f32 = 0.2;

/// The controls that bring about the demand.
pub fn steer(demand: &Demand, motion: &Motion) -> Controls {
    let here = motion.position;
    let (wanted, present) = match demand.course {
        Course::Along(from, to) => {
            let gain = if motion.on_ground { LINE_GAIN_WHEELS } else { LINE_GAIN };
            (along(from, to, here, gain), motion.track())
        }
        Course::To(goal) => (here.direction(goal), motion.track()),
        Course::Track(track) => (track, motion.track()),
        Course::Heading(heading) => (heading, motion.heading),
    };
    let error = math::wrap_angle(wanted - present);
    let path = match demand.path {
        Path::Altitude(altitude, angle) => angle + PITCH_GAIN * (altitude - here.altitude),
        Path::Angle(angle) => angle,
    };
    let throttle = match demand.thrust {
        Thrust::Airspeed(airspeed) => THROTTLE_GAIN * (airspeed - motion.airspeed),
        Thrust::Throttle(throttle) => throttle,
    };
    Controls {
        bank: (BANK_GAIN * error).clamp(-LARGEST, LARGEST),
        steering: error,
        path: path.clamp(-LARGEST, LARGEST),
        throttle: throttle.clamp(0.0, 1.0),
        brake: demand.brake,
    }
}

/// The track that leads to the line and along it.
fn along(from: Point, to: Point, here: Point, gain: f32) -> f32 {
    let course = from.direction(to);
    let aside = from.distance(here) * math::sin(from.direction(here) - course);
    course - math::atan2(gain * aside, 1.0)
}
