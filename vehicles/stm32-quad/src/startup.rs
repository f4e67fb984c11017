//! The sequence that makes a vehicle new: it runs instead of flying when the transmit pin of the serial line is held low at power-on.
//!
//! | for | lights, in turns | then |
//! |---|---|---|
//! | 5 s | every 250 ms | the transmitter is forgotten |
//! | 5 s | every 500 ms | parameters and offsets are the original's |
//! | 5 s | every second | speed controllers learn their range: 5 s at full pulse, 5 s at their least |
//! | | both on | nothing more |
//!
//! Who takes the battery away while the lights blink keeps what comes after. **Propellers off.**

use stampfly_types::Duration;

/// What is to be done now. Each is said once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Forget the transmitter.
    ForgetTransmitter,
    /// Set and store the parameters and offsets of a new vehicle.
    ResetParameters,
}

/// What is shown and sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// The front light.
    pub front: bool,
    /// The back light.
    pub back: bool,
    /// Share of full speed for every motor's pulse.
    pub motors: f32,
}

const BLINKING: Duration = Duration::from_secs(5);
/// How long each of the two stays in the three rows.
const DWELL: [Duration; 3] = [Duration::from_millis(250), Duration::from_millis(500), Duration::from_secs(1)];
const FULL: Duration = Duration::from_secs(5);
const LEAST: Duration = Duration::from_secs(5);
/// The share at which the original leaves the speed controllers.
const LEAST_SHARE: f32 = 0.05;

/// The sequence.
///
/// ```
/// use stampfly_stm32_quad::startup::{Startup, Step};
/// use stampfly_types::Duration;
/// let mut startup = Startup::default();
/// let (shown, step) = startup.step(Duration::ZERO);
/// assert!(shown.front && !shown.back && shown.motors == 0.0 && step.is_none());
/// assert_eq!(startup.step(Duration::from_secs(5)).1, Some(Step::ForgetTransmitter));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Startup {
    done: u8,
}

impl Startup {
    /// What happens so long after power-on.
    pub fn step(&mut self, since: Duration) -> (Shown, Option<Step>) {
        let row = (since.as_micros() / BLINKING.as_micros()).min(u64::from(u8::MAX)) as u8;
        let step = if self.done == 0 && row >= 1 {
            Some(Step::ForgetTransmitter)
        } else if self.done == 1 && row >= 2 {
            Some(Step::ResetParameters)
        } else {
            None
        };
        self.done += u8::from(step.is_some());
        let into = since.as_micros() - u64::from(row) * BLINKING.as_micros();
        let shown = match DWELL.get(usize::from(row)) {
            Some(dwell) => {
                let front = (into / dwell.as_micros()).is_multiple_of(2);
                Shown { front, back: !front, motors: 0.0 }
            }
            None => {
                let since = since - BLINKING * 3;
                let motors = if since < FULL {
                    1.0
                } else if since < FULL + LEAST {
                    LEAST_SHARE
                } else {
                    0.0
                };
                let is_over = motors == 0.0;
                Shown { front: is_over, back: is_over, motors }
            }
        };
        (shown, step)
    }
}
