//! From a blow to motors that are off: a vehicle that flies into a wall.
//!
//! The blow begins when the true specific force passes the limit of the failsafe. Truth is seen once in a period of the flight
//! loop, so it has begun up to a period before it is seen: the time given is the longer one. The end is the clock at which
//! four duties of zero have been published. The failsafe needs two samples of a hard blow, and more of one that comes to its force
//! slowly.

use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::Id;
use stampfly_flight::Observer;
use stampfly_flight::newest::message;
use stampfly_host::flown::fly;
use stampfly_mode::failsafe::FailsafeConfig;
use stampfly_sim::Truth;
use stampfly_sim::fault::Fault;
use stampfly_sim::vehicle::{Vehicle, Witness};
use stampfly_types::messages::{Alerts, MotorOutput, SystemAlert};
use stampfly_types::{Duration, Instant};

/// From the blow, and from the alert.
const WITHIN: [Duration; 2] = [Duration::from_millis(10), Duration::from_micros(2_500)];

#[derive(Default)]
struct Timing {
    clock: Instant,
    motors_on: bool,
    truth_before: Instant,
    blow: Option<Instant>,
    alerted: Option<Instant>,
    stopped: Option<Instant>,
}

impl Observer for Timing {}

impl Witness<Runnables> for Timing {
    fn turn(&mut self, clock: Instant) {
        self.clock = clock;
    }

    fn published(&mut self, topic: usize, _: Instant, _: u32, words: &[u32]) {
        if topic == Id::system_alert as usize {
            let alerts = message::<SystemAlert>(words).unwrap_or_default().active;
            if self.alerted.is_none() && alerts.contains(Alerts::IMPACT) {
                self.alerted = Some(self.clock);
            }
        } else if topic == Id::actuator_motor as usize {
            let on = message::<MotorOutput>(words).unwrap_or_default().duty.iter().any(|duty| *duty > 0.0);
            if self.motors_on && !on && self.blow.is_some() {
                self.stopped.get_or_insert(self.clock);
            }
            self.motors_on = on;
        }
    }

    fn beside(&mut self, _: usize, at: Instant, _: u32, words: &[u32]) {
        let force = message::<Truth>(words).unwrap_or_default().specific_force.norm();
        if self.motors_on && force > FailsafeConfig::default().impact {
            self.blow.get_or_insert(self.truth_before);
        }
        self.truth_before = at;
    }
}

#[test]
fn a_wall_stops_the_motors() {
    let mut all = Vec::new();
    for seed in 1..=20 {
        let mission = Mission::parse("arm\ntakeoff 0.6\ngoto 2 0 0.6 speed 1.5\nland\n").expect("a mission");
        let faults = vec![Fault::parse("wall=0.6@move", StampFly::FAULTS).expect("a fault")];
        let setup = Setup { mission, faults, limit: Duration::from_secs(14), ..Setup::reference(seed) };
        let mut timing = Timing::default();
        fly::<StampFly>(&setup, &mut timing, &mut |_, _| {});
        let (Some(blow), Some(alerted), Some(stopped)) = (timing.blow, timing.alerted, timing.stopped) else {
            panic!("seed {seed}: no blow, no alert, or motors that go on");
        };
        let took = [stopped.since(blow), stopped.since(alerted)];
        assert!(stopped >= alerted && took[0] <= WITHIN[0] && took[1] <= WITHIN[1], "seed {seed}: {took:?}");
        all.push(took.map(Duration::as_micros));
    }
    all.sort_unstable();
    println!("motors off after the blow, and after the alert, us: {all:?}");
}
