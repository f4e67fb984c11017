//! Flights that are made up, and what the vehicle has done by itself in them.

use super::*;
use stampfly_sim::Truth;
use stampfly_sim::fault::Fault;
use stampfly_types::messages::{ControlOutput, MotorOutput, StateEstimate};
use stampfly_types::{Message, Vec3};

/// A vehicle in the air under a pilot, looked at every 2.5 ms.
struct Flight {
    interventions: Interventions,
    now: Instant,
    truth: Truth,
    pilot: PilotInput,
    torque: Vec3,
}

impl Flight {
    fn new(faults: &[Fault]) -> Self {
        let injector = Injector::new(Instant::ZERO, faults);
        let truth = Truth { position: Vec3::new(0.0, 0.0, -3.0), battery_voltage: 3.8, ..Truth::default() };
        let mut flight = Self {
            interventions: Interventions::new(&injector, &VehicleConfig::default()),
            now: Instant::ZERO,
            truth,
            pilot: PilotInput { mode: FlightMode::Stabilize, arm: true, ..PilotInput::default() },
            torque: Vec3::zeros(),
        };
        flight.status(FlightPhase::Flying, FlightMode::Stabilize);
        flight.fly(0.3);
        flight
    }

    fn publish(&mut self, id: Id, message: impl Message) {
        self.interventions.published(id, self.now, message.to_words().as_ref());
    }

    fn status(&mut self, phase: FlightPhase, mode: FlightMode) {
        self.publish(
            Id::flight_status,
            FlightStatus { phase, mode, armed: is_armed(phase), ..FlightStatus::default() },
        );
    }

    fn alerts(&mut self, active: Alerts) {
        self.publish(Id::system_alert, SystemAlert { active, ..SystemAlert::default() });
    }

    fn fly(&mut self, seconds: f32) {
        for _ in 0..(seconds * 400.0) as u32 {
            self.now += Duration::from_micros(2_500);
            self.publish(Id::command_pilot, self.pilot);
            self.publish(
                Id::estimate_state,
                StateEstimate { attitude: self.truth.attitude, ..StateEstimate::default() },
            );
            self.publish(Id::control_output, ControlOutput { torque: self.torque, ..ControlOutput::default() });
            self.publish(Id::actuator_motor, MotorOutput { armed: true, ..MotorOutput::default() });
            let clearance = -self.truth.position.z;
            let status = FlightStatus::default();
            let sight = Sight { now: self.now, truth: &self.truth, clearance, strikes: 0, status: &status, done: 2 };
            self.interventions.see(&sight);
        }
    }

    /// The vehicle is stopped by this alert now.
    fn cut(mut self) -> Intervention {
        self.alerts(Alerts::IMU_FAULTY);
        self.status(FlightPhase::IdleGround, FlightMode::Stabilize);
        self.interventions.list().first().cloned().expect("an intervention")
    }
}

#[test]
fn a_sound_vehicle_that_is_stopped_by_an_alert_is_told_with_where_it_was() {
    let mut flight = Flight::new(&[]);
    flight.truth.velocity = Vec3::new(3.0, 0.0, 4.0);
    flight.fly(0.1);
    let Intervention { alert, action, sound, height_m, speed_mps, .. } = flight.cut();
    assert_eq!((alert.as_str(), action, sound, height_m, speed_mps), ("IMU_FAULTY", "cut", true, 3.0, 5.0));
}

#[test]
fn a_vehicle_is_not_sound_when_one_of_its_conditions_does_not_hold() {
    let cut = |change: fn(&mut Flight)| {
        let mut flight = Flight::new(&[]);
        change(&mut flight);
        flight.cut().sound
    };
    let touches = |flight: &mut Flight, seconds: f32| {
        flight.truth.contact = true;
        flight.fly(0.01);
        flight.truth.contact = false;
        flight.fly(seconds);
    };
    let turns = |flight: &mut Flight, rate: f32| {
        // Half a lost rotor's: 113 rad/s² about roll.
        flight.truth.angular_rate.x = rate;
        flight.fly(0.01);
    };
    assert!(cut(|_| {}));
    let mut touched = Flight::new(&[]);
    touches(&mut touched, 0.05);
    assert!(!touched.cut().sound, "it has touched the ground");
    let mut sooner = Flight::new(&[]);
    sooner.alerts(Alerts::IMPACT);
    sooner.status(FlightPhase::IdleGround, FlightMode::Stabilize);
    touches(&mut sooner, 0.0);
    assert!(!sooner.interventions.list()[0].sound, "it touches the ground before the truth is looked at");
    let mut left = Flight::new(&[]);
    touches(&mut left, 0.15);
    assert!(left.cut().sound, "it has left it");
    let mut small = Flight::new(&[]);
    turns(&mut small, 10.0);
    assert!(small.cut().sound);
    let mut large = Flight::new(&[]);
    turns(&mut large, 13.0);
    assert!(!large.cut().sound, "no torque turned it so");
    assert!(!cut(|flight| {
        flight.truth.battery_voltage = 2.9;
        flight.fly(0.01);
    }));
    let fault = Fault::parse("tof-silent@0.1", crate::simulation::faults::FAULTS).expect("a fault");
    assert!(!Flight::new(&[fault]).cut().sound, "a fault is active");
    let mut wrong = Flight::new(&[]);
    wrong.truth.attitude = stampfly_types::Quat::from_axis_angle(&Vec3::x(), 0.2);
    let estimate = StateEstimate::default();
    wrong.fly(0.01);
    wrong.publish(Id::estimate_state, estimate);
    let (truth, status) = (wrong.truth, FlightStatus::default());
    let sight = Sight { now: wrong.now, truth: &truth, clearance: 3.0, strikes: 0, status: &status, done: 2 };
    wrong.interventions.see(&sight);
    let cut = wrong.cut();
    assert!(!cut.sound && (cut.attitude_error_deg - 11.46).abs() < 0.01, "{cut:?}");
}

