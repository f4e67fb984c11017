//! Numbers that travel in 16 bits: rounded, at the limit when they do not fit, and refused when they are none, because no value is wrong enough
//! to be taken for "unknown".

use crate::fields::{Fields, Places};
use stampfly_types::{Vec3, math};

/// Steps of a bias, and of an angle: 0.0001 rad/s, m/s² or rad.
pub const FINE: f32 = 1e4;
/// Steps of a rate, and of the angle of a flip: 0.001 rad/s or rad.
pub const COARSE: f32 = 1e3;
/// A duty of 1.
pub const FULL_DUTY: f32 = 65_535.0;

/// A signed number, `None` for what is none.
pub fn put(places: &mut Places<'_>, value: f32, steps: f32) -> Option<()> {
    // `as` ends at the limits.
    (!value.is_nan()).then(|| places.i16(math::round(value * steps) as i16))
}

pub fn put_vector(places: &mut Places<'_>, vector: &Vec3, steps: f32) -> Option<()> {
    vector.iter().try_for_each(|value| put(places, *value, steps))
}

/// A duty, 0 to 1.
pub fn put_duty(places: &mut Places<'_>, duty: f32) -> Option<()> {
    (!duty.is_nan()).then(|| places.u16(math::round(duty * FULL_DUTY) as u16))
}

pub fn get(fields: &mut Fields<'_>, steps: f32) -> f32 {
    f32::from(fields.i16()) / steps
}

pub fn get_vector(fields: &mut Fields<'_>, steps: f32) -> Vec3 {
    Vec3::from_fn(|_| get(fields, steps))
}

pub fn get_duty(fields: &mut Fields<'_>) -> f32 {
    f32::from(fields.u16()) / FULL_DUTY
}
