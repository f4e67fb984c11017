//! How a self test by a golden flight went, as it is published and as people read it.

use super::{GoldenError, Report, Verdict};
use core::fmt;
use stampfly_types::messages::{SelfTest, SelfTestVerdict};

/// How the self test went: for a vehicle that plays its golden flight before anything can turn.
///
/// ```
/// use stampfly_flight::golden::{GoldenError, Outcome};
/// let outcome = Outcome(Err(GoldenError::Damaged));
/// assert!(!outcome.may_fly() && outcome.to_string().starts_with("self test: FAILED"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome(pub Result<Report, GoldenError>);

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
