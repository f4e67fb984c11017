//! Faults of a simulated vehicle as data: kind, begin, duration.
//!
//! A vehicle lists its faults in a table of [`FaultKind`]s. A [`Fault`] is one of them with a
//! begin, written as text:
//!
//! ```text
//! NAME[=VALUE]@WHEN[+SECONDS]      tof-stuck=0.03@hover+2
//! ```
//!
//! | part | purpose |
//! |---|---|
//! | [`FaultKind`], [`Fault`] | a row of a vehicle's table; one fault of one flight |
//! | [`When`], [`Moment`] | begin of a fault |
//! | [`Sizes`], [`Measure`] | plausible sizes of a fault, from which campaigns draw |
//! | [`Injector`] | which faults act now, and how often each has acted |
//! | [`Distortion`], [`Line`] | effect on samples on their way to the bus |
//! | [`Class`] | outcome of a flight with faults |
//!
//! Use it for faults of sensors, links and actuators in flight. For faults of a chip's registers,
//! to test one driver, use [`chips::Faults`](crate::chips::Faults).

mod class;
mod distortion;
mod injector;
mod line;
mod sizes;
mod when;

pub use class::Class;
pub use distortion::{Distortion, Effect};
pub use injector::Injector;
pub use line::Line;
pub use sizes::{Measure, Sizes};
pub use when::{Moment, When};

use core::fmt;
use stampfly_types::Duration;

/// Identifier of the invariant that every fault of a flight has begun and acted. It concerns the
/// test, not the vehicle: a flight that violates it proves nothing.
pub const FAULT_ACTED: &str = "I12";

/// Value of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultValue {
    /// No value.
    None,
    /// A value with a default.
    Number {
        /// Unit; empty for a dimensionless value.
        unit: &'static str,
        /// Value if none is given.
        default: f64,
        /// Lowest and highest value.
        range: [f64; 2],
    },
    /// A value, or none: then the last value before the fault persists.
    OrLast {
        /// Unit; empty for a dimensionless value.
        unit: &'static str,
        /// Lowest and highest value.
        range: [f64; 2],
    },
}

impl FaultValue {
    /// The unit; empty without one.
    #[must_use]
    pub const fn unit(&self) -> &'static str {
        match self {
            Self::None => "",
            Self::Number { unit, .. } | Self::OrLast { unit, .. } => unit,
        }
    }

    /// The value of a fault that is given without one.
    #[must_use]
    pub const fn default(&self) -> Option<f64> {
        match self {
            Self::Number { default, .. } => Some(*default),
            Self::None | Self::OrLast { .. } => None,
        }
    }

    /// Lowest and highest value.
    #[must_use]
    pub const fn range(&self) -> Option<[f64; 2]> {
        match self {
            Self::None => None,
            Self::Number { range, .. } | Self::OrLast { range, .. } => Some(*range),
        }
    }
}

/// One row of a vehicle's table of faults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultKind {
    /// Name in texts.
    pub name: &'static str,
    /// Its value.
    pub value: FaultValue,
    /// Sizes from which a campaign draws the value; without them the campaign uses the default.
    pub sizes: Option<Sizes>,
    /// The worst acceptable class with the default value.
    pub expected: Class,
    /// Another worst acceptable class above a size.
    pub above: Option<(f64, Class)>,
    /// Description for users.
    pub meaning: &'static str,
}

impl FaultKind {
    const fn new(name: &'static str, value: FaultValue, expected: Class, meaning: &'static str) -> Self {
        Self { name, value, sizes: None, expected, above: None, meaning }
    }

    /// A fault without a value.
    #[must_use]
    pub const fn plain(name: &'static str, expected: Class, meaning: &'static str) -> Self {
        Self::new(name, FaultValue::None, expected, meaning)
    }

