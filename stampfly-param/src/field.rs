//! The types that a field of a configuration can have to be a parameter.

use crate::Number;
use stampfly_types::Duration;

/// A field whose value is represented by a number: a number itself, yes or no, a time in seconds,
/// or an enumeration.
///
/// ```
/// use stampfly_param::ParameterField;
/// use stampfly_param::types::Duration;
/// assert_eq!(Duration::from_number(0.5), Some(Duration::from_millis(500)));
/// assert_eq!(Duration::from_millis(500).number(), 0.5);
/// assert_eq!(bool::from_number(0.5), None);
/// ```
pub trait ParameterField<N: Number = f32>: Copy {
    /// The number for this value.
    fn number(self) -> N;
    /// The value for this number, if there is one.
    fn from_number(number: N) -> Option<Self>;
}

impl<N: Number> ParameterField<N> for N {
    fn number(self) -> N {
        self
    }
    fn from_number(number: N) -> Option<Self> {
        Some(number)
    }
}

/// 1 for yes, 0 for no.
impl ParameterField for bool {
    fn number(self) -> f32 {
        f32::from(u8::from(self))
    }
    fn from_number(number: f32) -> Option<Self> {
        [false, true].into_iter().find(|truth| truth.number() == number)
    }
}

/// Up to 65535, each of which an `f32` represents exactly.
impl ParameterField for u16 {
    fn number(self) -> f32 {
        f32::from(self)
    }
    fn from_number(number: f32) -> Option<Self> {
        let whole = number as u16;
        (f32::from(whole) == number).then_some(whole)
    }
}

/// Seconds, rounded to microseconds. A duration that was set by a number is read back as the same
/// number: up to 16 seconds every microsecond has a number of its own, and above that a number
/// always gives the same duration.
impl ParameterField for Duration {
    fn number(self) -> f32 {
        // Not `seconds`, which is off by one in the last place for some.
        self.seconds_f64() as f32
    }
    fn from_number(number: f32) -> Option<Self> {
        Some(Self::from_seconds(number))
    }
}

/// Makes enumerations that [`message_enum!`](crate::types::message_enum!) declares usable as
/// parameters, by their numbers.
///
/// ```
/// use stampfly_param::{ParameterField, parameter_enums};
///
/// stampfly_param::types::message_enum! {
///     /// A gear.
///     pub enum Gear {
///         /// Not in gear.
///         #[default]
///         Neutral = 0,
///         /// Ahead.
///         Ahead = 1,
///     }
/// }
///
/// parameter_enums!(Gear);
/// assert_eq!(<Gear as ParameterField>::from_number(1.0), Some(Gear::Ahead));
/// assert_eq!(<Gear as ParameterField>::from_number(0.5), None);
/// ```
#[macro_export]
macro_rules! parameter_enums {
    ($($Enum:ident),+ $(,)?) => { $(
        impl $crate::ParameterField for $Enum {
            fn number(self) -> f32 {
                self as u8 as f32
            }
            fn from_number(number: f32) -> Option<Self> {
                Self::ALL.iter().copied().find(|variant| *variant as u8 as f32 == number)
            }
        }
    )+ };
}