#[test]
fn a_torque_that_turns_it_leaves_it_sound() {
    let mut flight = Flight::new(&[]);
    // As large as the loop may ask for, and the body turns as it says.
    flight.torque.x = 2.0e-3;
    let acceleration = flight.torque.x / crate::airframe::AIRFRAME.inertia.x;
    for _ in 0..40 {
        flight.truth.angular_rate.x += acceleration * 0.0025;
        flight.fly(0.0025);
    }
    assert!(flight.cut().sound);
}

#[test]
fn what_a_person_or_a_program_asks_for_is_none() {
    let ends = |change: fn(&mut Flight), phase: FlightPhase| {
        let mut flight = Flight::new(&[]);
        change(&mut flight);
        flight.fly(0.1);
        flight.status(phase, FlightMode::Stabilize);
        let list = flight.interventions.list();
        list.iter().map(|one| (one.action, one.alert.clone())).collect::<Vec<_>>()
    };
    let [idle, landing] = [FlightPhase::IdleGround, FlightPhase::Landing];
    for phase in [idle, landing] {
        assert_eq!(ends(|flight| flight.pilot.arm = false, phase), []);
        assert_eq!(ends(|flight| flight.pilot.kill = true, phase), []);
        let asks = |flight: &mut Flight| {
            flight.publish(Id::command_guided, GuidedCommand { kind: GuidedKind::Land, ..GuidedCommand::default() });
        };
        assert_eq!(ends(asks, phase), []);
    }
    assert_eq!(ends(|_| {}, idle), [("cut", "NONE".into())], "a touch-down in the air");
    assert_eq!(ends(|_| {}, landing), [("land", "NONE".into())]);
    assert_eq!(ends(|flight| flight.alerts(Alerts::MOTOR_WEAK), landing), [("land", "MOTOR_WEAK".into())]);
}

#[test]
fn a_landing_is_for_the_battery_only_without_another_alert_that_lands() {
    let spent = |voltage: f32, alerts: Alerts| {
        let mut flight = Flight::new(&[]);
        flight.truth.battery_voltage = voltage;
        flight.fly(0.01);
        flight.alerts(alerts);
        flight.status(FlightPhase::Landing, FlightMode::Stabilize);
        flight.interventions.list()[0].spent
    };
    let empty = Alerts::CRITICAL_BATTERY;
    assert!(spent(2.9, empty) && spent(2.9, Alerts::NO_LIFT) && spent(2.9, empty.with(Alerts::TOF_LOST)));
    assert!(!spent(2.9, empty.with(Alerts::STRUCK)) && !spent(2.9, empty.with(Alerts::RANGE_IMPLAUSIBLE)));
    assert!(!spent(3.8, empty), "it is not empty");
}

#[test]
fn another_mode_is_one_unless_the_switch_was_turned_or_no_floor_is_in_reach() {
    let changes = |height: f32, alerts: Alerts, turns: bool| {
        let mut flight = Flight::new(&[]);
        flight.truth.position.z = -height;
        flight.pilot.mode = FlightMode::PosHold;
        flight.fly(0.5);
        flight.status(FlightPhase::Flying, FlightMode::PosHold);
        if turns {
            flight.pilot.mode = FlightMode::AltHold;
            flight.fly(0.1);
        }
        flight.alerts(alerts);
        flight.status(FlightPhase::Flying, FlightMode::AltHold);
        flight.interventions.list().iter().map(|one| (one.action, one.sound)).collect::<Vec<_>>()
    };
    let [lost, wrong] = [Alerts::FLOW_LOST, Alerts::FLOW_IMPLAUSIBLE];
    assert_eq!(changes(1.0, wrong, false), [("mode", true)]);
    assert_eq!(changes(1.0, wrong, true), []);
    assert_eq!(changes(1.0, lost, false), [("mode", true)]);
    assert_eq!(changes(6.0, lost, false), [("mode", false)]);
    assert_eq!(changes(6.0, wrong, false), [("mode", true)], "one that sees nothing contradicts nothing");
}
