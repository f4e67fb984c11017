//! A vehicle's parameters by name, for vehicles whose configuration is a table of `stampfly-param`.
//!
//! A [`Vehicle`](super::Vehicle) hands its functions about parameters here. Not for a configuration that is more than a table, as the StampFly's.

use super::{Setting, SetupError};
use crate::SimulationConfig;
use crate::plant::{Airframe, ParameterInfo};
use stampfly_log::ulog::ParameterValue;
use stampfly_param::{ParameterTable, parameters};

/// Every parameter of a configuration.
#[must_use]
pub fn settings<P: ParameterTable>(config: &P) -> Vec<Setting> {
    let rows = P::TABLE.iter().map(|row| (row, row.get(config).into()));
    rows.map(|(row, value)| Setting { name: row.info.name, value, unit: row.info.unit, meaning: row.info.meaning })
        .collect()
}

/// Changes a parameter.
///
/// # Errors
/// When there is no such parameter, or the value is no number or out of range.
pub fn set<P: ParameterTable>(config: &mut P, name: &str, value: ParameterValue) -> Result<(), SetupError> {
    let ParameterValue::Float(value) = value else { return Err(format!("{name}: not a float")) };
    P::find(name).and_then(|row| row.set(config, value)).map_err(|error| format!("{name}: {error}"))
}

/// Changes parameters as options ask for, [`Options::parameters`](super::Options::parameters), and looks whether all of them together may be flown.
///
/// # Errors
/// As [`set`], and when they may not.
pub fn change<P: ParameterTable>(config: &mut P, options: &super::Options) -> Result<(), SetupError> {
    for (name, value) in options.parameters()? {
        set(config, name, ParameterValue::Float(value)).map_err(|error| format!("--param {error}"))?;
    }
    parameters::validate(config).map_err(|error| error.to_string())
}

/// Lowest and highest value of a parameter; `None` when there is no such.
#[must_use]
pub fn range<P: ParameterTable>(name: &str) -> Option<[f64; 2]> {
    P::find(name).ok().map(|row| [row.info.min.into(), row.info.max.into()])
}

/// Every number of a simulated airframe.
#[must_use]
pub fn airframe(airframe: &impl Airframe) -> Vec<Setting> {
    airframe.list().into_iter().map(setting).collect()
}

/// Every number of a simulated airframe and of the conditions under which it flies.
#[must_use]
pub fn simulation<A: Airframe>(simulation: &SimulationConfig<A>) -> Vec<Setting> {
    simulation.list().into_iter().map(setting).collect()
}

fn setting(row: ParameterInfo) -> Setting {
    Setting { name: row.name, value: row.value, unit: row.unit, meaning: row.description }
}
