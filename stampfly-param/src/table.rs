//! The parameters of a vehicle as a table, one line each: name, range, unit and meaning.
//!
//! [`parameters!`](crate::parameters!) declares it in one of two forms:
//!
//! | form | values are | use it when |
//! |---|---|---|
//! | `struct Name { group: Group { … } }` | fields that the macro declares, `f32` | parameters are all there is to configure |
//! | `impl Config { … }` | fields of a struct of yours | the components already have configurations |
//!
//! Either way the struct is a [`ParameterTable`], and with it [`Parameters`].

use crate::rules::{self, Rule};
use crate::{Number, ParameterError, ParameterInfo, Parameters};

/// One parameter of a configuration `C`: a line of its table.
#[derive(Clone, Copy, Debug)]
pub struct Parameter<C, N = f32> {
    /// Name, range, unit, meaning.
    pub info: ParameterInfo<'static, N>,
    #[doc(hidden)]
    pub __get: fn(&C) -> N,
    #[doc(hidden)]
    pub __set: fn(&mut C, N) -> Option<()>,
}

impl<C, N: Number> Parameter<C, N> {
    /// The value in this configuration.
    #[must_use]
    pub fn get(&self, config: &C) -> N {
        (self.__get)(config)
    }

    /// Changes the value in this configuration, without looking at other parameters.
    ///
    /// # Errors
    /// [`ParameterError::OutOfRange`], also for a number that the field's type does not have.
    pub fn set(&self, config: &mut C, value: N) -> Result<(), ParameterError<N>> {
        let in_range = self.info.accepts(value).then(|| (self.__set)(config, value)).flatten();
        in_range.ok_or(self.info.out_of_range())
    }
}

/// A configuration with a table of its parameters. Implemented by
/// [`parameters!`](crate::parameters!).
///
/// ```
/// use stampfly_param::{ParameterTable, parameters};
///
/// struct Drive { gain: f32, reversed: bool }
///
/// parameters! {
///     impl Drive {
///         /// Duty per metre.
///         gain in [0.0, 2.0] "1/m";
///         /// 1: turns the other way.
///         reversed in [0.0, 1.0] "1";
///     }
/// }
///
/// let names: Vec<_> = Drive::TABLE.iter().map(|parameter| parameter.info.name).collect();
/// assert_eq!(names, ["gain", "reversed"]);
/// ```
pub trait ParameterTable<N: Number = f32>: Sized + 'static {
    /// Every parameter. Its place here is its number everywhere else.
    const TABLE: &'static [Parameter<Self, N>];

    /// Values that must not be combined though each is in its range.
    const RULES: &'static [Rule<Self>];

    /// The parameter of this name.
    ///
    /// # Errors
    /// [`ParameterError::Unknown`].
    fn find(name: &str) -> Result<&'static Parameter<Self, N>, ParameterError<N>> {
        Self::TABLE.iter().find(|parameter| parameter.info.name == name).ok_or(ParameterError::Unknown)
    }
}

impl<N: Number, C: ParameterTable<N>> Parameters<N> for C {
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_, N>> {
        C::TABLE.get(index).map(|parameter| parameter.info)
    }

    fn get(&self, index: usize) -> Option<N> {
        C::TABLE.get(index).map(|parameter| parameter.get(self))
    }

    fn set(&mut self, index: usize, value: N) -> Result<(), ParameterError<N>> {
        C::TABLE.get(index).ok_or(ParameterError::Unknown)?.set(self, value)
    }

    fn check(&self, about: Option<usize>) -> Result<(), ParameterError<N>> {
        let name = about.map(|index| C::TABLE.get(index).map_or("", |parameter| parameter.info.name));
        Ok(rules::check(C::RULES, self, name)?)
    }
}

