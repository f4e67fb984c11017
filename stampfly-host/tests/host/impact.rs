//! From a blow to motors that are off: a vehicle that flies into a wall.
//!
//! The blow begins in the step of the physics, 0.6 ms long, in which the true specific force passes the limit of the failsafe. No sensor
//! knows that: a sample arrives about 2 ms after its instant, and the next one 2.5 ms later. The end is the clock at which
//! four duties of zero have been published.

use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::flight::Surroundings;
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::Id;
use stampfly_flight::Observer;
use stampfly_flight::newest::message;
use stampfly_mode::failsafe::FailsafeConfig;
use stampfly_sim::World;
use stampfly_sim::fault::Fault;
use stampfly_sim::plant::STEP;
use stampfly_sim::vehicle::{FlightOptions, Vehicle, Witness, fly};
use stampfly_types::messages::{Alerts, MotorOutput, SystemAlert};
use stampfly_types::{Duration, Instant};

/// From the blow, and from the alert.
const WITHIN: [Duration; 2] = [Duration::from_millis(5), Duration::from_micros(2_500)];

struct Timing {
    world: World,
    clock: Instant,
    /// So far the blow was looked for.
    seen: Instant,
    motors_on: bool,
    blow: Option<Instant>,
    alerted: Option<Instant>,
    stopped: Option<Instant>,
}

impl Observer for Timing {}

impl Witness<Runnables> for Timing {
    fn turn(&mut self, clock: Instant) {
        let limit = f64::from(FailsafeConfig::default().impact);
        self.clock = clock;
        while self.seen + STEP <= clock {
            self.seen += STEP;
            if self.motors_on && self.world.motion_at(self.seen).specific_force.norm() > limit {
                self.blow.get_or_insert(self.seen);
            }
        }
    }

    fn published(&mut self, topic: usize, _: Instant, _: u32, words: &[u32]) {
        if topic == Id::system_alert as usize {
            let alerts = message::<SystemAlert>(words).unwrap_or_default().active;
            if alerts.contains(Alerts::IMPACT) {
                self.alerted.get_or_insert(self.clock);
            }
        } else if topic == Id::actuator_motor as usize {
            let on = message::<MotorOutput>(words).unwrap_or_default().duty.iter().any(|duty| *duty > 0.0);
            if self.motors_on && !on && self.blow.is_some() {
                self.stopped.get_or_insert(self.clock);
            }
            self.motors_on = on;
        }
    }
}

#[test]
fn a_wall_stops_the_motors() {
    let flights = crate::thorough::flights(16, 40);
    let mut all = Vec::new();
    for seed in 1..=flights {
        let mission = Mission::parse("arm\ntakeoff 0.6\ngoto 2 0 0.6 speed 1.5\nland\n").expect("a mission");
        let faults = vec![Fault::parse("wall=0.6@move", StampFly::FAULTS).expect("a fault")];
        let setup = Setup { mission, faults, limit: Duration::from_secs(14), ..Setup::reference(seed) };
        let mut surroundings = Surroundings::new(&setup);
        let start = setup.simulation.start;
        let world = surroundings.world();
        let (blow, alerted, stopped) = (None, None, None);
        let mut timing = Timing { world, clock: start, seen: start, motors_on: false, blow, alerted, stopped };
        let options = FlightOptions { start, limit: setup.limit, jitter: None };
        fly(&setup.vehicle, &options, &mut surroundings, &mut timing, &mut |_, _| {});
        let (Some(blow), Some(alerted), Some(stopped)) = (timing.blow, timing.alerted, timing.stopped) else {
            panic!("seed {seed}: no blow, no alert, or motors that go on");
        };
        assert!(stopped >= alerted, "seed {seed}: the motors stop before the alert");
        all.push(([stopped.since(blow), stopped.since(alerted)].map(Duration::as_micros), seed));
    }
    all.sort_unstable();
    println!("motors off after the blow, and after the alert, us, and the seed: {all:?}");
    let within = WITHIN.map(Duration::as_micros);
    let late: Vec<_> = all.iter().filter(|(took, _)| took[0] > within[0] || took[1] > within[1]).collect();
    assert!(late.is_empty(), "{late:?}");
}
