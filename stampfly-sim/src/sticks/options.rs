//! Options of flying a stick file: as typed, and resolved for a vehicle.

use super::file::{Row, StickFile};
use super::throttle::{self, Throttle};
use crate::vehicle::SetupError;
use serde::{Deserialize, Serialize};
use stampfly_types::Duration;
use stampfly_types::messages::{FlightMode, PilotInput};
use std::path::Path;

/// Default initial height of a recording that begins in flight, m: a typical hover in a room.
pub const START_HEIGHT: f32 = 1.5;
/// Range of initial heights, m.
const HEIGHTS: [f32; 2] = [0.3, 20.0];
/// Largest magnitude of a hover throttle.
const HOVER: f32 = 0.9;
/// Throttle below which the stick counts as lowest, with a margin for trim and noise.
const LOWEST: f32 = -0.9;
/// Time of lowest throttle that identifies a recording that begins on the ground. Many recordings
/// begin with arming, shortly before the throttle is raised; in flight no recording begins with a
/// fall.
const LOW_FOR: Duration = Duration::from_millis(100);
/// Option value for a hover throttle measured in the file.
const MEDIAN: &str = "median";

/// Prefix of a file name: `drawn:7` selects [sticks drawn](StickFile::drawn) from seed 7.
pub const DRAWN: &str = "drawn:";

/// Options of flying a stick file, as typed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StickOptions {
    /// A file name; [`DRAWN`] and a seed; or the content of a file, recognised by a line break.
    pub file: String,
    /// Flight mode that replaces the file's.
    pub mode: Option<String>,
    /// Initial height above the ground of a file that begins armed, m.
    pub from_height: Option<f32>,
    /// Throttle at which the file's vehicle hovered in manual modes: a number, or `median`.
    pub hover_throttle: Option<String>,
    /// The file starts when the vehicle is ready to arm instead of at power-on.
    pub when_ready: bool,
}

/// Start of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// At power-on. The file begins disarmed.
    PowerOn,
    /// When the vehicle is ready to arm. The file begins disarmed.
    Ready,
    /// On the ground after arming. The file begins armed with lowest throttle.
    Armed,
    /// In the air at this height above the ground, m. The file begins armed with raised throttle.
    Height(f32),
}

/// A stick file resolved for one vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct Sticks {
    /// The file.
    pub file: StickFile,
    /// Flight mode that replaces the file's.
    pub mode: Option<FlightMode>,
    /// Start of the file.
    pub start: Start,
    /// Conversion of its throttle.
    pub throttle: Throttle,
}

impl StickOptions {
    /// The file's content.
    ///
    /// # Errors
    /// If it cannot be read or parsed.
    pub fn file(&self) -> Result<StickFile, SetupError> {
        if self.file.contains('\n') {
            return StickFile::parse(self.file.as_bytes()).map_err(|error| format!("--sticks: {error}"));
        }
        if let Some(seed) = self.file.strip_prefix(DRAWN) {
            let seed = seed.parse().map_err(|_| format!("--sticks {}: '{seed}' is no seed", self.file))?;
            return Ok(StickFile::drawn(seed));
        }
        StickFile::read(Path::new(&self.file)).map_err(|error| format!("--sticks {}: {error}", self.file))
    }

    /// The same options with the content of the file in place of its name.
    ///
    /// # Errors
    /// As [`file`](Self::file).
    pub fn settled(&self) -> Result<Self, SetupError> {
        let file = self.file()?;
        let hover = self.hover(&file)?.map(|hover| hover.to_string());
        Ok(Self { file: file.to_string(), hover_throttle: hover, ..self.clone() })
    }

    fn hover(&self, file: &StickFile) -> Result<Option<f32>, SetupError> {
        match self.hover_throttle.as_deref() {
            None if self.file.starts_with(DRAWN) => Ok(Some(0.0)),
            None => Ok(None),
            Some(MEDIAN) => Ok(throttle::median(file)),
            Some(text) => {
                let hover = text.parse().ok().filter(|hover: &f32| hover.abs() <= HOVER);
                let wrong = || format!("--hover-throttle '{text}' is neither '{MEDIAN}' nor from -{HOVER} to {HOVER}");
                hover.ok_or_else(wrong).map(Some)
            }
        }
    }
}

