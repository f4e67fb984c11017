//! Parameters of a [`Vehicle`](super::Vehicle) by name, for options, logs and lists: a vehicle whose
//! configuration is a [`ParameterTable`] hands its functions about parameters here.

use super::{Setting, SetupError};
use crate::SimulationConfig;
use crate::plant::Airframe;
use stampfly_log::ulog::ParameterValue;
use stampfly_param::{Number, ParameterTable, Parameters};

/// Every parameter of a configuration.
#[must_use]
pub fn settings<N: Number, P: ParameterTable<N>>(config: &P) -> Vec<Setting> {
    let setting = |parameter: &stampfly_param::Parameter<P, N>| {
        let stampfly_param::ParameterInfo { name, unit, meaning, .. } = parameter.info;
        Setting { name, value: parameter.get(config).into(), unit, meaning }
    };
    P::TABLE.iter().map(setting).collect()
}

/// Changes a parameter without looking at the others: a log contains what was flown, also where
/// today's rules refuse it.
///
/// # Errors
/// When there is no such parameter, or the value is no number or out of range.
pub fn set<P: ParameterTable>(config: &mut P, name: &str, value: ParameterValue) -> Result<(), SetupError> {
    let ParameterValue::Float(value) = value else { return Err(format!("{name}: not a float")) };
    P::find(name).and_then(|parameter| parameter.set(config, value)).map_err(|error| format!("{name}: {error}"))
}

/// Changes the [parameters of options](super::Options::parameters), in any order, and checks the
/// rules between them afterwards.
///
/// # Errors
/// As [`set`], and when a rule is violated.
pub fn change<P: ParameterTable>(config: &mut P, options: &super::Options) -> Result<(), SetupError> {
    for (name, value) in options.parameters()? {
        set(config, name, ParameterValue::Float(value)).map_err(|error| format!("--param {error}"))?;
    }
    config.check(None).map_err(|error| format!("--param {error}"))
}

/// Lowest and highest value of a parameter; `None` when there is no such.
#[must_use]
pub fn range<P: ParameterTable>(name: &str) -> Option<[f64; 2]> {
    P::find(name).ok().map(|parameter| [parameter.info.min.into(), parameter.info.max.into()])
}

/// Every number of a simulated airframe and of the conditions under which it flies.
#[must_use]
pub fn simulation<A: Airframe>(simulation: &SimulationConfig<A>) -> Vec<Setting> {
    settings(&simulation.plant).into_iter().chain(settings(&simulation.conditions)).collect()
}
