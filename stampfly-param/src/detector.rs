//! Finding out which parameters of a configuration have changed.

use crate::{ParameterInfo, Parameters};

/// Compares a configuration with what it was at the last comparison, whoever has changed it in
/// between.
///
/// Use it where a configuration has several users: a console, a radio and a page change it as they
/// like, and one place finds what is new, logs it and passes it on.
///
/// ```
/// use stampfly_param::{ChangeDetector, parameters};
///
/// parameters! {
///     /// A lamp.
///     pub struct Lamp {
///         /// Light.
///         light: Light {
///             /// Brightness.
///             level = 0.5 in [0.0, 1.0] "1";
///             /// Time to full brightness.
///             ramp = 0.1 in [0.0, 1.0] "s";
///         }
///     }
/// }
///
/// let mut lamp = Lamp::default();
/// let mut detector = ChangeDetector::new(lamp);
/// parameters::set(&mut lamp, "light.ramp", 0.2)?;
/// let mut found = Vec::new();
/// assert!(detector.detect(&lamp, &mut |index, info, value| found.push(format!("{index} {} = {value}", info.name))));
/// assert_eq!(found, ["1 light.ramp = 0.2"]);
/// assert!(!detector.detect(&lamp, &mut |_, _, _| {}), "once");
/// # Ok::<(), stampfly_param::ParameterError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ChangeDetector<C> {
    last: C,
}

impl<C: Parameters + Clone + PartialEq> ChangeDetector<C> {
    /// Starts from this configuration.
    pub const fn new(config: C) -> Self {
        Self { last: config }
    }

    /// The configuration at the last comparison.
    pub const fn last(&self) -> &C {
        &self.last
    }

    /// Passes the number, the description and the new value of each parameter that has changed to
    /// `changed`. Returns whether anything in the configuration has changed, parameter or not.
    pub fn detect(&mut self, config: &C, changed: &mut dyn FnMut(usize, ParameterInfo<'_>, f32)) -> bool {
        if self.last == *config {
            return false;
        }
        for index in 0.. {
            let Some((info, value)) = config.describe(index).zip(config.get(index)) else { break };
            if self.last.get(index) != Some(value) {
                changed(index, info, value);
            }
        }
        self.last.clone_from(config);
        true
    }
}
