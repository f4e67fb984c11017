//! Frames: how the three axes act on every motor, in the order of the document.

use stampfly_control::mixer::shares::rows;
use stampfly_control::{Rotor, Spin};

const fn quadrotor(first: Spin, second: Spin) -> [Rotor; 4] {
    let [front_right, rear_left, front_left, rear_right] = Rotor::quadrotor_x_px4(1.0, 1.0);
    [
        Rotor { spin: first, ..rear_right },
        Rotor { spin: second, ..front_right },
        Rotor { spin: second, ..rear_left },
        Rotor { spin: first, ..front_left },
    ]
}

/// Motors rear right, front right, rear left, front left; the first and the last turn clockwise.
pub const QUADROTOR_X: [[f32; 3]; 4] = rows(quadrotor(Spin::Clockwise, Spin::CounterClockwise));
/// The same places; every motor turns the other way.
pub const QUADROTOR_H: [[f32; 3]; 4] = rows(quadrotor(Spin::CounterClockwise, Spin::Clockwise));
/// Motors as [`Rotor::hexarotor_x`] numbers them.
pub const HEXAROTOR_X: [[f32; 3]; 6] = rows(Rotor::hexarotor_x(1.0, 1.0));
/// Motors as [`Rotor::octorotor_x`] numbers them.
pub const OCTOROTOR_X: [[f32; 3]; 8] = rows(Rotor::octorotor_x(1.0, 1.0));

/// The frame with this number, as the parameter `frame.layout` has it; the nearest, if there is none.
#[must_use]
pub fn layout(number: f32) -> &'static [[f32; 3]] {
    if number < 0.5 {
        &QUADROTOR_X
    } else if number < 1.5 {
        &QUADROTOR_H
    } else if number < 2.5 {
        &HEXAROTOR_X
    } else {
        &OCTOROTOR_X
    }
}
