//! A vehicle that cannot lift itself: too heavy, or its battery too weak. Motors at their limit
//! drag it over the floor, so it stops them.

use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::{Outcome, PLANT, StampFly};
use stampfly_board::topics::Id;
use stampfly_flight::Observer;
use stampfly_flight::newest::message;
use stampfly_host::flown::fly;
use stampfly_sim::Truth;
use stampfly_sim::vehicle::{Options, Vehicle, Verdict as _, Witness};
use stampfly_types::messages::{Alerts, ControlOutput, MotorOutput, SystemAlert};
use stampfly_types::{Duration, Instant, Vec3};

/// Above the weight of the vehicle as it was designed, for which its controller is made: 1.1 of it.
/// A vehicle that weighs what it should rises by 0.5 m within a second of that.
const ASKED: f32 = 1.1;
/// The thrust is at its ceiling: some of it is asked for and not there. Less than this is what
/// steering takes for a moment.
const MISSING: f32 = 0.05;

/// What is asked of the motors, and what comes of it.
#[derive(Default)]
struct Lift {
    /// When more than the weight, or more than there is, was asked for first, and when the motors
    /// stopped after that.
    asked: Option<Instant>,
    stopped: Option<Instant>,
    /// They turned again.
    restarted: bool,
    full: bool,
    from: Option<Vec3>,
    beside: f32,
    highest: f32,
    alerts: Alerts,
}

impl Observer for Lift {}

impl Witness<Runnables> for Lift {
    fn published(&mut self, topic: usize, at: Instant, _: u32, words: &[u32]) {
        match Id::ALL.get(topic) {
            Some(Id::control_output) => {
                let Some(ControlOutput { thrust, .. }) = message(words) else { return };
                let weight = (PLANT.mass * PLANT.gravity) as f32;
                let more = thrust >= ASKED * weight || self.full;
                self.asked = self.asked.or(more.then_some(at));
            }
            Some(Id::actuator_motor) => {
                let Some(MotorOutput { duty, unmet, .. }) = message(words) else { return };
                self.full = unmet[3] > MISSING;
                let turn = duty.iter().any(|duty| *duty > 0.0);
                self.restarted |= turn && self.stopped.is_some();
                if !turn && self.asked.is_some() {
                    self.stopped = self.stopped.or(Some(at));
                }
            }
            Some(Id::system_alert) => {
                self.alerts |= message::<SystemAlert>(words).map_or(Alerts::ALL, |alert| alert.active);
            }
            _ => {}
        }
    }

    fn beside(&mut self, _: usize, _: Instant, _: u32, words: &[u32]) {
        let Some(Truth { position, .. }) = message(words) else { return };
        let from = *self.from.get_or_insert(position);
        self.beside = self.beside.max((position - from).horizontal().norm());
        self.highest = self.highest.max(from.z - position.z);
    }
}

fn flown(seed: u64, mission: &str, gust: f32, plant: &str) -> (Lift, Outcome) {
    let mission = Some(mission.to_owned());
    let options = Options { mission, gust: Some(gust), plant: vec![plant.to_owned()], ..Options::default() };
    let setup = StampFly::setup(&options, seed).expect("options");
    let mut lift = Lift::default();
    let outcome = fly::<StampFly>(&setup, &mut lift, &mut |_, _| {}).outcome;
    (lift, outcome)
}

#[test]
fn a_vehicle_that_cannot_lift_itself_stops_its_motors_before_it_has_gone_anywhere() {
    let [long, short] = ["arm; takeoff 0.5; hover 5; goto 1 0 0.7; land", "arm; takeoff 0.5; hover 2; land"];
    for (seed, mission, gust, plant) in [
        (880642, long, 1.0, "mass=0.06"),
        (880642, long, 1.0, "mass=0.07"),
        (4, short, 0.0, "mass=0.07"),
        (880641, long, 1.0, "battery_resistance=0.3"),
        (880642, short, 1.0, "battery_resistance=0.3"),
    ] {
        let (lift, outcome) = flown(seed, mission, gust, plant);
        let what = format!("{plant}, seed {seed}");
        let asked = lift.asked.unwrap_or_else(|| panic!("{what}: no more than the weight was asked for"));
        let stopped = lift.stopped.unwrap_or_else(|| panic!("{what}: the motors turned to the end"));
        let after = stopped.since(asked);
        println!(
            "{what}: off {after} after it, {:.2} m beside, {:.2} m up, {:?}",
            lift.beside,
            lift.highest,
            lift.alerts.names().collect::<Vec<_>>()
        );
        assert!(after <= Duration::from_millis(2_100), "{what}: {after}");
        assert!(!outcome.succeeded() && outcome.sentence().contains("NO_LIFT"), "{what}: {}", outcome.sentence());
        assert!(!lift.restarted, "{what}: they turned again");
        assert!(lift.beside < 1.0, "{what}: {} m", lift.beside);
        assert!(lift.alerts.contains(Alerts::NO_LIFT) && !lift.alerts.contains(Alerts::IMPACT), "{what}");
    }
}
