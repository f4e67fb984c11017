//! Where a pass of the flight band begins and ends, for whoever watches the emulator: `cargo xtask cache`.
//!
//! Functions that do nothing but have an address. They differ in what they hand to [`black_box`], or the linker would make one of them.

use core::hint::black_box;

/// A pass begins.
#[inline(never)]
pub fn pass_begins() {
    black_box(1);
}

/// A pass in which something ran is over. The motors stand still.
#[inline(never)]
pub fn pass_ends_on_ground() {
    black_box(2);
}

/// A pass in which something ran is over. The motors may turn.
#[inline(never)]
pub fn pass_ends_armed() {
    black_box(3);
}

/// What follows is no part of a pass: on the vehicle another core does it.
#[inline(never)]
pub fn aside_begins() {
    black_box(4);
}

/// The pass goes on.
#[inline(never)]
pub fn aside_ends() {
    black_box(5);
}

/// An activation is over. Called while aside, once more often than its place in the schedule says.
#[inline(never)]
pub fn counts() {
    black_box(6);
}
