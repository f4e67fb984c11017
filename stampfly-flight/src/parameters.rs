//! Parameters by name, as a console or a radio link sees them.
//!
//! A vehicle implements [`Parameters`] on whatever holds its values: a table of fields, `stampfly-param`, a single gain.
//! [`find`] and [`set`] do the rest. Not for runnables: they are configured once, when the vehicle is assembled.

use core::fmt;
use stampfly_types::Duration;

/// What is known about a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo<'p> {
    /// `function.target.parameter`, without spaces.
    pub name: &'p str,
    /// SI unit, `"1"` where there is none.
    pub unit: &'p str,
    /// Smallest value accepted.
    pub min: f32,
    /// Largest value accepted.
    pub max: f32,
    /// What it does.
    pub meaning: &'p str,
}

/// Why a parameter was not changed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ParameterError {
    /// There is no parameter of this name.
    Unknown,
    /// The value is outside the range, or not a number.
    OutOfRange {
        /// Smallest value accepted.
        min: f32,
        /// Largest value accepted.
        max: f32,
    },
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => f.write_str("there is no such parameter"),
            Self::OutOfRange { min, max } => write!(f, "the value must be from {min} to {max}"),
        }
    }
}

impl core::error::Error for ParameterError {}

/// A vehicle's parameters, numbered from zero.
pub trait Parameters {
    /// The parameter with this number; `None` behind the last.
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_>>;

    /// Its value; `None` behind the last.
    fn get(&self, index: usize) -> Option<f32>;

    /// Changes its value.
    ///
    /// # Errors
    /// When there is no such parameter or it does not take the value; it is unchanged then.
    fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError>;
}

/// What a parameter can be: a number, a time in seconds, or one of several kinds by its number.
///
/// ```
/// use stampfly_flight::parameters::Value;
/// use stampfly_types::Duration;
/// assert_eq!(Duration::from_number(0.5), Some(Duration::from_millis(500)));
/// assert_eq!(Duration::from_millis(500).number(), 0.5);
/// ```
pub trait Value: Copy {
    /// The number that stands for it.
    fn number(self) -> f32;
    /// What a number stands for, if it does.
    fn from_number(number: f32) -> Option<Self>;
}

impl Value for f32 {
    fn number(self) -> f32 {
        self
    }
    fn from_number(number: f32) -> Option<Self> {
        Some(number)
    }
}

/// 1 for yes, 0 for no.
impl Value for bool {
    fn number(self) -> f32 {
        f32::from(u8::from(self))
    }
    fn from_number(number: f32) -> Option<Self> {
        [false, true].into_iter().find(|truth| truth.number() == number)
    }
}

/// Whole microseconds. A time comes back exactly: up to 16 seconds every microsecond has a number of its own, and above that
/// a number is always the same time.
impl Value for Duration {
    fn number(self) -> f32 {
        // Not `seconds`, which is off by one in the last place for some.
        self.seconds_f64() as f32
    }
    fn from_number(number: f32) -> Option<Self> {
        Some(Self::from_seconds(number))
    }
}

/// The number of the parameter of this name.
///
/// # Errors
/// [`ParameterError::Unknown`].
pub fn find(parameters: &dyn Parameters, name: &str) -> Result<usize, ParameterError> {
    let mut names = (0..).map_while(|index| parameters.describe(index).map(|info| info.name == name));
    names.position(|found| found).ok_or(ParameterError::Unknown)
}

/// Changes the parameter of this name, if the value is in its range. Returns its number.
///
/// ```
/// use stampfly_flight::parameters::{self, ParameterError, ParameterInfo, Parameters};
///
/// struct Gain(f32);
///
/// impl Parameters for Gain {
///     fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
///         let gain = ParameterInfo { name: "drive.gain", unit: "1/m", min: 0.0, max: 2.0, meaning: "duty per metre" };
///         (index == 0).then_some(gain)
///     }
///     fn get(&self, index: usize) -> Option<f32> {
///         (index == 0).then_some(self.0)
///     }
///     fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError> {
///         self.0 = if index == 0 { value } else { return Err(ParameterError::Unknown) };
///         Ok(())
///     }
/// }
///
/// let mut gain = Gain(0.5);
/// assert_eq!(parameters::set(&mut gain, "drive.gain", 1.5), Ok(0));
/// assert_eq!(parameters::set(&mut gain, "drive.gian", 1.0), Err(ParameterError::Unknown));
/// assert!(parameters::set(&mut gain, "drive.gain", f32::NAN).is_err());
/// assert_eq!(gain.get(0), Some(1.5));
/// ```
///
/// # Errors
/// When there is no such parameter or the value is out of its range; nothing has changed then.
pub fn set(parameters: &mut dyn Parameters, name: &str, value: f32) -> Result<usize, ParameterError> {
    let index = find(parameters, name)?;
    let ParameterInfo { min, max, .. } = parameters.describe(index).ok_or(ParameterError::Unknown)?;
    if !(min..=max).contains(&value) {
        return Err(ParameterError::OutOfRange { min, max });
    }
    parameters.set(index, value).map(|()| index)
}
