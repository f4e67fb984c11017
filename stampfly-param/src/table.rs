//! The parameters of a vehicle as a table: name, default, range and unit in one line each.
//!
//! [`parameters!`](crate::parameters!) makes one plain struct per group, for the component that is configured by it, and one
//! message of all groups, so that the set in use is a topic: logged, replayed, and with the table's values as its default.
//! Names are `group.name`. To change values of a running vehicle use a [`ParameterSet`](crate::ParameterSet), to keep them
//! over a power cut a [`ParameterStore`](crate::ParameterStore).
//!
//! Only `f32`. A choice between two components is not a number: make it an enumeration of the vehicle's configuration.

use crate::rules::{self, Conflict, Rule};
use core::fmt;

/// One parameter of the set `P`: a line of the table.
#[derive(Clone, Copy, Debug)]
pub struct Parameter<P> {
    /// `group.name`.
    pub name: &'static str,
    /// Smallest value accepted.
    pub min: f32,
    /// Largest value accepted.
    pub max: f32,
    /// SI unit, `"1"` where there is none.
    pub unit: &'static str,
    /// What it does: its documentation in the table.
    pub meaning: &'static str,
    #[doc(hidden)]
    pub __field: fn(&mut P) -> &mut f32,
}

/// Why parameters were refused. Nothing has changed then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ParameterError {
    /// There is no such parameter.
    Unknown,
    /// The value is outside its range, or not a number.
    OutOfRange,
    /// Each value is in its range, but with these two the vehicle cannot do its work.
    Conflict(Conflict),
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => f.write_str("there is no such parameter"),
            Self::OutOfRange => f.write_str("the value is out of range"),
            Self::Conflict(conflict) => conflict.fmt(f),
        }
    }
}

impl core::error::Error for ParameterError {}

impl<P: Copy> Parameter<P> {
    /// The value in this set.
    #[must_use]
    pub fn get(&self, parameters: &P) -> f32 {
        *(self.__field)(&mut { *parameters })
    }

    /// Changes the value.
    ///
    /// # Errors
    /// [`ParameterError::OutOfRange`].
    pub fn set(&self, parameters: &mut P, value: f32) -> Result<(), ParameterError> {
        if !(self.min..=self.max).contains(&value) {
            return Err(ParameterError::OutOfRange);
        }
        *(self.__field)(parameters) = value;
        Ok(())
    }
}

/// A set of parameters with its table. Implemented by [`parameters!`](crate::parameters!).
pub trait ParameterTable: Copy + Default + 'static {
    /// Every parameter, in the order it was declared in. The place is its number in a
    /// [`ParameterRequest`](crate::ParameterRequest).
    const TABLE: &'static [Parameter<Self>];

    /// Which values, each being in its range, cannot be together.
    const RULES: &'static [Rule<Self>];

    /// The parameter of this name.
    ///
    /// # Errors
    /// [`ParameterError::Unknown`].
    fn find(name: &str) -> Result<&'static Parameter<Self>, ParameterError> {
        Self::TABLE.iter().find(|parameter| parameter.name == name).ok_or(ParameterError::Unknown)
    }

    /// Checks the set as a whole.
    ///
    /// # Errors
    /// When a value is outside its range, or two break a rule.
    fn validate(&self) -> Result<(), ParameterError> {
        if !Self::TABLE.iter().all(|row| (row.min..=row.max).contains(&row.get(self))) {
            return Err(ParameterError::OutOfRange);
        }
        rules::check(Self::RULES, self, None).map_err(ParameterError::Conflict)
    }
}

/// Declares the parameters of a vehicle.
///
/// ```
/// use stampfly_param::{ParameterError, ParameterTable, parameters};
///
/// parameters! {
///     /// The parameters of a boat.
///     pub struct BoatParameters, where p:
///     "motor.idle" "motor.full" p.motor.idle < p.motor.full => "the throttle would do nothing";
///
///     /// Motor.
///     motor: MotorParameters {
///         /// Duty at full throttle.
///         full = 0.9 in [0.1, 1.0] "1";
///         /// Duty at rest.
///         idle = 0.05 in [0.0, 0.5] "1";
///     }
///     /// Rudder.
///     rudder: RudderParameters {
///         /// Angle at the stop.
///         max_angle = 0.5 in [0.1, 1.0] "rad";
///     }
/// }
///
/// let mut parameters = BoatParameters::default();
/// assert_eq!(parameters.motor.full, 0.9);
/// BoatParameters::find("motor.idle")?.set(&mut parameters, 0.5)?;
/// BoatParameters::find("motor.full")?.set(&mut parameters, 0.4)?;
/// let refused = parameters.validate().unwrap_err();
/// assert_eq!(refused.to_string(), "motor.idle with motor.full: the throttle would do nothing");
/// assert_eq!(BoatParameters::find("rudder.max_angle")?.set(&mut parameters, f32::NAN), Err(ParameterError::OutOfRange));
/// # Ok::<(), ParameterError>(())
/// ```
#[macro_export]
macro_rules! parameters {
    (
        $(#[$set_doc:meta])* $vis:vis struct $Set:ident, where $set:ident:
        $($first:literal $second:literal $holds:expr => $reason:literal;)*
        $($(#[$group_doc:meta])* $group:ident: $Group:ident {
            $($(#[doc = $doc:literal])* $name:ident = $default:literal in [$min:literal, $max:literal] $unit:literal;)+
        })+
    ) => {
        $(
            $(#[$group_doc])*
            #[derive(Clone, Copy, Debug, PartialEq)]
            $vis struct $Group { $($(#[doc = $doc])* pub $name: f32),+ }

            impl Default for $Group {
                fn default() -> Self { Self { $($name: $default),+ } }
            }

            // The numbers of a group are one field of the message, because a message's own default is zeros.
            impl $crate::types::Field for $Group {
                const KIND: $crate::types::FieldKind = $crate::types::FieldKind::F32;
                const COUNT: usize = [$($default),+].len();
                const SIZE: usize = Self::COUNT;
                fn initial() -> Self {
                    Self::default()
                }
                fn write(&self, words: &mut [u32]) {
                    words.iter_mut().zip([$(self.$name),+]).for_each(|(word, value)| *word = value.to_bits());
                }
                fn read(words: &[u32]) -> Option<Self> {
                    let mut words = words.iter();
                    Some(Self { $($name: f32::from_bits(*words.next()?)),+ })
                }
            }
        )+

        $crate::types::message! {
            $(#[$set_doc])*
            $vis struct $Set { $($(#[$group_doc])* $group: $Group ["SI"]),+ }
        }

        impl $crate::ParameterTable for $Set {
            const TABLE: &'static [$crate::Parameter<Self>] = &[$($($crate::Parameter {
                name: concat!(stringify!($group), ".", stringify!($name)),
                min: $min, max: $max, unit: $unit, meaning: concat!($($doc),*).trim_ascii(), __field: |parameters| &mut parameters.$group.$name,
            }),+),+];

            const RULES: &'static [$crate::rules::Rule<Self>] =
                $crate::rules! { $set: $($first $second $holds => $reason;)* };
        }
    };
}
