//! The self test at power-on: the StampFly's golden flight, played and judged.
//!
//! A recorded hop of a few seconds, with everything that came from outside, goes through a vehicle of its own. The
//! motors' output must be what was recorded; see [`stampfly_flight::golden`]. `cargo xtask golden --fix` records it again
//! when the flight stack has changed on purpose.

use crate::VehicleConfig;
use crate::schedule::Runnables;
use crate::topics::{self, Id};
use core::fmt;
use stampfly_flight::golden::{self, GoldenError, Place, PlayObserver, Report, Verdict};
use stampfly_types::messages::{SelfTest, SelfTestVerdict};

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

/// How the self test went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome(pub Result<Report, GoldenError>);

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

impl Outcome {
    /// For the topic `self_test`: a failure blocks arming, different bits are an alert, and both are logged.
    #[must_use]
    pub const fn message(&self) -> SelfTest {
        let (verdict, worst) = match self.0 {
            Ok(Report { verdict: Verdict::Identical, .. }) => (SelfTestVerdict::Identical, 0.0),
            Ok(Report { verdict: Verdict::WithinTolerance { worst }, .. }) => (SelfTestVerdict::WithinTolerance, worst),
            Ok(Report { verdict: Verdict::Beyond { worst, .. }, .. }) => (SelfTestVerdict::Failed, worst),
            Err(_) => (SelfTestVerdict::Failed, f32::INFINITY),
        };
        SelfTest { verdict, worst }
    }

    /// May the motors turn?
    #[must_use]
    pub const fn may_fly(&self) -> bool {
        matches!(self.0, Ok(Report { verdict: Verdict::Identical | Verdict::WithinTolerance { .. }, .. }))
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("self test: ")?;
        match self.0 {
            Ok(Report { verdict: Verdict::Identical, .. }) => f.write_str("every bit as recorded"),
            Ok(Report { verdict: Verdict::WithinTolerance { worst }, .. }) => {
                write!(f, "other bits than recorded, motors within {worst}")
            }
            Ok(Report { verdict: Verdict::Beyond { worst, since }, .. }) => {
                write!(f, "FAILED, motors off by {worst} from {since} on; the vehicle cannot be armed")
            }
            Err(error) => write!(f, "FAILED, {error}; the vehicle cannot be armed"),
        }
    }
}
