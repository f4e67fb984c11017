//! Combinations of two values that contradict each other, although each is in its range.
//!
//! A rule names two parameters and has a reason in words. A vehicle has a table of rules
//! ([`rules!`](crate::rules!)), and [`check`] returns the first that is violated. Check it after
//! the ranges, on a copy or with the previous value at hand: the rules about a parameter when that
//! one changes, all rules after several were changed in any order. What concerns one parameter
//! alone belongs into its range.
//!
//! A rule depends on its two parameters and on no other. Therefore a valid configuration stays
//! valid when only the rules about the changed parameter are checked, and the defaults of both
//! parameters repair a violated rule.

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

/// Writes a table of [`Rule`]s: the two parameters, what must hold, and what is wrong when it does
/// not.
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
