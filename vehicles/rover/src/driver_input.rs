//! The driver's input: one of three sources, limited while the vehicle is degraded.
//!
//! | mode | source | without it |
//! |---|---|---|
//! | Manual | the operator's command | older than the timeout: brakes |
//! | Demo | [`demo`], from the moment the mode is entered | – |
//! | Replay | the lines of a log | brakes at the end |
//!
//! While degraded the steering is limited and the speed held at or below a limit by closing the throttle and, above
//! it, by the brake. An emergency stop is not applied here but by every component below, so the log keeps what the
//! driver asked for.
//!
//! ```
//! use stampfly_rover::driver_input::{DriverSelector, DriverSources};
//! use stampfly_rover::{messages::{DriverInput, OperatorCommand}, Parameters};
//! use stampfly_types::{Duration, Instant};
//! let (mut selector, parameters) = (DriverSelector::default(), Parameters::default().input);
//! let operator = OperatorCommand { throttle: 0.5, ..OperatorCommand::default() };
//! let mut sources = DriverSources { operator, operator_age: Some(Duration::ZERO), ..DriverSources::default() };
//! assert_eq!(selector.step(Instant::ZERO, &sources, &parameters).throttle, 0.5);
//! sources.operator_age = Some(Duration::from_secs(1));
//! assert_eq!(selector.step(Instant::ZERO, &sources, &parameters), DriverInput::STOP);
//! ```

use crate::messages::{DriverInput, InputMode, OperatorCommand, SystemState};
use crate::models::{fraction, within};
use crate::parameters::InputParameters;
use stampfly_types::{Duration, Instant};

/// The built-in scenario: until when, and what. After the last line everything is released.
const DEMO: [(Duration, DriverInput); 3] = [
    (Duration::from_secs(2), DriverInput { throttle: 0.6, brake: 0.0, steer: 0.0 }),
    (Duration::from_secs(5), DriverInput { throttle: 0.2, brake: 0.0, steer: 0.2 }),
    (Duration::from_secs(7), DriverInput { throttle: 0.0, brake: 0.6, steer: 0.0 }),
];

/// The input of the built-in scenario at this time from its start.
#[must_use]
pub fn demo(time: Duration) -> DriverInput {
    DEMO.iter().find(|(until, _)| time < *until).map_or_else(DriverInput::default, |(_, input)| *input)
}

/// What the driver's input is made from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriverSources {
    /// The operator's last command.
    pub operator: OperatorCommand,
    /// How old it is; `None` before the first.
    pub operator_age: Option<Duration>,
    /// The recorded input of this period; `None` when the record is over.
    pub replay: Option<DriverInput>,
    /// Speed of the vehicle, m/s.
    pub speed: f32,
    /// State of the safety supervisor.
    pub system_state: SystemState,
}

/// Selects and limits the driver's input.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DriverSelector {
    demo_started: Option<Instant>,
}

impl DriverSelector {
    /// The input of this period. Inputs are clamped to their ranges; one that is not a number counts as 0.
    pub fn step(&mut self, now: Instant, sources: &DriverSources, parameters: &InputParameters) -> DriverInput {
        let OperatorCommand { throttle, brake, steer, mode, .. } = sources.operator;
        let started = *self.demo_started.get_or_insert(now);
        if mode != InputMode::Demo {
            self.demo_started = None;
        }
        let timeout = Duration::from_seconds(parameters.timeout);
        let heard = sources.operator_age.is_some_and(|age| age <= timeout);
        let selected = match mode {
            InputMode::Manual if heard => DriverInput { throttle, brake, steer },
            InputMode::Manual => DriverInput::STOP,
            InputMode::Demo => demo(now.since(started)),
            InputMode::Replay => sources.replay.unwrap_or(DriverInput::STOP),
        };
        let input = DriverInput {
            throttle: fraction(selected.throttle),
            brake: fraction(selected.brake),
            steer: within(selected.steer, 1.0),
        };
        if sources.system_state == SystemState::Degraded { degraded(input, sources.speed, parameters) } else { input }
    }
}

/// Limits speed and steering. Applied to its own result it changes nothing, so a replay of limited input is exact.
fn degraded(input: DriverInput, speed: f32, parameters: &InputParameters) -> DriverInput {
    let room = (parameters.degraded_speed - speed) / parameters.degraded_band;
    DriverInput {
        throttle: input.throttle.min(fraction(room)),
        brake: input.brake.max(fraction(-room)),
        steer: within(input.steer, parameters.degraded_steer),
    }
}