impl Sticks {
    /// Resolves the options for a vehicle with this throttle stick. `mode` is the flight mode in
    /// its options.
    ///
    /// # Errors
    /// If the file is invalid or a value is out of its range.
    pub fn new(options: &StickOptions, mode: Option<FlightMode>, throttle: Throttle) -> Result<Self, SetupError> {
        let file = options.file()?;
        let throttle = Throttle { of_file: options.hover(&file)?, ..throttle };
        let [low, high] = HEIGHTS;
        if let Some(height) = options.from_height.filter(|height| !(low..=high).contains(height)) {
            return Err(format!("--from-height {height} is not from {low} to {high}"));
        }
        let start = match options.from_height {
            _ if !file.first().input.arm => {
                if options.when_ready {
                    Start::Ready
                } else {
                    Start::PowerOn
                }
            }
            Some(height) => Start::Height(height),
            None if begins_low(&file) => Start::Armed,
            None => Start::Height(START_HEIGHT),
        };
        Ok(Self { file, mode, start, throttle })
    }

    /// The mode in which a row is flown.
    #[must_use]
    pub fn flown(&self, row: FlightMode) -> FlightMode {
        self.mode.unwrap_or(row)
    }

    /// The file's sticks as this vehicle's transmitter sends them.
    #[must_use]
    pub fn sent(&self, input: &PilotInput) -> PilotInput {
        let mode = self.flown(input.mode);
        PilotInput { mode, throttle: self.throttle.sent(input.throttle, input.mode, mode), ..*input }
    }

    /// Length of the file.
    #[must_use]
    pub fn length(&self) -> Duration {
        self.file.last().at
    }
}

/// True if the throttle is lowest for [`LOW_FOR`] from the first row on.
fn begins_low(file: &StickFile) -> bool {
    let begins = file.first().at;
    let first = |row: &&Row| row.at.as_micros() < begins.as_micros() + LOW_FOR.as_micros();
    file.rows().iter().take_while(first).all(|row| row.input.throttle < LOWEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    const THROTTLE: Throttle = Throttle { rest: 0.0, hover: 0.6, of_file: None };

    fn options(rows: &str) -> StickOptions {
        StickOptions { file: format!("t,throttle,roll,pitch,yaw,mode,arm\n{rows}\n"), ..StickOptions::default() }
    }

    #[test]
    fn a_file_says_itself_where_it_begins() {
        let start = |options: &StickOptions| Sticks::new(options, None, THROTTLE).expect("sticks").start;
        let [ground, low, high] = [
            "0,-1,0,0,0,acro,0\n9,-1,0,0,0,acro,1",
            "0,-1,0,0,0,acro,1\n0.1,0.5,0,0,0,acro,1",
            "0,-1,0,0,0,acro,1\n0.08,-0.4,0,0,0,acro,1",
        ]
        .map(options);
        assert_eq!([&ground, &low, &high].map(start), [Start::PowerOn, Start::Armed, Start::Height(START_HEIGHT)]);
        let at = |options: &StickOptions| {
            start(&StickOptions { from_height: Some(4.0), when_ready: true, ..options.clone() })
        };
        assert_eq!([&ground, &low, &high].map(at), [Start::Ready, Start::Height(4.0), Start::Height(4.0)]);
    }

    #[test]
    fn what_is_out_of_range_is_named() {
        let refused = |options: StickOptions| Sticks::new(&options, None, THROTTLE).expect_err("a mistake");
        let file = || options("0,0,0,0,0,acro,1");
        assert_eq!(
            refused(StickOptions { from_height: Some(f32::NAN), ..file() }),
            "--from-height NaN is not from 0.3 to 20"
        );
        for hover in ["0.95", "NaN", "half"] {
            let error = refused(StickOptions { hover_throttle: Some(hover.into()), ..file() });
            assert_eq!(error, format!("--hover-throttle '{hover}' is neither 'median' nor from -0.9 to 0.9"));
        }
        assert_eq!(refused(options("0,0,0,0,0,acro,3")), "--sticks: line 2: arm: '3' is neither 0 nor 1");
        assert!(refused(StickOptions { file: "none.csv".into(), ..file() }).starts_with("--sticks none.csv: "));
    }

    #[test]
    fn settled_options_need_no_file_and_mean_the_same() {
        let typed = StickOptions {
            mode: Some("acro".into()),
            hover_throttle: Some("median".into()),
            ..options("0,-0.5,0,0,0,acro,1\n3,-0.25,0,0,0,acro,1\n4,0.5,0,0,0,acro,1")
        };
        let settled = typed.settled().expect("settled");
        assert_eq!(settled.hover_throttle.as_deref(), Some("-0.5"));
        let means = |options: &StickOptions| Sticks::new(options, Some(FlightMode::Acro), THROTTLE);
        assert_eq!(means(&settled), means(&typed));
        assert_eq!(settled.settled(), Ok(settled));
    }
}
