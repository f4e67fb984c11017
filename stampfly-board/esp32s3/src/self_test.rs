//! Does this machine compute what it should? Asked once, before anything can turn.
//!
//! A recorded flight is flown again and compared ([`golden`]). Bits that differ are a finding for whoever builds
//! compilers, and are said at every start and in every log; motors that would turn otherwise are forbidden for good.

use core::fmt;
use stampfly_board::golden::{self, GoldenError, Report, Verdict};
use stampfly_types::messages::{SelfTest, SelfTestVerdict};

/// How the test went.
#[derive(Clone, Copy)]
pub struct Outcome(Result<Report, GoldenError>);

impl Outcome {
    /// For the vehicle: a failure keeps it from arming, other bits are an alert, and both are in the log.
    pub fn message(&self) -> SelfTest {
        let (verdict, worst) = match self.0 {
            Ok(Report { verdict: Verdict::Identical, .. }) => (SelfTestVerdict::Identical, 0.0),
            Ok(Report { verdict: Verdict::WithinTolerance { worst }, .. }) => (SelfTestVerdict::WithinTolerance, worst),
            Ok(Report { verdict: Verdict::Beyond { worst, .. }, .. }) => (SelfTestVerdict::Failed, worst),
            Err(_) => (SelfTestVerdict::Failed, f32::INFINITY),
        };
        SelfTest { verdict, worst }
    }

    /// May the motors turn?
    pub fn may_fly(&self) -> bool {
        matches!(self.0, Ok(Report { verdict: Verdict::Identical | Verdict::WithinTolerance { .. }, .. }))
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("self test: ")?;
        match self.0 {
            Ok(Report { verdict: Verdict::Identical, .. }) => f.write_str("every bit as recorded"),
            Ok(Report { verdict: Verdict::WithinTolerance { worst }, .. }) => {
                write!(f, "other bits than recorded, duties within {worst}")
            }
            Ok(Report { verdict: Verdict::Beyond { worst, since }, .. }) => {
                write!(f, "FAILED, duties off by {worst} from {since} on; motors are forbidden")
            }
            Err(error) => write!(f, "FAILED, {error}; motors are forbidden"),
        }
    }
}

/// Flies the recorded flight. Not inlined, because it takes a whole vehicle of stack and gives it back.
#[inline(never)]
pub fn run() -> Outcome {
    Outcome(golden::play(golden::FLIGHT, &mut ()))
}
