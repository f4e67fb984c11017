//! Reading and changing parameters by name or number, whatever holds their values.
//!
//! [`Parameters`] is the interface of a console, a radio link, a configuration page or a command
//! line to a vehicle's parameters. It is object safe: a service takes a `&mut dyn Parameters` and
//! works with any vehicle. [`parameters!`](crate::parameters!) implements it for a configuration
//! struct; implement it by hand where values are kept in another way.
//!
//! The functions add the checks: [`set`] changes one parameter if its range and the rules allow
//! it, [`set_alone`] checks the range only, [`validate`] checks everything, [`settle`] repairs
//! values that another version has stored.
//!
//! Values are `f32` unless the type says otherwise, as in `Parameters<f64>`. Control loops do not
//! use this module; a component reads the fields of its configuration.

use crate::rules::Conflict;
use core::fmt;

/// The type of a parameter's value: `f32` or `f64`.
pub trait Number: Copy + PartialOrd + fmt::Debug + fmt::Display + Into<f64> + sealed::Sealed + 'static {}

impl Number for f32 {}
impl Number for f64 {}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// The description of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo<'p, N = f32> {
    /// The name, without spaces, for example `rate.roll.kp`.
    pub name: &'p str,
    /// SI unit, `"1"` where there is none.
    pub unit: &'p str,
    /// Smallest value accepted.
    pub min: N,
    /// Largest value accepted.
    pub max: N,
    /// What the parameter does.
    pub meaning: &'p str,
    /// Does a change take effect while the vehicle is armed? If not, it waits until the vehicle is
    /// disarmed.
    pub in_flight: bool,
}

impl<N: Number> ParameterInfo<'_, N> {
    /// Is the value within the range? NaN is not.
    pub fn accepts(&self, value: N) -> bool {
        (self.min..=self.max).contains(&value)
    }

    /// The error for a value that is not.
    pub(crate) const fn out_of_range(&self) -> ParameterError<N> {
        ParameterError::OutOfRange { min: self.min, max: self.max }
    }
}

/// Why a parameter was not changed. It has its previous value.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ParameterError<N = f32> {
    /// There is no parameter of this name or number.
    Unknown,
    /// The value is outside the range, or is NaN.
    OutOfRange {
        /// Smallest value accepted.
        min: N,
        /// Largest value accepted.
        max: N,
    },
    /// The value is in its range, but contradicts that of another parameter.
    Conflict(Conflict),
    /// There is no room for another change now. Try again later.
    Busy,
}

impl<N: Number> fmt::Display for ParameterError<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => f.write_str("there is no such parameter"),
            Self::OutOfRange { min, max } => write!(f, "the value must be from {min} to {max}"),
            Self::Conflict(conflict) => conflict.fmt(f),
            Self::Busy => f.write_str("too many changes are waiting, try again"),
        }
    }
}

impl<N: Number> core::error::Error for ParameterError<N> {}

impl<N> From<Conflict> for ParameterError<N> {
    fn from(conflict: Conflict) -> Self {
        Self::Conflict(conflict)
    }
}

/// The message for a person who changes a parameter of an armed vehicle that does not change [in
/// flight](ParameterInfo::in_flight).
pub const WAITS: &str = "not in flight: waits until the vehicle is disarmed";

/// The parameters of a vehicle, numbered from zero without gaps.
///
/// ```
/// use stampfly_param::{ParameterError, ParameterInfo, Parameters, parameters};
///
/// struct Gain(f32);
///
/// impl Parameters for Gain {
///     fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
///         let gain = ParameterInfo {
///             name: "drive.gain", unit: "1/m", min: 0.0, max: 2.0, meaning: "duty per metre", in_flight: false,
///         };
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
/// assert_eq!(parameters::set(&mut gain, "drive.gain", 7.0), Err(ParameterError::OutOfRange { min: 0.0, max: 2.0 }));
/// assert_eq!(gain.get(0), Some(1.5));
/// ```
pub trait Parameters<N: Number = f32> {
    /// The description of the parameter with this number; `None` behind the last.
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_, N>>;

    /// Its value; `None` behind the last.
    fn get(&self, index: usize) -> Option<N>;

    /// Changes its value without looking at the others. To change one parameter use [`set`](fn@set)
    /// or [`set_at`], which check the rules; to change several in any order use [`set_alone`] and
    /// [`check`](Self::check) once at the end.
    ///
    /// # Errors
    /// When there is no such parameter or it does not take the value; it is unchanged then.
    fn set(&mut self, index: usize, value: N) -> Result<(), ParameterError<N>>;

    /// Checks the rules between parameters: all of them, or those about one parameter. Without
    /// rules it always succeeds.
    ///
    /// # Errors
    /// [`ParameterError::Conflict`].
    fn check(&self, _about: Option<usize>) -> Result<(), ParameterError<N>> {
        Ok(())
    }
}

