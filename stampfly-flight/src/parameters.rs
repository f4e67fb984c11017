//! Parameters by name, as a console or a radio link sees them.
//!
//! A vehicle implements [`Parameters`] on whatever holds its values: a table of fields, `stampfly-param`, a single gain.
//! [`find`] and [`set`] do the rest. Not for runnables: what they hold of a configuration changes as [`live`](crate::live) says.

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
    /// May it change while the vehicle is armed? Whoever holds it then takes it [between two passes](crate::live) and keeps its state. The others wait until
    /// the vehicle is disarmed.
    pub in_flight: bool,
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
    /// The value is in its range, but the vehicle cannot fly with these two values together.
    Conflict {
        /// The two.
        parameters: [&'static str; 2],
        /// Why.
        reason: &'static str,
    },
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => f.write_str("there is no such parameter"),
            Self::OutOfRange { min, max } => write!(f, "the value must be from {min} to {max}"),
            Self::Conflict { parameters: [first, second], reason } => write!(f, "{first} with {second}: {reason}"),
        }
    }
}

impl core::error::Error for ParameterError {}

/// What people are told of a parameter that they change on an armed vehicle and that may not change [in flight](ParameterInfo::in_flight).
pub const WAITS: &str = "not in flight: waits until the vehicle is disarmed";

/// A vehicle's parameters, numbered from zero.
pub trait Parameters {
    /// The parameter with this number; `None` behind the last.
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_>>;

    /// Its value; `None` behind the last.
    fn get(&self, index: usize) -> Option<f32>;

    /// Changes its value, whatever the others are. For many values in some order, with one [`check`](Self::check) at the end; for
    /// one, use [`set`](fn@set).
    ///
    /// # Errors
    /// When there is no such parameter or it does not take the value; it is unchanged then.
    fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError>;

    /// Can the vehicle fly with these values together? With a parameter, only what has to do with it is looked at. A vehicle
    /// without such rules always can.
    ///
    /// # Errors
    /// [`ParameterError::Conflict`].
    fn check(&self, _about: Option<usize>) -> Result<(), ParameterError> {
        Ok(())
    }
}

/// A line of a vehicle's table of parameters, for a configuration `C` in whose fields the values are.
#[derive(Clone, Copy, Debug)]
pub struct Line<C> {
    /// Name, range, unit, meaning.
    pub info: ParameterInfo<'static>,
    /// The value of the field.
    pub get: fn(&C) -> f32,
    /// Refuses a number that is no value of the field.
    pub set: fn(&mut C, f32) -> Option<()>,
}

/// Changes the parameter at this place of a table, if the value is in its range.
///
/// # Errors
/// When there is no such parameter, or its field does not take the value.
pub fn set_line<C>(table: &[Line<C>], config: &mut C, index: usize, value: f32) -> Result<(), ParameterError> {
    let Line { info: ParameterInfo { min, max, .. }, set, .. } = table.get(index).ok_or(ParameterError::Unknown)?;
    let in_range = (*min..=*max).contains(&value).then(|| set(config, value)).flatten();
    in_range.ok_or(ParameterError::OutOfRange { min: *min, max: *max })
}

