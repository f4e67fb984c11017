//! The proof that the vehicle is disarmed.

use stampfly_types::messages::FlightStatus;

/// Proof that the vehicle was disarmed when this was made. It allows one write and cannot be
/// copied.
///
/// The caller has to close the gap between proof and write: use the newest mode, and keep the
/// motors off until the write is done.
///
/// ```
/// use stampfly_param::Disarmed;
/// use stampfly_param::types::messages::FlightStatus;
/// assert!(Disarmed::proven_by(&FlightStatus { armed: true, ..Default::default() }).is_none());
/// assert!(Disarmed::proven_by(&FlightStatus::default()).is_some());
/// ```
#[derive(Debug)]
#[must_use = "the proof is for the write that it allows"]
pub struct Disarmed(());

impl Disarmed {
    /// The proof, if this is what the mode machine has decided.
    pub fn proven_by(mode: &FlightStatus) -> Option<Self> {
        (!mode.armed).then_some(Self(()))
    }
}
