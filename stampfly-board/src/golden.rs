//! The self test at power-on: the StampFly's golden flight, played and judged.
//!
//! A recorded hop of a few seconds, with everything that came from outside, goes through a vehicle of its own. The
//! motors' output must be what was recorded; see [`stampfly_flight::golden`]. `cargo xtask golden --fix` records it again
//! when the flight stack has changed on purpose.

use crate::VehicleConfig;
use crate::schedule::Runnables;
use crate::topics::{self, Id};
pub use stampfly_flight::golden::Outcome;
use stampfly_flight::golden::{self, GoldenError, Place, PlayObserver, Report};

/// The golden flight of this version.
pub const FLIGHT: &[u8] = include_bytes!("../golden/flight.bin");

/// Largest deviation of a number in the output that may still be rounding.
///
/// Sensors that are wrong in their last bits move a duty by less than a tenth of this, which a test of the program that
/// records asserts: the record does not react, so errors do not build up.
pub const TOLERANCE: f32 = 0.01;

/// The topic that is compared.
pub const OUTPUT: Id = Id::actuator_motor;

/// Plays [`FLIGHT`] on a vehicle with default parameters and a fresh bus.
///
/// # Errors
/// When the record is damaged, or was recorded with other tables.
pub fn play(bus: &mut topics::Bus, observer: &mut impl PlayObserver) -> Result<Report, GoldenError> {
    golden::play::<Runnables>(bus, FLIGHT, &VehicleConfig::default(), TOLERANCE, observer)
}

/// Plays the golden flight on a fresh bus, before anything can turn, with a vehicle made in `place`: the stack should not hold it.
///
/// ```
/// use core::mem::MaybeUninit;
/// use stampfly_board::{golden::self_test, topics::Bus};
/// let outcome = self_test(&mut MaybeUninit::uninit(), &mut Bus::new());
/// assert!(outcome.may_fly());
/// assert_eq!(outcome.to_string(), "self test: every bit as recorded");
/// ```
#[inline(never)]
#[must_use]
pub fn self_test<'b>(place: &'b mut Place<'b, Runnables>, bus: &'b mut topics::Bus) -> Outcome {
    Outcome(golden::play_in(place, bus, FLIGHT, &VehicleConfig::default(), TOLERANCE, &mut ()))
}