/// Declares the parameters of a vehicle whose configuration is a struct, one line each: name, range, unit, field, meaning. The
/// default is the field's own. Makes a constant `TABLE` and a function `all`, and implements [`Parameters`]; `check` is that of the trait.
///
/// ```
/// use stampfly_flight::parameters::{self, Parameters};
///
/// #[derive(Default)]
/// struct Drive { gain: f32, reversed: bool }
/// #[derive(Default)]
/// struct Boat { drive: Drive }
///
/// stampfly_flight::parameter_table! { Boat, check = |_, _| Ok(());
///     "drive.gain" [0.0, 2.0] "1/m" drive.gain => "duty per metre";
///     "drive.reversed" [0.0, 1.0] "1" drive.reversed => "1: turns the other way";
/// }
///
/// let mut boat = Boat::default();
/// parameters::set(&mut boat, "drive.reversed", 1.0)?;
/// assert!(boat.drive.reversed && parameters::set(&mut boat, "drive.reversed", 0.5).is_err());
/// assert_eq!((TABLE.len(), all().len()), (2, 2));
/// # Ok::<(), parameters::ParameterError>(())
/// ```
/// A line that ends in `, in_flight` may change [in flight](ParameterInfo::in_flight):
///
/// ```
/// #[derive(Default)]
/// struct Boat { gain: f32, keel: f32 }
///
/// stampfly_flight::parameter_table! { Boat, check = |_, _| Ok(());
///     "drive.gain" [0.0, 2.0] "1/m" gain => "duty per metre", in_flight;
///     "keel.depth" [0.0, 2.0] "m" keel => "below the water";
/// }
/// assert_eq!(TABLE.iter().map(|line| line.info.in_flight).collect::<Vec<_>>(), [true, false]);
/// ```
/// With `corrections = field;` behind the check, a line each is added for what calibrations find, in a field of the type
/// `stampfly_eskf::calibration::Corrections`: `calibration.accel.bias_x` and so on.
#[macro_export]
macro_rules! parameter_table {
    (@ in_flight) => { true };
    (@) => { false };
    (
        $Config:ty, check = $check:expr, corrections = $($at:ident).+; $($rows:tt)+
    ) => {
        $crate::parameter_table! { $Config, check = $check;
            $($rows)+
            "calibration.accel.bias_x" [-3.0, 3.0] "m/s^2" $($at).+.accel.bias.x => "accelerometer, forward: shown without force";
            "calibration.accel.bias_y" [-3.0, 3.0] "m/s^2" $($at).+.accel.bias.y => "accelerometer, right: shown without force";
            "calibration.accel.bias_z" [-3.0, 3.0] "m/s^2" $($at).+.accel.bias.z => "accelerometer, down: shown without force";
            "calibration.accel.scale_x" [0.8, 1.2] "1" $($at).+.accel.scale.x => "accelerometer, forward: factor of the rest";
            "calibration.accel.scale_y" [0.8, 1.2] "1" $($at).+.accel.scale.y => "accelerometer, right: factor of the rest";
            "calibration.accel.scale_z" [0.8, 1.2] "1" $($at).+.accel.scale.z => "accelerometer, down: factor of the rest";
            "calibration.level.roll" [-0.1, 0.1] "rad" $($at).+.level.roll => "the inertial sensor is rolled so in the airframe";
            "calibration.level.pitch" [-0.1, 0.1] "rad" $($at).+.level.pitch => "the inertial sensor is pitched so in the airframe";
            "calibration.mag.offset_x" [-2000.0, 2000.0] "uT" $($at).+.mag.offset.x => "hard iron, forward";
            "calibration.mag.offset_y" [-2000.0, 2000.0] "uT" $($at).+.mag.offset.y => "hard iron, right";
            "calibration.mag.offset_z" [-2000.0, 2000.0] "uT" $($at).+.mag.offset.z => "hard iron, down";
            "calibration.mag.matrix_xx" [0.5, 2.0] "1" $($at).+.mag.diagonal.x => "soft iron undone, forward to forward";
            "calibration.mag.matrix_yy" [0.5, 2.0] "1" $($at).+.mag.diagonal.y => "soft iron undone, right to right";
            "calibration.mag.matrix_zz" [0.5, 2.0] "1" $($at).+.mag.diagonal.z => "soft iron undone, down to down";
            "calibration.mag.matrix_xy" [-0.5, 0.5] "1" $($at).+.mag.across.x => "soft iron undone, forward to right";
            "calibration.mag.matrix_xz" [-0.5, 0.5] "1" $($at).+.mag.across.y => "soft iron undone, forward to down";
            "calibration.mag.matrix_yz" [-0.5, 0.5] "1" $($at).+.mag.across.z => "soft iron undone, right to down";
            "calibration.drift.reference" [-40.0, 85.0] "degC" $($at).+.drift.reference => "no drift is corrected at this temperature";
            "calibration.drift.gyro_x" [-2e-3, 2e-3] "rad/s/K" $($at).+.drift.gyro.x => "gyro bias a kelvin, forward";
            "calibration.drift.gyro_y" [-2e-3, 2e-3] "rad/s/K" $($at).+.drift.gyro.y => "gyro bias a kelvin, right";
            "calibration.drift.gyro_z" [-2e-3, 2e-3] "rad/s/K" $($at).+.drift.gyro.z => "gyro bias a kelvin, down";
            "calibration.drift.accel_x" [-0.02, 0.02] "m/s^2/K" $($at).+.drift.accel.x => "accelerometer bias a kelvin, forward";
            "calibration.drift.accel_y" [-0.02, 0.02] "m/s^2/K" $($at).+.drift.accel.y => "accelerometer bias a kelvin, right";
            "calibration.drift.accel_z" [-0.02, 0.02] "m/s^2/K" $($at).+.drift.accel.z => "accelerometer bias a kelvin, down";
        }
    };
    (
        $Config:ty, check = $check:expr;
        $($name:literal [$min:literal, $max:literal] $unit:literal $($field:ident).+ => $meaning:literal $(, $armed:ident)?;)+
    ) => {
        /// Every parameter, in the order of their numbers.
        pub const TABLE: &[$crate::parameters::Line<$Config>] = &[$($crate::parameters::Line {
            info: $crate::parameters::ParameterInfo {
                name: $name, min: $min, max: $max, unit: $unit, meaning: $meaning,
                in_flight: $crate::parameter_table!(@ $($armed)?),
            },
            get: |config| $crate::parameters::Value::number(config.$($field).+),
            set: |config, number| {
                config.$($field).+ = $crate::parameters::Value::from_number(number)?;
                Some(())
            },
        }),+];

        /// What is known of every parameter, in the order of their numbers.
        pub fn all() -> impl ExactSizeIterator<Item = $crate::parameters::ParameterInfo<'static>> {
            TABLE.iter().map(|line| line.info)
        }

        impl $crate::parameters::Parameters for $Config {
            fn describe(&self, index: usize) -> Option<$crate::parameters::ParameterInfo<'_>> {
                TABLE.get(index).map(|line| line.info)
            }

            fn get(&self, index: usize) -> Option<f32> {
                TABLE.get(index).map(|line| (line.get)(self))
            }

            fn set(&mut self, index: usize, value: f32) -> Result<(), $crate::parameters::ParameterError> {
                $crate::parameters::set_line(TABLE, self, index, value)
            }

            fn check(&self, about: Option<usize>) -> Result<(), $crate::parameters::ParameterError> {
                let check: fn(&Self, Option<usize>) -> Result<(), $crate::parameters::ParameterError> = $check;
                check(self, about)
            }
        }
    };
}

