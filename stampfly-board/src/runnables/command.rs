//! Command: every source of commands in, one arbitrated set of sticks out.

use crate::config::VehicleConfig;
use crate::topics::CommandEnds;
use stampfly_bus::{Activation, Runnable, Stamped};
use stampfly_mode::Authority;
use stampfly_types::messages::{Alerts, CommandSetpoint, CommandSource};
use stampfly_types::{Duration, Instant};

/// Sticks that are older than this are none: five periods of this runnable, which has a slow band and may be starved.
const OLDEST: Duration = Duration::from_millis(100);

/// The sticks as their readers may use them: those of the failsafe, level and no climb, when they are too old.
pub(super) fn present(sample: Option<&Stamped<CommandSetpoint>>, now: Instant) -> CommandSetpoint {
    match sample {
        Some(sample) if sample.age(now) < OLDEST => sample.data,
        Some(_) => CommandSetpoint { source: CommandSource::Failsafe, ..CommandSetpoint::default() },
        None => CommandSetpoint::default(),
    }
}

/// Command: every source of commands in, one arbitrated set of sticks out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Command {
    authority: Authority,
}

impl Command {
    /// No source has authority.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        Self { authority: Authority::new(config.authority) }
    }
}

impl Runnable for Command {
    type Ends<'b> = CommandEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut CommandEnds<'_>) {
        for frame in ends.command_pilot.iter() {
            self.authority.pilot(frame.at, &frame.data);
        }
        let heard = !ends.system_alert.get().active.contains(Alerts::COMM_LOST);
        let setpoint = self.authority.step(activation.now(), ends.flight_status.get().commander, heard);
        ends.command_setpoint.publish(activation.now(), &setpoint);
    }
}
