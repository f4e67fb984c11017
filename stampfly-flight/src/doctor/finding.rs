//! The result of one check, and the line that says it.

use core::fmt;

/// What a check has found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// As it should be.
    Pass,
    /// Perhaps as it should be: somebody has to look.
    Look,
    /// Wrong.
    Fail,
}

impl Verdict {
    const ALL: [Self; 3] = [Self::Pass, Self::Look, Self::Fail];
}

/// The word of the line.
impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Pass => "pass",
            Self::Look => "LOOK",
            Self::Fail => "FAIL",
        })
    }
}

/// One check's result: a line of the answer. `V` is what shows the value: text, or anything that can be displayed.
///
/// ```
/// use stampfly_flight::doctor::{Finding, Verdict};
/// let line = "check flash FAIL DIO at 40 MHz -- flash it again";
/// let finding = Finding::parse(line).unwrap();
/// assert_eq!((finding.name, finding.verdict, finding.value), ("flash", Verdict::Fail, "DIO at 40 MHz"));
/// assert_eq!(finding.to_string(), line);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Finding<'c, V> {
    /// Stable, without spaces.
    pub name: &'c str,
    /// What was found.
    pub verdict: Verdict,
    /// What it was found from.
    pub value: V,
    /// What to do about it; empty when nothing.
    pub advice: &'c str,
}

/// What only the board knows.
pub type Fact<'c> = Finding<'c, &'c dyn fmt::Display>;

const MARK: &str = "check ";
const ADVICE: &str = " -- ";

impl<V: fmt::Display> fmt::Display for Finding<'_, V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{MARK}{} {} {}", self.name, self.verdict, self.value)?;
        if self.advice.is_empty() { Ok(()) } else { write!(f, "{ADVICE}{}", self.advice) }
    }
}

impl<'c> Finding<'c, &'c str> {
    /// Reads a line; `None` when it is none of these.
    #[must_use]
    pub fn parse(line: &'c str) -> Option<Self> {
        let (name, rest) = line.trim_end().strip_prefix(MARK)?.split_once(' ')?;
        let (word, rest) = rest.split_once(' ').unwrap_or((rest, ""));
        let verdict = *Verdict::ALL.iter().zip(["pass", "LOOK", "FAIL"]).find(|(_, known)| *known == word)?.0;
        let (value, advice) = rest.split_once(ADVICE).unwrap_or((rest, ""));
        Some(Self { name, verdict, value, advice })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn what_is_written_is_read_again() {
        for (verdict, advice) in [(Verdict::Pass, ""), (Verdict::Look, "look -- here"), (Verdict::Fail, "mend it")] {
            let written = Finding { name: "imu", verdict, value: "samples 3 errors 0", advice };
            assert_eq!(Finding::parse(&written.to_string()), Some(written));
        }
        for other in ["", "check", "check imu", "check imu good 3", "sensor imu pass 3", "check  "] {
            assert_eq!(Finding::parse(other), None, "{other}");
        }
    }
}
