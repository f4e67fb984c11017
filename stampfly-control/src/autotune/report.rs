//! What tuning an axis has found.

use stampfly_types::Duration;

use super::axis::AutotuneAxis;
use super::excitation::TONES;
use super::margins::Margins;
use super::model::PlantModel;
use super::spectrum::PlantPoint;
use crate::pid::PidGains;

/// The plant that was found, and the gains that follow from it beside the present ones.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AutotuneReport {
    /// The axis.
    pub axis: AutotuneAxis,
    /// The gains it flies with, N·m per rad/s. They stay until the others are accepted.
    pub present: PidGains,
    /// The gains that were found.
    pub proposed: PidGains,
    /// Margins of the present gains; none if their loop's gain is never one.
    pub before: Option<Margins>,
    /// Margins of the proposed gains: the lesser of those with the points and with the model.
    pub after: Margins,
    /// The plant, fitted.
    pub model: PlantModel,
    /// The plant, measured, in ascending frequency.
    pub points: [PlantPoint; TONES],
    /// Windows that were measured.
    pub windows: u16,
    /// Mean control period.
    pub period: Duration,
}

/// Why gains are not handed out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AcceptError {
    /// The vehicle is armed: gains change on the ground.
    Armed,
    /// There is no result, or it has been accepted.
    Nothing,
}

impl core::fmt::Display for AcceptError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Armed => "the vehicle is armed",
            Self::Nothing => "there is nothing to accept",
        })
    }
}

impl core::error::Error for AcceptError {}