/// Every parameter with its value, in the order of their numbers.
///
/// ```
/// # stampfly_param::parameters! {
/// #     /// A lamp.
/// #     pub struct Lamp {
/// #         /// Light.
/// #         light: Light {
/// #             /// Brightness.
/// #             level = 0.5 in [0.0, 1.0] "1";
/// #         }
/// #     }
/// # }
/// let lamp = Lamp::default();
/// for (info, value) in stampfly_param::parameters::iter(&lamp) {
///     assert_eq!(format!("{} = {value} {}", info.name, info.unit), "light.level = 0.5 1");
/// }
/// ```
pub fn iter<N: Number>(parameters: &dyn Parameters<N>) -> impl Iterator<Item = (ParameterInfo<'_, N>, N)> {
    (0..).map_while(|index| parameters.describe(index).zip(parameters.get(index)))
}

/// The number of the parameter of this name.
///
/// # Errors
/// [`ParameterError::Unknown`].
pub fn find<N: Number>(parameters: &dyn Parameters<N>, name: &str) -> Result<usize, ParameterError<N>> {
    let mut names = (0..).map_while(|index| parameters.describe(index).map(|info| info.name == name));
    names.position(|found| found).ok_or(ParameterError::Unknown)
}

/// Changes the parameter of this name if its range and the rules allow the value. Returns its
/// number.
///
/// # Errors
/// When there is no such parameter, the value is out of range, or it contradicts another parameter.
/// Nothing has changed then.
pub fn set<N: Number>(parameters: &mut dyn Parameters<N>, name: &str, value: N) -> Result<usize, ParameterError<N>> {
    let index = find(parameters, name)?;
    set_at(parameters, index, value).map(|()| index)
}

/// Changes the parameter with this number as [`set`](fn@set) does.
///
/// # Errors
/// As there.
pub fn set_at<N: Number>(parameters: &mut dyn Parameters<N>, index: usize, value: N) -> Result<(), ParameterError<N>> {
    let before = parameters.get(index).ok_or(ParameterError::Unknown)?;
    set_alone(parameters, index, value)?;
    if let Err(conflict) = parameters.check(Some(index)) {
        parameters.set(index, before)?;
        return Err(conflict);
    }
    Ok(())
}

/// Changes the parameter with this number if its range allows the value, without looking at the
/// others. Call [`check`](Parameters::check) after the last of several changes.
///
/// # Errors
/// When there is no such parameter or the value is out of range. Nothing has changed then.
pub fn set_alone<N: Number>(
    parameters: &mut dyn Parameters<N>,
    index: usize,
    value: N,
) -> Result<(), ParameterError<N>> {
    let info = parameters.describe(index).ok_or(ParameterError::Unknown)?;
    if !info.accepts(value) {
        return Err(info.out_of_range());
    }
    parameters.set(index, value)
}

/// Checks the range of every value, and all rules.
///
/// # Errors
/// The first range or rule that is violated.
pub fn validate<N: Number>(parameters: &dyn Parameters<N>) -> Result<(), ParameterError<N>> {
    match iter(parameters).find(|(info, value)| !info.accepts(*value)) {
        Some((info, _)) => Err(info.out_of_range()),
        None => parameters.check(None),
    }
}

/// Sets both parameters of every violated rule to their defaults. For values from a storage:
/// another version may have allowed them, and the vehicle should start nevertheless. `replaced`
/// receives each conflict. Returns their number.
///
/// It terminates: every turn sets at least one more parameter to its default, and the defaults
/// violate no rule.
///
/// ```
/// use stampfly_param::parameters;
///
/// parameters! {
///     /// Speeds.
///     pub struct Speeds {
///         /// Of the boat.
///         boat: BoatSpeeds {
///             /// In the harbour.
///             slow = 1.0 in [0.0, 9.0] "m/s";
///             /// At sea.
///             fast = 2.0 in [0.0, 9.0] "m/s";
///         }
///     }
///     where speeds:
///     "boat.slow" "boat.fast" speeds.boat.slow <= speeds.boat.fast => "slow is faster";
/// }
///
/// let mut stored = Speeds { boat: BoatSpeeds { slow: 5.0, fast: 3.0 } };
/// let mut reported = String::new();
/// assert_eq!(parameters::settle(&mut stored, &Speeds::default(), &mut |conflict| reported = conflict.to_string()), 1);
/// assert_eq!((stored, reported.as_str()), (Speeds::default(), "boat.slow with boat.fast: slow is faster"));
/// ```
pub fn settle<N: Number>(
    parameters: &mut dyn Parameters<N>,
    defaults: &dyn Parameters<N>,
    replaced: &mut dyn FnMut(ParameterError<N>),
) -> usize {
    let mut conflicts = 0;
    while parameters.describe(conflicts).is_some() {
        let Err(error) = parameters.check(None) else { break };
        conflicts += 1;
        replaced(error);
        let ParameterError::Conflict(Conflict { parameters: pair, .. }) = error else { break };
        for index in pair.iter().filter_map(|name| find(defaults, name).ok()) {
            let _ = defaults.get(index).map(|value| parameters.set(index, value));
        }
    }
    conflicts
}
