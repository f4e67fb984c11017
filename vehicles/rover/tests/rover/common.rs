//! The assembled vehicle: its tables under the flight loop, tick by tick, with components that can die.

use stampfly_bus::{Activation, ActivationInfo, Band, Schedule, TopicTable, VisitLines};
use stampfly_flight::Assembled;
use stampfly_rover::messages::*;
use stampfly_rover::schedule::{Id, TICK};
use stampfly_rover::topics::{Bus, LinkEnds, Outside};
use stampfly_rover::{Parameters, Runnables};
use stampfly_types::Instant;

/// What happens to a vehicle in one tick.
#[derive(Clone, Copy, Default)]
pub struct Events {
    /// `None`: the operator says nothing.
    pub operator: Option<OperatorCommand>,
    /// A line of a log.
    pub replay: Option<LogRecord>,
    /// What an engine in another process says.
    pub remote_drive: Option<DriveCommand>,
    /// Components that do not run.
    pub dead: Components,
    /// Nor does the supervisor.
    pub is_unsupervised: bool,
}

/// The rover's runnables, some of which return without doing anything.
struct Mortal {
    runnables: Runnables,
    dead: Components,
    is_unsupervised: bool,
}

impl Schedule for Mortal {
    type Topics = Bus;
    type Config = Parameters;
    type States = <Runnables as Schedule>::States;
    const ACTIVATIONS: &'static [ActivationInfo] = Runnables::ACTIVATIONS;
    const INPUTS: &'static [usize] = <Runnables as Schedule>::INPUTS;

    fn new(parameters: &Parameters) -> Self {
        Self { runnables: Runnables::new(parameters), dead: Components::NONE, is_unsupervised: false }
    }

    fn renew(&mut self, index: usize, config: &Parameters) {
        self.runnables.renew(index, config);
    }

    fn states(start: Instant) -> Self::States {
        Runnables::states(start)
    }

    fn visit<V: VisitLines>(visitor: &mut V) {
        Runnables::visit(visitor);
    }

    fn read(ends: &mut <Bus as TopicTable>::Ends<'_>, index: usize, activation: &mut Activation) {
        Runnables::read(ends, index, activation);
    }

    fn run(&mut self, ends: &mut <Bus as TopicTable>::Ends<'_>, index: usize, activation: &mut Activation) {
        let component = [
            (Id::engine, Components::ENGINE),
            (Id::brake, Components::BRAKE),
            (Id::steering, Components::STEERING),
            (Id::vehicle_dynamics, Components::DYNAMICS),
            (Id::com, Components::COM),
            (Id::driver_input, Components::TIME_BASE),
        ];
        let component = component.iter().find(|(id, _)| *id as usize == index).map(|(_, component)| *component);
        let is_dead = match component {
            Some(component) => self.dead.contains(component),
            None => self.is_unsupervised && index == Id::safety_supervisor as usize,
        };
        if !is_dead {
            self.runnables.run(ends, index, activation);
        }
    }
}

/// The instant of a tick, counted from zero.
pub fn instant(tick: usize) -> Instant {
    Instant::from_micros(TICK.as_micros() * (tick as u64 + 1))
}

/// The operator's command with these pedals and this wheel.
pub fn manual(throttle: f32, brake: f32, steer: f32) -> OperatorCommand {
    OperatorCommand { throttle, brake, steer, ..OperatorCommand::default() }
}

/// A fresh vehicle, driven by `events` for a number of ticks. Returns the log.
pub fn run(ticks: usize, mut events: impl FnMut(usize, &mut LinkEnds<'_>) -> Events) -> Vec<LogRecord> {
    let mut bus = Bus::new();
    let Assembled { mut flight_loop, outside: Outside { mut link }, .. } =
        Assembled::<Mortal>::new(&mut bus, None, &Parameters::default(), Instant::ZERO);
    let mut log = Vec::new();
    for tick in 0..ticks {
        let now = instant(tick);
        let Events { operator, replay, remote_drive, dead, is_unsupervised } = events(tick, &mut link);
        let runnables = flight_loop.runnables().runnables.clone();
        flight_loop.set_runnables(Mortal { runnables, dead, is_unsupervised });
        if let Some(command) = operator {
            link.operator_command.publish(now, &command);
        }
        if let Some(line) = replay {
            link.replay_record.publish(now, &line);
        }
        if let Some(command) = remote_drive {
            link.remote_drive.publish(now, &command);
        }
        flight_loop.run_band(Band::Flight, now, &mut ());
        flight_loop.run_band(Band::Background, now, &mut ());
        log.extend(core::iter::from_fn(|| link.log_record.next()).map(|line| line.data));
        assert_eq!(log.len(), tick + 1, "one line a tick");
    }
    log
}
