//! Combinations of values with which a vehicle cannot do its work, each value being in its range.
//!
//! A rule is about two parameters and has a reason in words. A vehicle has a table of them ([`rules!`](crate::rules!)), and
//! [`check`] names the first that is broken. Use it after the check of ranges, on a copy or with the old value at hand: when one
//! value is set, for the rules about it, and once at the end after many were set in some order. What is wrong about one
//! parameter alone belongs into its range.
//!
//! A rule looks at its two parameters and at no other. So a set of values in which no rule is broken stays one when a change is
//! checked by the rules about the value that changed, and defaults for both parameters of a broken rule mend it.

use core::fmt;

/// Two parameters that cannot have the values which they have, and why.
///
/// ```
/// use stampfly_param::Conflict;
/// let conflict = Conflict { parameters: ["motor.idle", "motor.full"], reason: "it never stands" };
/// assert_eq!(conflict.to_string(), "motor.idle with motor.full: it never stands");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conflict {
    /// Their names.
    pub parameters: [&'static str; 2],
    /// What the vehicle would do or could not do.
    pub reason: &'static str,
}

impl fmt::Display for Conflict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [first, second] = self.parameters;
        write!(f, "{first} with {second}: {}", self.reason)
    }
}

impl core::error::Error for Conflict {}

/// A line of a vehicle's table of rules: what must hold in a configuration `C`.
#[derive(Clone, Copy, Debug)]
pub struct Rule<C> {
    /// What is said when it does not hold.
    pub conflict: Conflict,
    /// Does it hold? A function of the two parameters alone.
    pub holds: fn(&C) -> bool,
}

impl<C> Rule<C> {
    /// Is it about this parameter?
    #[must_use]
    pub fn is_about(&self, name: &str) -> bool {
        self.conflict.parameters.contains(&name)
    }
}

/// Checks a configuration by the rules about this parameter, or by all of them.
///
/// # Errors
/// The first rule of the table that does not hold.
pub fn check<C>(rules: &[Rule<C>], config: &C, about: Option<&str>) -> Result<(), Conflict> {
    let mut concerned = rules.iter().filter(|rule| about.is_none_or(|name| rule.is_about(name)));
    concerned.find(|rule| !(rule.holds)(config)).map_or(Ok(()), |rule| Err(rule.conflict))
}

/// Writes a table of [`Rule`]s: the two parameters, what must hold, and what is wrong when it does not.
///
/// ```
/// use stampfly_param::rules::{self, Rule};
///
/// struct Boat { idle: f32, full: f32 }
///
/// const RULES: &[Rule<Boat>] = stampfly_param::rules! { boat:
///     "motor.idle" "motor.full" boat.idle < boat.full => "the throttle would do nothing";
/// };
///
/// assert!(rules::check(RULES, &Boat { idle: 0.1, full: 0.9 }, None).is_ok());
/// let refused = rules::check(RULES, &Boat { idle: 0.5, full: 0.4 }, Some("motor.idle")).unwrap_err();
/// assert_eq!(refused.to_string(), "motor.idle with motor.full: the throttle would do nothing");
/// assert!(rules::check(RULES, &Boat { idle: 0.5, full: 0.4 }, Some("rudder.max_angle")).is_ok());
/// ```
#[macro_export]
macro_rules! rules {
    ($config:ident: $($first:literal $second:literal $holds:expr => $reason:literal;)*) => {
        &[$($crate::rules::Rule {
            conflict: $crate::Conflict { parameters: [$first, $second], reason: $reason },
            holds: |$config| $holds,
        }),*]
    };
}