/// Declares the parameters of a vehicle: a table with one line each.
///
/// # Structs made by the macro
/// A line is `name = default in [min, max] "unit";` below its meaning. Lines stand in groups; each
/// group becomes a struct, for the component that it configures, and all groups together a
/// [message](crate::types::message!), so that the parameters in use can be a topic. Names are
/// `group.name`. Rules follow behind `where`, as [`rules!`](crate::rules!) has them.
///
/// ```
/// use stampfly_param::parameters;
///
/// parameters! {
///     /// The parameters of a boat.
///     pub struct BoatParameters {
///         /// Motor.
///         motor: MotorParameters {
///             /// Duty at full throttle.
///             full = 0.9 in [0.1, 1.0] "1";
///             /// Duty at rest.
///             idle = 0.05 in [0.0, 0.5] "1";
///         }
///         /// Rudder.
///         rudder: RudderParameters {
///             /// Angle at the stop.
///             max_angle = 0.5 in [0.1, 1.0] "rad";
///         }
///     }
///     where p:
///     "motor.idle" "motor.full" p.motor.idle < p.motor.full => "the throttle would do nothing";
/// }
///
/// let mut boat = BoatParameters::default();
/// assert_eq!(boat.motor.full, 0.9);
/// parameters::set(&mut boat, "motor.full", 0.4)?;
/// let refused = parameters::set(&mut boat, "motor.idle", 0.5).unwrap_err();
/// assert_eq!(refused.to_string(), "motor.idle with motor.full: the throttle would do nothing");
/// assert_eq!(boat.motor, MotorParameters { full: 0.4, idle: 0.05 });
/// # Ok::<(), stampfly_param::ParameterError>(())
/// ```
///
/// # A struct of your own
/// A line is `"name" = field in [min, max] "unit";` below its meaning. Without a name the parameter
/// is called like the path to its field. A field is a [`ParameterField`](crate::ParameterField): a
/// number, yes or no, a duration or an enumeration. A line that ends in `, in_flight` marks a
/// parameter that may change [in flight](crate::ParameterInfo::in_flight). Rules follow behind
/// `where`, written there or as a constant. A struct of `f64` says `impl Config: f64`.
///
/// ```
/// use stampfly_param::types::Duration;
/// use stampfly_param::{Parameters, parameters};
///
/// #[derive(Default)]
/// struct Drive { gain: f32, ramp: Duration }
/// #[derive(Default)]
/// struct Boat { drive: Drive, keel: f32 }
///
/// parameters! {
///     impl Boat {
///         /// Duty per metre.
///         drive.gain in [0.0, 2.0] "1/m", in_flight;
///         /// Time to full duty.
///         drive.ramp in [0.0, 10.0] "s";
///         /// Depth below the water.
///         "keel.depth" = keel in [0.0, 2.0] "m";
///     }
/// }
///
/// let mut boat = Boat::default();
/// parameters::set(&mut boat, "drive.ramp", 1.5)?;
/// assert_eq!(boat.drive.ramp, Duration::from_millis(1_500));
/// assert!(boat.describe(0).unwrap().in_flight);
/// assert_eq!(boat.describe(2).unwrap().name, "keel.depth");
/// # Ok::<(), stampfly_param::ParameterError>(())
/// ```
#[macro_export]
macro_rules! parameters {
    (
        $(#[$set_doc:meta])* $vis:vis struct $Set:ident {
            $($(#[$group_doc:meta])* $group:ident: $Group:ident {
                $(
                    $(#[doc = $doc:literal])*
                    $name:ident = $default:literal in [$min:literal, $max:literal] $unit:literal $(, $in_flight:ident)?;
                )+
            })+
        }
        $(where $($rules:tt)+)?
    ) => {
        $(
            $(#[$group_doc])*
            #[derive(Clone, Copy, Debug, PartialEq)]
            $vis struct $Group { $($(#[doc = $doc])* pub $name: f32),+ }

            impl Default for $Group {
                fn default() -> Self { Self { $($name: $default),+ } }
            }

            // The numbers of a group are one field of the message, because a message's own default
            // is zeros.
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

        $crate::parameters! {
            impl $Set {
                $($($(#[doc = $doc])* $group.$name in [$min, $max] $unit $(, $in_flight)?;)+)+
            }
            $(where $($rules)+)?
        }
    };
    (
        impl $Config:ty $(: $Number:ty)? {
            $(
                $(#[doc = $doc:literal])*
                $($name:literal =)? $field:ident $(.$inner:ident)*
                in [$min:literal, $max:literal] $unit:literal $(, $in_flight:ident)?;
            )+
        }
        $(where $($rules:tt)+)?
    ) => {
        impl $crate::ParameterTable<$crate::parameters!(@number $($Number)?)> for $Config {
            const TABLE: &'static [$crate::Parameter<Self, $crate::parameters!(@number $($Number)?)>] =
                &[$($crate::Parameter {
                    info: $crate::ParameterInfo {
                        name: $crate::parameters!(@name $($name)?, $field $(.$inner)*),
                        min: $min,
                        max: $max,
                        unit: $unit,
                        meaning: concat!($($doc),*).trim_ascii(),
                        in_flight: $crate::parameters!(@in_flight $($in_flight)?),
                    },
                    __get: |config| $crate::ParameterField::number(config.$field $(.$inner)*),
                    __set: |config, number| {
                        config.$field $(.$inner)* = $crate::ParameterField::from_number(number)?;
                        Some(())
                    },
                }),+];

            const RULES: &'static [$crate::rules::Rule<Self>] = $crate::parameters!(@rules $($($rules)+)?);
        }
    };
    (@number) => { f32 };
    (@number $Number:ty) => { $Number };
    (@name $name:literal, $($field:tt)+) => { $name };
    (@name , $field:ident $(.$inner:ident)*) => { concat!(stringify!($field) $(, ".", stringify!($inner))*) };
    (@in_flight) => { false };
    (@in_flight in_flight) => { true };
    (@rules) => { &[] };
    (@rules $config:ident: $($rules:tt)+) => { $crate::rules! { $config: $($rules)+ } };
    (@rules $rules:path;) => { $rules };
}
