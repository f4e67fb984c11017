//! Options of `lab estimate`.

use clap::{Args, ValueEnum};
use stampfly_board::simulation::StampFly;
use stampfly_board::{EstimatorKind, VehicleConfig};
use stampfly_host::command_line::Failure;
use stampfly_lab::dataset::Kind;
use stampfly_lab::estimate::{Method, Suite, suite};
use stampfly_sim::vehicle::Vehicle;
use std::path::PathBuf;

/// The estimators of the family.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EstimatorChoice {
    /// Error-state Kalman filter.
    Eskf,
    /// Complementary filter.
    Complementary,
    /// Attitude filter: neither position nor velocity.
    Attitude,
}

/// Options of `estimate`.
#[derive(Clone, Debug, Args)]
pub struct EstimateOptions {
    /// StampFly logs and captures (CSV), NanoBench and BROAD (NPZ), PX4 replays (CSV).
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Which estimator. Without this: the attitude filter where nothing measures a position (BROAD), elsewhere the
    /// error-state Kalman filter.
    #[arg(long, value_enum)]
    pub estimator: Option<EstimatorChoice>,
    /// Change a parameter of the flight stack (`stampfly fly --list` shows them).
    #[arg(long, value_name = "NAME=VALUE")]
    pub param: Vec<String>,
    /// Folder for a report per recording, `estimate_NAME.html`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

impl EstimateOptions {
    /// The tuning for one kind of recording, with what the options change.
    pub fn suite(&self, kind: Kind) -> Result<Suite, Failure> {
        let mut suite = suite(kind);
        let mut flown = |kind| (suite.method, suite.vehicle.estimator) = (Method::Vehicle, kind);
        match self.estimator {
            Some(EstimatorChoice::Eskf) => flown(EstimatorKind::Eskf),
            Some(EstimatorChoice::Complementary) => flown(EstimatorKind::Complementary),
            Some(EstimatorChoice::Attitude) => suite.method = Method::Attitude,
            None => {}
        }
        set_parameters(&mut suite.vehicle, &self.param)?;
        Ok(suite)
    }
}

/// Applies `--param`.
fn set_parameters(config: &mut VehicleConfig, texts: &[String]) -> Result<(), Failure> {
    for text in texts {
        let (name, value) = text.split_once('=').ok_or_else(|| format!("'{text}' is not NAME=VALUE"))?;
        let value: f32 = value.trim().parse().map_err(|_| format!("'{text}': '{value}' is not a number"))?;
        StampFly::set_parameter(config, name.trim(), value.into())
            .map_err(|error| format!("--param {text}: {error}"))?;
    }
    Ok(())
}