    /// A fault with a value: unit, default, lowest, highest.
    #[must_use]
    pub const fn number(
        name: &'static str,
        (unit, default, low, high): (&'static str, f64, f64, f64),
        expected: Class,
        meaning: &'static str,
    ) -> Self {
        Self::new(name, FaultValue::Number { unit, default, range: [low, high] }, expected, meaning)
    }

    /// A fault with an optional value, without which the last value persists: unit, lowest,
    /// highest.
    #[must_use]
    pub const fn or_last(
        name: &'static str,
        (unit, low, high): (&'static str, f64, f64),
        expected: Class,
        meaning: &'static str,
    ) -> Self {
        Self::new(name, FaultValue::OrLast { unit, range: [low, high] }, expected, meaning)
    }

    /// Sets another acceptable class above a size.
    #[must_use]
    pub const fn above(self, size: f64, expected: Class) -> Self {
        Self { above: Some((size, expected)), ..self }
    }

    /// Sets the sizes from which a campaign draws the value: measure, range and the reason for the
    /// range.
    #[must_use]
    pub const fn sized(self, measure: Measure, range: [f64; 2], reason: &'static str) -> Self {
        Self { sizes: Some(Sizes { measure, range, reason }), ..self }
    }

    /// The size of a fault with this value.
    #[must_use]
    pub fn size(&self, number: f64) -> f64 {
        self.sizes.map_or(number, |sizes| sizes.measure.size(number))
    }
}

/// One fault of one flight. Displayed in the syntax of [`parse`](Self::parse).
///
/// ```
/// use stampfly_sim::fault::{Class, Fault, FaultKind, Moment, When};
/// const TABLE: &[FaultKind] = &[FaultKind::or_last("tof-stuck", ("m", 0.0, 10.0), Class::Degraded, "The range stays.")];
/// let fault = Fault::parse("tof-stuck=0.03@hover+2", TABLE)?;
/// assert_eq!((fault.value, fault.when), (Some(0.03), When::Moment(Moment::Hover)));
/// assert_eq!(fault.to_string(), "tof-stuck=0.03@hover+2");
/// assert!(Fault::parse("tof-late@hover", TABLE).unwrap_err().to_string().contains("tof-stuck"));
/// # Ok::<(), stampfly_sim::fault::FaultError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// Row of the table.
    pub kind: &'static FaultKind,
    /// Value; `None` if it has none or keeps the last value.
    pub value: Option<f64>,
    /// Begin.
    pub when: When,
    /// Duration; `None` until the end of the flight.
    pub lasts: Option<Duration>,
}

impl Fault {
    /// Parses a fault of this table.
    ///
    /// # Errors
    /// The problem, and what is accepted instead.
    pub fn parse(text: &str, table: &'static [FaultKind]) -> Result<Self, FaultError> {
        let wrong = |problem| FaultError { text: text.into(), problem };
        let (what, rest) = text.split_once('@').ok_or_else(|| wrong(Problem::NoMoment))?;
        let (name, value) = match what.split_once('=') {
            Some((name, value)) => (name, Some(value)),
            None => (what, None),
        };
        let kind = table.iter().find(|kind| kind.name == name.trim());
        let kind = kind.ok_or_else(|| wrong(Problem::Unknown(name.trim().into(), table)))?;
        let value = match (value, kind.value.range()) {
            (None, _) => kind.value.default(),
            (Some(_), None) => return Err(wrong(Problem::NoValue(kind.name))),
            (Some(value), Some([low, high])) => {
                // NaN and values out of range are refused.
                let number = number(value).filter(|value| (low..=high).contains(value));
                Some(number.ok_or_else(|| wrong(Problem::Value(value.into(), kind)))?)
            }
        };
        let (when, lasts) = match rest.split_once('+') {
            Some((when, lasts)) => (when, Some(lasts)),
            None => (rest, None),
        };
        let when = When::parse(when.trim()).ok_or_else(|| wrong(Problem::When(when.into())))?;
        let lasts = lasts.map(|lasts| seconds(lasts).ok_or_else(|| wrong(Problem::Lasts(lasts.into())))).transpose()?;
        Ok(Self { kind, value, when, lasts })
    }

    /// The fault of this row with its default value, which [`Injector::begin`] starts on request.
    /// On its own it would begin after a century.
    #[must_use]
    pub const fn on_demand(kind: &'static FaultKind) -> Self {
        let when = When::After(Duration::from_secs(100 * 365 * 86_400));
        Self { kind, value: kind.value.default(), when, lasts: None }
    }

    /// These faults, and all others of the table [on demand](Self::on_demand): everything that a
    /// user can inject during the flight.
    #[must_use]
    pub fn and_on_demand(faults: &[Self], table: &'static [FaultKind]) -> Vec<Self> {
        let others = table.iter().filter(|kind| faults.iter().all(|fault| fault.kind != *kind));
        faults.iter().copied().chain(others.map(Self::on_demand)).collect()
    }

    /// The worst acceptable class.
    #[must_use]
    pub fn expected(&self) -> Class {
        match (self.kind.above, self.value) {
            (Some((limit, class)), Some(value)) if self.kind.size(value) > limit => class,
            _ => self.kind.expected,
        }
    }
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite())
}

/// Parses 0 to 3600 seconds.
fn seconds(text: &str) -> Option<Duration> {
    let seconds = number(text).filter(|seconds| (0.0..=3600.0).contains(seconds))?;
    Some(Duration::from_micros((seconds * 1e6).round() as u64))
}

/// Seconds with the digits that were given: dividing rounds to the nearest value, multiplying by
/// 1e-6 does not.
fn shown(time: Duration) -> f64 {
    time.as_micros() as f64 / 1e6
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name)?;
        if let Some(value) = self.value {
            write!(f, "={value}")?;
        }
        write!(f, "@{}", self.when)?;
        self.lasts.map_or(Ok(()), |lasts| write!(f, "+{}", shown(lasts)))
    }
}

