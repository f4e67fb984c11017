//! The proof that motors are off.

use stampfly_types::messages::FlightStatus;

/// The vehicle was disarmed when this was made. It is worth one write and cannot be copied or kept in a log.
///
/// It proves a moment. Whoever writes closes the gap between proof and write: by looking at the newest mode, and by
/// keeping the motors still until the write is done.
///
/// ```
/// use stampfly_param::Disarmed;
/// use stampfly_types::messages::FlightStatus;
/// assert!(Disarmed::proven_by(&FlightStatus { armed: true, ..Default::default() }).is_none());
/// assert!(Disarmed::proven_by(&FlightStatus::default()).is_some());
/// ```
#[derive(Debug)]
#[must_use = "a proof is for the write it allows"]
pub struct Disarmed(());

impl Disarmed {
    /// The proof, if this is what the mode machine has decided.
    pub fn proven_by(mode: &FlightStatus) -> Option<Self> {
        (!mode.armed).then_some(Self(()))
    }
}
