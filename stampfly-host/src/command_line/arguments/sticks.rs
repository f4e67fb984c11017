//! Sticks from a file: what `fly` and `campaign` say of it.

use clap::Args;
use stampfly_sim::sticks::StickOptions;
use std::path::Path;

/// How stick files are flown.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Sticks from a file")]
pub struct StickArguments {
    /// Where a file that begins armed is to begin, in metres above the ground. Without this: on the
    /// ground when its throttle is at the lowest for a second, else at 1.5 m. The simulated pilot
    /// brings the vehicle there.
    #[arg(long, value_name = "M", requires = "sticks")]
    pub from_height: Option<f32>,
    /// The throttle with which the file's own vehicle hovered in the modes whose throttle is a
    /// thrust, from -0.9 to 0.9, or `median`: that of its rows in the air. The throttle is
    /// stretched so that this vehicle hovers there. Without this it is sent as it is.
    #[arg(long, value_name = "T", requires = "sticks", allow_hyphen_values = true)]
    pub hover_throttle: Option<String>,
    /// The time of a file that begins disarmed begins when the vehicle may be armed, and not at
    /// power-on.
    #[arg(long, requires = "sticks")]
    pub when_ready: bool,
}

impl StickArguments {
    /// These for a file, in this mode in place of its own.
    pub fn options(&self, file: &Path, mode: Option<String>) -> StickOptions {
        let Self { from_height, hover_throttle, when_ready } = self.clone();
        StickOptions { file: file.display().to_string(), mode, from_height, hover_throttle, when_ready }
    }
}