/// Why a text is not a fault of this vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultError {
    text: String,
    problem: Problem,
}

#[derive(Clone, Debug, PartialEq)]
enum Problem {
    NoMoment,
    Unknown(String, &'static [FaultKind]),
    NoValue(&'static str),
    Value(String, &'static FaultKind),
    When(String),
    Lasts(String),
}

impl fmt::Display for FaultError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "'{}': ", self.text)?;
        match &self.problem {
            Problem::NoMoment => write!(f, "a fault is NAME[=VALUE]@WHEN[+SECONDS]; the moment is missing"),
            Problem::Unknown(name, []) => write!(f, "there is no fault '{name}': this vehicle has no faults"),
            Problem::Unknown(name, table) => {
                let names: Vec<_> = table.iter().map(|kind| kind.name).collect();
                write!(f, "there is no fault '{name}'; there are: {}", names.join(", "))
            }
            Problem::NoValue(name) => write!(f, "{name} takes no value"),
            Problem::Value(value, kind) => {
                let [low, high] = kind.value.range().unwrap_or_default();
                write!(f, "{}: '{value}' is no number from {low} to {high} {}", kind.name, kind.value.unit())
            }
            Problem::When(when) => {
                let names: Vec<_> = Moment::ALL.iter().map(|moment| moment.name()).collect();
                write!(f, "'{when}' is none of {}, and no number of seconds up to 3600", names.join(", "))
            }
            Problem::Lasts(lasts) => write!(f, "'{lasts}' is no number of seconds up to 3600"),
        }
    }
}

impl core::error::Error for FaultError {}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &[FaultKind] = &[
        FaultKind::plain("silent", Class::Cut, "Nothing comes."),
        FaultKind::number("bias", ("m", 0.5, -1.0, 1.0), Class::Degraded, "It is off.")
            .sized(Measure::EitherWay, [0.01, 1.0], "a test")
            .above(0.8, Class::Landed),
        FaultKind::or_last("stuck", ("m", 0.0, 2.0), Class::Degraded, "It stays."),
    ];

    #[test]
    fn what_can_be_broken_on_demand_is_whatever_was_not_asked_for() {
        let asked = Fault::parse("bias=0.25@3", TABLE).expect("a fault");
        let all = Fault::and_on_demand(&[asked], TABLE);
        let names: Vec<_> = all.iter().map(|fault| fault.kind.name).collect();
        assert_eq!((all[0], &names[..]), (asked, &["bias", "silent", "stuck"][..]));
        let injector = Injector::new(stampfly_types::Instant::ZERO, &all);
        assert!(!injector.is_active(1, stampfly_types::Instant::from_secs(86_400)), "nobody has demanded it");
    }

    #[test]
    fn a_fault_survives_its_text() {
        for moment in Moment::ALL {
            for what in ["silent", "bias=-0.25", "stuck", "stuck=0.03"] {
                for lasts in ["", "+2", "+0.0025"] {
                    let text = format!("{what}@{}{lasts}", moment.name());
                    assert_eq!(Fault::parse(&text, TABLE).expect(&text).to_string(), text);
                }
            }
        }
        let fault = Fault::parse("silent@12.5+0.1", TABLE).expect("a fault");
        assert_eq!(fault.when, When::After(Duration::from_micros(12_500_000)));
        assert_eq!(fault.to_string(), "silent@12.5+0.1");
        assert_eq!(Fault::parse("bias@touch", TABLE).expect("a fault").to_string(), "bias=0.5@touch", "the default");
    }

    #[test]
    fn mistakes_are_named() {
        let message = |text: &str| Fault::parse(text, TABLE).expect_err("a mistake").to_string();
        assert!(message("silent").contains("the moment is missing"));
        assert!(message("loud@hover").contains("no fault 'loud'; there are: silent, bias, stuck"));
        assert!(message("silent=1@hover").contains("silent takes no value"));
        for value in ["2", "x", "NaN", "inf", ""] {
            assert!(message(&format!("bias={value}@hover")).contains("is no number from -1 to 1 m"), "{value}");
        }
        assert!(message("silent@noon").contains("'noon' is none of calibration, ground, spool"));
        assert!(message("silent@-1").contains("'-1' is none of"));
        assert!(message("silent@hover+x").contains("'x' is no number of seconds"));
        let nothing = Fault::parse("silent@hover", &[]).expect_err("a mistake").to_string();
        assert!(nothing.contains("this vehicle has no faults"), "{nothing}");
    }

    #[test]
    fn a_larger_size_may_have_another_acceptable_end() {
        let expected = |text| Fault::parse(text, TABLE).expect("a fault").expected();
        assert_eq!(["bias@1", "bias=-0.7@1"].map(expected), [Class::Degraded; 2]);
        assert_eq!(["bias=0.9@1", "bias=-0.9@1"].map(expected), [Class::Landed; 2], "either way");
    }
}