/// Lets enumerations that `stampfly_types::message_enum!` declares be parameters, by their numbers.
#[macro_export]
macro_rules! parameter_kinds {
    ($($Kind:ident)+) => { $(
        impl $crate::parameters::Value for $Kind {
            fn number(self) -> f32 {
                self as u8 as f32
            }
            fn from_number(number: f32) -> Option<Self> {
                Self::ALL.iter().copied().find(|kind| *kind as u8 as f32 == number)
            }
        }
    )+ };
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

/// Up to 65535: each has a number of its own.
impl Value for u16 {
    fn number(self) -> f32 {
        f32::from(self)
    }
    fn from_number(number: f32) -> Option<Self> {
        let whole = number as u16;
        (f32::from(whole) == number).then_some(whole)
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
/// assert!(parameters::set(&mut gain, "drive.gain", f32::NAN).is_err());
/// assert_eq!(gain.get(0), Some(1.5));
/// ```
///
/// # Errors
/// When there is no such parameter, the value is out of its range, or the vehicle cannot fly with it and the value of another;
/// nothing has changed then.
pub fn set(parameters: &mut dyn Parameters, name: &str, value: f32) -> Result<usize, ParameterError> {
    let index = find(parameters, name)?;
    set_at(parameters, index, value).map(|()| index)
}

/// Changes the parameter with this number, as [`set`](fn@set) does the one of a name.
///
/// # Errors
/// As there.
pub fn set_at(parameters: &mut dyn Parameters, index: usize, value: f32) -> Result<(), ParameterError> {
    let before = parameters.get(index).ok_or(ParameterError::Unknown)?;
    set_alone(parameters, index, value)?;
    if let Err(conflict) = parameters.check(Some(index)) {
        parameters.set(index, before)?;
        return Err(conflict);
    }
    Ok(())
}

/// Changes the parameter with this number, if the value is in its range, whatever the others are. A [`check`](Parameters::check)
/// belongs behind the last of several.
///
/// # Errors
/// When there is no such parameter or the value is out of its range; nothing has changed then.
pub fn set_alone(parameters: &mut dyn Parameters, index: usize, value: f32) -> Result<(), ParameterError> {
    let ParameterInfo { min, max, .. } = parameters.describe(index).ok_or(ParameterError::Unknown)?;
    if !(min..=max).contains(&value) {
        return Err(ParameterError::OutOfRange { min, max });
    }
    parameters.set(index, value)
}

/// Gives both parameters of every combination that cannot fly their defaults, for values that come from a storage: an earlier
/// version may have allowed them, and a vehicle should start. Tells `replaced` each conflict. Returns how many there were.
///
/// It ends: every turn gives at least one more parameter its default, and no two defaults are in conflict.
///
/// ```
/// use stampfly_flight::parameters::{ParameterError, ParameterInfo, Parameters, settle};
///
/// /// Speeds: slow, fast.
/// struct Speeds([f32; 2]);
/// const NAMES: [&str; 2] = ["slow", "fast"];
///
/// impl Parameters for Speeds {
///     fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
///         let name = NAMES.get(index)?;
///         Some(ParameterInfo { name, unit: "m/s", min: 0.0, max: 9.0, meaning: "", in_flight: false })
///     }
///     fn get(&self, index: usize) -> Option<f32> { self.0.get(index).copied() }
///     fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError> {
///         *self.0.get_mut(index).ok_or(ParameterError::Unknown)? = value;
///         Ok(())
///     }
///     fn check(&self, _: Option<usize>) -> Result<(), ParameterError> {
///         let conflict = ParameterError::Conflict { parameters: NAMES, reason: "slow is faster" };
///         if self.0[0] <= self.0[1] { Ok(()) } else { Err(conflict) }
///     }
/// }
///
/// let (mut stored, mut told) = (Speeds([5.0, 3.0]), String::new());
/// assert_eq!(settle(&mut stored, &Speeds([1.0, 2.0]), &mut |conflict| told = conflict.to_string()), 1);
/// assert_eq!((stored.0, told.as_str()), ([1.0, 2.0], "slow with fast: slow is faster"));
/// ```
pub fn settle(
    parameters: &mut dyn Parameters,
    defaults: &dyn Parameters,
    replaced: &mut dyn FnMut(ParameterError),
) -> usize {
    let mut conflicts = 0;
    while parameters.describe(conflicts).is_some() {
        let Err(conflict) = parameters.check(None) else { break };
        conflicts += 1;
        replaced(conflict);
        let ParameterError::Conflict { parameters: pair, .. } = conflict else { break };
        for index in pair.iter().filter_map(|name| find(defaults, name).ok()) {
            let _ = defaults.get(index).map(|value| parameters.set(index, value));
        }
    }
    conflicts
}
