//! Parameters of a plant as a table: each with name, unit, range and meaning, settable by name.
//!
//! The macro declares the structure and one constant of it. For what an airframe is made of; not for the flight stack's parameters, which have no
//! heap and a store.

use core::fmt;

/// One line of a table of parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    /// The field's name.
    pub name: &'static str,
    /// The present value.
    pub value: f64,
    /// SI unit, `"1"` where there is none.
    pub unit: &'static str,
    /// What it is.
    pub description: &'static str,
    /// The smallest and largest value that make sense.
    pub range: (f64, f64),
}

/// A parameter could not be set.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ParameterError {
    /// There is no parameter of this name.
    Unknown(String),
    /// The value is no number, or outside the range that makes sense.
    OutOfRange {
        /// The parameter.
        name: &'static str,
        /// The smallest and largest value accepted.
        range: (f64, f64),
    },
    /// Each number is in its range, but together they are no vehicle, or none that can be simulated.
    Together(String),
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(name) => write!(f, "there is no plant parameter {name:?}"),
            Self::OutOfRange { name, range: (low, high) } => write!(f, "{name} must lie between {low} and {high}"),
            Self::Together(reason) => f.write_str(reason),
        }
    }
}

impl std::error::Error for ParameterError {}

macro_rules! parameters {
    ($(#[$meta:meta])* $Name:ident, $(#[$example_meta:meta])* $EXAMPLE:ident { $($field:ident = $example:literal [$unit:literal] in $low:literal ..= $high:literal, $description:literal;)* }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $Name {
            $(#[doc = concat!($description, " Unit: ", $unit, ".")] pub $field: f64,)*
        }

        impl $Name {
            $(#[$example_meta])*
            pub const $EXAMPLE: Self = Self { $($field: $example),* };

            /// Sets a parameter by name.
            ///
            /// # Errors
            /// When there is no such parameter or the value makes no sense; nothing changes then.
            pub fn set(&mut self, name: &str, value: f64) -> Result<(), $crate::plant::ParameterError> {
                match name {
                    $(stringify!($field) => {
                        if !($low..=$high).contains(&value) {
                            return Err($crate::plant::ParameterError::OutOfRange { name: stringify!($field), range: ($low, $high) });
                        }
                        self.$field = value;
                    })*
                    _ => return Err($crate::plant::ParameterError::Unknown(name.to_owned())),
                }
                Ok(())
            }

            /// Every parameter, in the order of the table.
            pub fn iter(&self) -> impl Iterator<Item = $crate::plant::ParameterInfo> {
                [$($crate::plant::ParameterInfo {
                    name: stringify!($field),
                    value: self.$field,
                    unit: $unit,
                    description: $description,
                    range: ($low, $high),
                }),*].into_iter()
            }
        }
    };
}

pub(crate) use parameters;
