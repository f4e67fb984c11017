//! A body with a weight, a floor and rotors that lag, below a manager that is told the truth, or is not.

use super::*;
use stampfly_types::messages::{SensorMask, Validity};
use stampfly_types::{Duration, GRAVITY, Vec3, math};
use std::string::{String, ToString};
use std::vec;
use std::vec::Vec;

const DT: f32 = 0.0025;
/// Of the motors, s.
const LAG: f32 = 0.02;
/// Vertical drag, 1/s.
const DRAG: f32 = 1.4;

/// What the manager sees of a vehicle that feels its specific force and whose motors make what is asked for.
fn flown<'a>(
    estimate: &'a StateEstimate,
    phase: FlightPhase,
    setpoint: &'a Setpoint,
    demand: &'a ControlOutput,
) -> LandingInput<'a> {
    LandingInput { felt: true, estimate, phase, setpoint, demand, unmet: 0.0 }
}

/// What the estimate says of a body at this height, m, and this climb rate, m/s.
type Told = fn(height: f32, climb: f32, time: f32) -> StateEstimate;

fn everything(height: f32, climb: f32, _: f32) -> StateEstimate {
    StateEstimate {
        height: height + 0.03,
        velocity: Vec3::new(0.0, 0.0, -climb),
        valid: Validity::ALL,
        ..Default::default()
    }
}

fn nothing(_: f32, _: f32, _: f32) -> StateEstimate {
    StateEstimate { height: 7.0, valid: Validity::TILT, ..Default::default() }
}

/// One landing: how it is flown.
struct Landing {
    height: f32,
    told: Told,
    /// Weight over what the controller takes for hover thrust.
    weight: f32,
    /// Bias of the accelerometer upwards, m/s².
    bias: f32,
    /// Amplitude of vibration, m/s².
    vibration: f32,
}

const NOMINAL: Landing = Landing { height: 0.5, told: everything, weight: 1.0, bias: 0.0, vibration: 0.0 };

/// How it ended: seconds until it counted as landed, height above the floor then, speed at the first touch.
#[derive(Debug)]
struct Ended {
    after: f32,
    height: f32,
    touch: f32,
}

impl Landing {
    fn fly(&self, seconds: f32) -> Option<Ended> {
        let mut manager = TakeoffLanding::new(LandingConfig::default());
        // Thrusts as shares of what the controller takes for hover thrust.
        let (mut height, mut climb, mut thrust, mut demand) = (self.height, 0.0f32, self.weight, self.weight);
        let mut touch = None;
        let mut integral = self.weight - 1.0;
        for k in 0..(seconds / DT) as u64 {
            let time = k as f32 * DT;
            thrust += DT / (LAG + DT) * (demand - thrust);
            let lift = GRAVITY * thrust / self.weight - DRAG * climb;
            let mut acceleration = lift - GRAVITY;
            if height <= 0.0 && acceleration <= 0.0 {
                touch.get_or_insert(-climb);
                (height, climb, acceleration) = (0.0, 0.0, 0.0);
            }
            climb += acceleration * DT;
            height += climb * DT;
            let shaken = self.vibration * math::sin(2.0 * core::f32::consts::PI * 83.0 * time);
            let force = acceleration + GRAVITY + self.bias + shaken;
            let mut estimate = (self.told)(height, climb, time);
            estimate.specific_force = Vec3::new(0.0, 0.0, -force);
            let land_detected = manager.step(
                Instant::from_micros(2_500 * k),
                &flown(
                    &estimate,
                    FlightPhase::Landing,
                    &Setpoint::default(),
                    &ControlOutput { thrust: demand, ..Default::default() },
                ),
            );
            if land_detected.landed {
                return Some(Ended { after: time, height, touch: touch.unwrap_or(0.0) });
            }
            // The vertical loop: on climb rate where there is one, else the share of hover thrust of a blind descent.
            let wanted = if estimate.valid.contains(Validity::VELOCITY_Z) {
                let error = -land_detected.descent_rate + estimate.velocity.z;
                integral = (integral + 7.0 / 0.8 * error * DT / GRAVITY).clamp(-0.5, 0.5);
                1.0 + integral + 7.0 * error / GRAVITY
            } else {
                0.96
            };
            let ceiling = land_detected.thrust_ceiling.min(1.6);
            demand = wanted.clamp(0.2, ceiling.max(0.2));
        }
        None
    }

    /// Flies, and is on the floor when it counts as landed.
    fn lands(&self, seconds: f32) -> Ended {
        let ended = self.fly(seconds).expect("it lands");
        assert!(ended.height < 0.01, "{ended:?}");
        ended
    }
}

#[test]
fn a_landing_is_gentle_and_is_noticed() {
    let ended = NOMINAL.lands(10.0);
    assert!(ended.touch < 0.25 && ended.after < 5.0, "{ended:?}");
}

#[test]
fn vibration_hides_no_touchdown_and_makes_none() {
    for vibration in [3.0, 10.0] {
        Landing { vibration, ..NOMINAL }.lands(10.0);
        Landing { vibration, told: nothing, ..NOMINAL }.lands(20.0);
    }
}

/// D3 a: a blind estimate that neither rises nor sinks made motors stop in the air.
#[test]
fn a_vehicle_without_height_and_climb_rate_comes_down_to_the_floor() {
    for height in [0.3, 1.0, 2.0, 3.0] {
        for weight in [0.97, 1.0, 1.03] {
            let ended = Landing { height, weight, told: nothing, ..NOMINAL }.lands(60.0);
            assert!(ended.touch < 1.0, "{height} m, weight {weight}: {ended:?}");
            // I10 of the invariants: three seconds and the height at 0.3 m/s; and one to find the floor.
            assert!(ended.after < 4.0 + height / 0.3 || weight < 1.0, "{height} m, weight {weight}: {ended:?}");
        }
    }
}

/// D3 d: standing on the floor, asked to land without height.
#[test]
fn a_vehicle_that_stands_and_knows_nothing_has_landed_within_two_seconds() {
    let ended = Landing { height: 0.0, told: nothing, ..NOMINAL }.lands(10.0);
    assert!(ended.after < 2.0, "{ended:?}");
}

/// D3 e: a bias of the accelerometer makes the estimate sink for as long as it stands.
#[test]
fn a_biased_accelerometer_does_not_keep_the_motors_on() {
    let sinking = |height: f32, climb: f32, time: f32| StateEstimate {
        velocity: Vec3::new(0.0, 0.0, -climb + 0.5),
        ..everything(height, climb, time)
    };
    for bias in [-2.0, 2.0] {
        Landing { bias, height: 0.02, told: sinking, ..NOMINAL }.lands(10.0);
    }
}

/// D1, its last part: the range finder says 3 cm, the filter believes it, and the vehicle is at 16 m.
#[test]
fn a_height_that_lies_does_not_land_a_vehicle_in_the_air() {
    let stuck = |_: f32, _: f32, _: f32| StateEstimate { height: 0.03, valid: Validity::ALL, ..Default::default() };
    let ended = Landing { height: 16.0, told: stuck, ..NOMINAL }.fly(120.0);
    assert!(ended.is_none_or(|ended| ended.height < 0.01), "in the air");
}

/// D1: a range of half the distance. On the floor the vertical loop has taken its thrust away before any test does.
#[test]
fn a_height_of_half_lands() {
    let half = |height: f32, climb: f32, time: f32| everything(0.5 * height - 0.015, 0.5 * climb, time);
    for height in [0.5, 1.5] {
        Landing { height, told: half, ..NOMINAL }.lands(20.0);
    }
}

#[test]
fn hovering_low_in_flight_is_never_landed() {
    let mut manager = TakeoffLanding::new(LandingConfig::default());
    let estimate = StateEstimate {
        height: 0.04,
        specific_force: Vec3::new(0.0, 0.0, -GRAVITY),
        valid: Validity::ALL,
        ..Default::default()
    };
    for k in 0..8_000 {
        let (setpoint, demand) = (Setpoint::default(), ControlOutput { thrust: 1.0, ..Default::default() });
        let input = flown(&estimate, FlightPhase::Flying, &setpoint, &demand);
        assert!(!manager.step(Instant::from_micros(2_500 * k), &input).landed);
    }
}

/// D15: something holds it, and after eight seconds it counted as flying.
#[test]
fn a_vehicle_that_is_held_never_completes_its_take_off() {
    let mut manager = TakeoffLanding::new(LandingConfig::default());
    let held = everything(0.0, 0.0, 0.0);
    for k in 0..8_000 {
        let (setpoint, demand) = (Setpoint::default(), ControlOutput { thrust: 1.5, ..Default::default() });
        let input = flown(&held, FlightPhase::TakeOff, &setpoint, &demand);
        let land_detected = manager.step(Instant::from_micros(2_500 * k), &input);
        assert!(!land_detected.takeoff_complete && land_detected.contact == GroundContact::Ground);
    }
}

/// The stages that a manager goes through, from step to step of this table: phase, height, m, and rate of descent, m/s.
fn stages(manager: &mut TakeoffLanding, steps: &[(FlightPhase, f32, f32)], valid: Validity) -> Vec<String> {
    let mut told = vec![];
    for (k, &(phase, height, sink_rate)) in steps.iter().enumerate() {
        let estimate = StateEstimate {
            height,
            velocity: Vec3::new(0.0, 0.0, sink_rate),
            specific_force: Vec3::new(0.0, 0.0, -GRAVITY),
            valid,
            ..Default::default()
        };
        let (setpoint, demand) = (Setpoint::default(), ControlOutput { thrust: 1.0, ..Default::default() });
        let input = flown(&estimate, phase, &setpoint, &demand);
        manager.step(Instant::from_micros(2_500 * k as u64), &input);
        told.push(manager.stage().to_string());
    }
    told
}

#[test]
fn the_second_flight_goes_through_the_same_stages_as_the_first() {
    use FlightPhase::{Armed, Flying, IdleGround, Landing, TakeOff};
    let flight = [
        (IdleGround, 0.03, 0.0, "Stand"),
        (Armed, 0.03, 0.0, "TakeOff/SpoolUp"),
        (TakeOff, 0.03, 0.0, "TakeOff/LiftOff"),
        (TakeOff, 0.1, -0.4, "TakeOff/Climb"),
        (Flying, 1.0, 0.0, "Fly"),
        (Landing, 1.0, 0.3, "Landing/Descend"),
        (Landing, 0.2, 0.2, "Landing/Flare"),
        (Landing, 0.04, 0.15, "Landing/Touchdown"),
        // It bounces, and a gust takes it up.
        (Landing, 0.1, -0.1, "Landing/Flare"),
        (Landing, 0.4, -0.3, "Landing/Descend"),
        (Landing, 0.04, 0.3, "Landing/Touchdown"),
    ];
    let (steps, names): (Vec<_>, Vec<_>) =
        flight.map(|(phase, height, sink_rate, name)| ((phase, height, sink_rate), name)).into_iter().unzip();
    let mut manager = TakeoffLanding::new(LandingConfig::default());
    for _ in 0..2 {
        assert_eq!(stages(&mut manager, &steps, Validity::ALL), names);
    }
}

#[test]
fn a_take_off_counts_from_its_phase_and_not_from_arming() {
    let mut manager = TakeoffLanding::new(LandingConfig::default());
    let mut step = |seconds, phase, height| {
        let estimate = StateEstimate { height, valid: Validity::ALL, ..Default::default() };
        let (setpoint, demand) = (Setpoint::default(), ControlOutput::default());
        let input = flown(&estimate, phase, &setpoint, &demand);
        manager.step(Instant::from_secs(seconds), &input)
    };
    assert_eq!(step(0, FlightPhase::Armed, 0.0).thrust_ceiling, f32::MAX);
    let config = LandingConfig::default();
    let lift_off = step(5, FlightPhase::TakeOff, 0.04);
    assert_eq!(lift_off.thrust_ceiling, config.takeoff_ceiling);
    let later = step(6, FlightPhase::TakeOff, 0.08);
    assert_eq!(later.contact, GroundContact::Ground, "by 4 cm");
    assert_eq!(later.thrust_ceiling, config.takeoff_ceiling + config.takeoff_ceiling_rise);
    assert_eq!(step(6, FlightPhase::TakeOff, 0.1).contact, GroundContact::Air);
}

#[test]
fn a_blind_landing_stays_blind_and_the_next_one_sees() {
    let mut manager = TakeoffLanding::new(LandingConfig::default());
    let landing = [(FlightPhase::Landing, 1.0, 0.3)];
    assert_eq!(stages(&mut manager, &landing, Validity::ALL), ["Landing/Descend"]);
    assert_eq!(stages(&mut manager, &landing, Validity::TILT), ["Landing/Blind"]);
    assert_eq!(stages(&mut manager, &landing, Validity::ALL), ["Landing/Blind"]);
    assert_eq!(stages(&mut manager, &[(FlightPhase::IdleGround, 0.03, 0.0)], Validity::ALL), ["Stand"]);
    assert_eq!(stages(&mut manager, &landing, Validity::ALL), ["Landing/Descend"]);
}

/// It stands on a table's edge, says the range, and falls beside it.
#[test]
fn a_vehicle_that_sinks_fast_under_a_ceiling_gets_its_thrust_back() {
    let config = LandingConfig::default();
    // How fast it sinks at this height, what share of the thrust that is missing the specific force misses, because drag carries the rest,
    // and how fast it becomes fast.
    let blind_at = |height: f32, sinks: f32, follows: f32, gains: f32| {
        let mut manager = TakeoffLanding::new(config);
        let (mut sink_rate, mut thrust, mut ceiling, mut fast) = (sinks, 1.0f32, f32::MAX, None);
        for k in 0..800u64 {
            let now = Instant::from_micros(2_500 * k);
            let demand = ControlOutput { thrust: ceiling.min(1.0), ..Default::default() };
            thrust += DT / (LAG + DT) * (demand.thrust - thrust);
            if ceiling < 0.9 {
                sink_rate += gains * DT;
            }
            let estimate = StateEstimate {
                height,
                velocity: Vec3::new(0.0, 0.0, sink_rate),
                specific_force: Vec3::new(0.0, 0.0, -GRAVITY * (1.0 - follows * (1.0 - thrust))),
                valid: Validity::ALL,
                ..Default::default()
            };
            let setpoint = Setpoint::default();
            let phase = if k < 200 { FlightPhase::Flying } else { FlightPhase::Landing };
            let input = flown(&estimate, phase, &setpoint, &demand);
            ceiling = manager.step(now, &input).thrust_ceiling;
            if sink_rate > config.descent + 0.1 {
                fast.get_or_insert(now);
            }
            if manager.stage().to_string() == "Landing/Blind" {
                return fast.map(|fast| now.since(fast).seconds());
            }
        }
        None
    };
    let blind_after = |sinks, follows, gains| blind_at(0.03, sinks, follows, gains);
    let after = blind_after(0.1, 0.45, 1.5);
    assert!(after.is_some_and(|seconds| seconds < 0.15), "{after:?}");
    assert_eq!(blind_after(0.1, 0.0, 1.5), None, "it stands, whatever its climb rate says");
    for sinks in [0.1, 0.35] {
        assert_eq!(blind_after(sinks, 0.45, 0.0), None, "it is not fast");
    }
    // A range that was too short by 0.3 m, and drag that carried nine tenths of the thrust that was gone.
    let after = blind_at(-0.01, 0.1, 0.1, 1.5);
    assert!(after.is_some_and(|seconds| seconds < 0.15), "{after:?}, from below the floor");
}

#[test]
fn a_selector_begins_without_a_mode() {
    assert_eq!(Selector::<Flight>::default(), Selector::new());
}

/// A manager that has been told this for so many steps, after a flight.
fn lands(manager: &mut TakeoffLanding, steps: u64, height: Option<f32>, sink_rate: f32) -> LandDetected {
    let valid = if height.is_some() { Validity::ALL } else { Validity::TILT | Validity::VELOCITY_Z };
    let estimate = StateEstimate {
        height: height.unwrap_or(9.0),
        velocity: Vec3::new(0.0, 0.0, sink_rate),
        specific_force: Vec3::new(0.0, 0.0, -GRAVITY),
        valid,
        ..Default::default()
    };
    let (setpoint, demand) = (Setpoint::default(), ControlOutput { thrust: 1.0, ..Default::default() });
    let input = flown(&estimate, FlightPhase::Landing, &setpoint, &demand);
    (0..steps).map(|k| manager.step(Instant::from_micros(2_500 * k), &input)).last().unwrap_or_default()
}

#[test]
fn the_nearer_the_ground_the_slower_it_descends() {
    for (height, rate) in [(Some(1.0), 0.3), (Some(0.3), 0.3), (Some(0.2), 0.25), (Some(0.1), 0.2), (None, 0.15)] {
        let mut manager = TakeoffLanding::new(LandingConfig::default());
        let asked = lands(&mut manager, 1, height, 0.2);
        assert!((asked.descent_rate - rate).abs() < 1e-6, "{height:?}: {}", asked.descent_rate);
        assert_eq!(asked.thrust_ceiling, f32::MAX);
    }
}

#[test]
fn the_ceiling_of_a_touch_down_falls_within_0_8_seconds() {
    for (steps, ceiling) in [(1, 1.0), (161, 0.8), (321, 0.6), (400, 0.6)] {
        let mut manager = TakeoffLanding::new(LandingConfig::default());
        let asked = lands(&mut manager, steps, Some(0.04), 0.1);
        assert!((asked.thrust_ceiling - ceiling).abs() < 1e-5, "{steps}: {}", asked.thrust_ceiling);
    }
}

#[test]
fn a_landing_that_does_not_sink_touches_something_after_a_second() {
    let stage = |steps, height, sink_rate| {
        let mut manager = TakeoffLanding::new(LandingConfig::default());
        lands(&mut manager, steps, height, sink_rate);
        manager.stage().to_string()
    };
    for height in [Some(0.2), Some(1.0), None] {
        assert_eq!(stage(403, height, 0.07), "Landing/Touchdown");
        assert_ne!(stage(400, height, 0.07), "Landing/Touchdown");
        assert_ne!(stage(800, height, 0.09), "Landing/Touchdown");
    }
}

/// Shares of hover thrust at these milliseconds, and when it counts as landed, with this answer of the weight test.
fn blind(breaks_off: bool, quick: super::weight::Support, millis: &[u64]) -> (Vec<f32>, Option<u64>) {
    let mut descent = super::blind::BlindDescent::new(Instant::ZERO, breaks_off);
    let weight = super::weight::Answers {
        quick,
        steady: super::weight::Support::Unknown,
        is_carried: false,
        is_struck: false,
        thrust: 0.0,
        force: 0.0,
    };
    let (mut shares, mut landed) = (vec![], None);
    for now in (0..20_000).step_by(5) {
        let (share, lands) = descent.step(Instant::from_millis(now), weight, Duration::from_millis(300));
        assert_eq!(share == 0.6, descent.is_testing() || lands);
        if millis.contains(&now) {
            shares.push(share);
        }
        if lands {
            landed.get_or_insert(now);
        }
    }
    (shares, landed)
}

#[test]
fn a_blind_descent_lacks_a_twentieth_of_its_thrust_and_looks_for_the_ground_every_0_9_seconds() {
    use super::weight::Support::{Falls, Stands, Unknown};
    let near = |shares: Vec<f32>, expected: &[f32]| {
        let all = shares.len() == expected.len() && shares.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(all, "{shares:?}, expected {expected:?}");
    };
    // A test that says nothing is over after 85 ms, one that says that it falls after 60 ms; the next begins 0.9 s after it began.
    let millis = [0, 895, 900, 955, 960, 980, 985, 1_795, 1_800, 5_000, 15_000];
    let (shares, landed) = blind(false, Unknown, &millis);
    near(shares, &[0.95, 0.94105, 0.6, 0.6, 0.6, 0.6, 0.94015, 0.93205, 0.6, 0.9, 0.88]);
    assert_eq!(landed, None);
    let (shares, landed) = blind(false, Falls, &millis);
    near(shares, &[0.95, 0.94105, 0.6, 0.6, 0.9404, 0.9402, 0.94015, 0.93205, 0.6, 0.9, 0.88]);
    assert_eq!(landed, None);
    let (shares, landed) = blind(false, Stands, &[960, 985, 1_255, 1_260]);
    near(shares, &[0.6; 4]);
    assert_eq!(landed, Some(1_260), "0.3 s after it could be seen");
    // What breaks off a take-off may climb.
    near(blind(true, Unknown, &[0, 395, 400]).0, &[0.87, 0.87, 0.946]);
}

/// Seconds until a take-off that is off the ground is complete: how far from its height, m, and speeds of path and vehicle, m/s.
fn complete(away: f32, path: f32, speed: f32) -> Option<f32> {
    let mut manager = TakeoffLanding::new(LandingConfig::default());
    let mut step = |k: u64, height: f32, speed: f32| {
        let estimate = StateEstimate {
            height,
            position: Vec3::new(0.0, 0.0, -height),
            velocity: Vec3::new(0.0, 0.0, speed),
            valid: Validity::ALL,
            ..Default::default()
        };
        let setpoint =
            Setpoint { position: Vec3::new(0.0, 0.0, -0.5), velocity: Vec3::new(0.0, 0.0, path), ..Default::default() };
        let demand = ControlOutput { thrust: 1.0, ..Default::default() };
        let input = flown(&estimate, FlightPhase::TakeOff, &setpoint, &demand);
        manager.step(Instant::from_micros(2_500 * k), &input)
    };
    assert!(!step(0, 0.03, 0.0).takeoff_complete);
    let found = (1..8_000).find(|k| step(*k, 0.5 - away, speed).takeoff_complete)?;
    assert!(step(found + 1, 0.5 - away, speed).takeoff_complete, "and stays so");
    Some((found - 1) as f32 * DT)
}

#[test]
fn a_take_off_is_complete_when_it_has_been_at_its_height_for_a_while_or_is_overdue_and_near_it() {
    let is = |found: Option<f32>, expected: f32| found.is_some_and(|found| (found - expected).abs() < 0.01);
    for (away, path, speed) in [(0.0, 0.0, 0.0), (0.055, 0.0, 0.0), (-0.055, -0.015, 0.0), (0.0, 0.015, -0.15)] {
        assert!(is(complete(away, path, speed), 0.4), "{away} m: {:?}", complete(away, path, speed));
    }
    for (away, path, speed) in [(0.065, 0.0, 0.0), (-0.11, 0.0, 0.0), (0.0, 0.025, 0.0), (0.0, 0.0, 0.17)] {
        assert!(is(complete(away, path, speed), 8.0), "{away} m: {:?}", complete(away, path, speed));
    }
    assert_eq!(complete(0.13, 0.0, 0.0), None, "something holds it");
}

#[test]
fn a_take_off_that_climbs_is_off_the_ground_whatever_its_height_says() {
    for (climb, stage) in [(0.15, "TakeOff/LiftOff"), (0.17, "TakeOff/Climb"), (-0.17, "TakeOff/LiftOff")] {
        let mut manager = TakeoffLanding::new(LandingConfig::default());
        let steps = [(FlightPhase::Armed, 0.03, 0.0), (FlightPhase::TakeOff, 0.03, -climb)];
        assert_eq!(stages(&mut manager, &steps, Validity::ALL)[1], stage, "{climb} m/s");
    }
}

/// Contact with the ground of a take-off at this share of the thrust that carries the weight, N, which neither height nor climb rate
/// shows, with these sensors.
fn contact(share: f32, hover_thrust: f32, sensors: SensorMask, millis: u64) -> GroundContact {
    let mut manager = TakeoffLanding::new(LandingConfig { hover_thrust, ..LandingConfig::default() });
    let estimate = StateEstimate { sensors, ..everything(0.0, 0.0, 0.0) };
    let mut contact = GroundContact::Ground;
    for now in (0..=millis).step_by(5) {
        let phase = if now == 0 { FlightPhase::Armed } else { FlightPhase::TakeOff };
        let thrust = if now == 0 { 0.0 } else { share * 0.36 };
        let (setpoint, demand) = (Setpoint::default(), ControlOutput { thrust, ..Default::default() });
        let input = flown(&estimate, phase, &setpoint, &demand);
        contact = manager.step(Instant::from_millis(now), &input).contact;
    }
    contact
}

#[test]
fn without_a_range_more_thrust_than_its_weight_lifts_a_vehicle() {
    let blind = SensorMask::IMU | SensorMask::BARO | SensorMask::FLOW;
    assert_eq!(contact(1.2, 0.36, blind, 1_000), GroundContact::Air);
    assert_eq!(contact(1.2, 0.36, blind, 200), GroundContact::Ground, "not at once");
    assert_eq!(contact(1.05, 0.36, blind, 3_000), GroundContact::Ground, "hover thrust is not known so well");
    assert_eq!(contact(1.2, 0.36, blind | SensorMask::TOF, 3_000), GroundContact::Ground, "a range would show it");
    assert_eq!(
        contact(1.2, LandingConfig::default().hover_thrust, blind, 3_000),
        GroundContact::Ground,
        "of an unknown airframe"
    );
}

/// Lands at a metre with this thrust, N, specific force upwards, m/s², and climb rate down, m/s, as long before. Has it landed within two
/// seconds?
fn lands_in_a_hand(hover_thrust: f32, thrust: f32, force: f32, sink_rate: Option<f32>) -> bool {
    let mut manager = TakeoffLanding::new(LandingConfig { hover_thrust, ..LandingConfig::default() });
    let estimate = StateEstimate {
        specific_force: Vec3::new(0.0, 0.0, -force),
        valid: Validity::ALL.set(Validity::VELOCITY_Z, sink_rate.is_some()),
        ..everything(1.0, -sink_rate.unwrap_or_default(), 0.0)
    };
    (0u64..1_600).any(|step| {
        let phase = if step < 800 { FlightPhase::Flying } else { FlightPhase::Landing };
        let (setpoint, demand) = (Setpoint::default(), ControlOutput { thrust, ..Default::default() });
        let input = flown(&estimate, phase, &setpoint, &demand);
        manager.step(Instant::from_micros(2_500 * step), &input).landed
    })
}

#[test]
fn what_a_hand_carried_before_the_landing_is_carried() {
    assert!(lands_in_a_hand(0.36, 0.15, GRAVITY, Some(0.0)));
    assert!(!lands_in_a_hand(f32::INFINITY, 0.15, GRAVITY, Some(0.0)), "nobody knows what carries it");
    assert!(!lands_in_a_hand(0.36, 0.25, GRAVITY, Some(0.0)), "a third lighter than it is said to be, it flies");
    assert!(
        !lands_in_a_hand(0.36, 0.15, GRAVITY, Some(0.2)),
        "nor is one carried that sinks, whatever its battery says"
    );
    assert!(!lands_in_a_hand(0.36, 0.15, GRAVITY, None), "or may sink");
    assert!(!lands_in_a_hand(0.36, 0.15, 0.42 * GRAVITY, Some(0.0)), "or falls");
}

/// Flies with more thrust asked for than its battery gives, N, and of that so much unmet, and then
/// comes down with 0.29 N in air that rises and carries the rest. Does it count as landed within
/// two seconds?
fn lands_in_rising_air(asked: f32, unmet: f32) -> bool {
    let mut manager = TakeoffLanding::new(LandingConfig { hover_thrust: 0.36, ..LandingConfig::default() });
    (0u64..1_600).any(|step| {
        let flies = step < 800;
        let (phase, sink_rate) = if flies { (FlightPhase::Flying, 0.0) } else { (FlightPhase::Landing, 0.3) };
        let estimate =
            StateEstimate { specific_force: Vec3::new(0.0, 0.0, -GRAVITY), ..everything(0.8, -sink_rate, 0.0) };
        let thrust = if flies { asked } else { 0.29 };
        let (setpoint, demand) = (Setpoint::default(), ControlOutput { thrust, ..Default::default() });
        let unmet = if flies { unmet } else { 0.0 };
        let input =
            LandingInput { felt: true, estimate: &estimate, phase, setpoint: &setpoint, demand: &demand, unmet };
        manager.step(Instant::from_micros(2_500 * step), &input).landed
    })
}

/// A climb on a tired battery asks for half as much again as it gets, and half of that is no little
/// thrust.
#[test]
fn thrust_that_the_motors_did_not_make_is_none_of_the_flight() {
    assert!(lands_in_rising_air(0.55, 0.0), "nearly half of its thrust is gone, and none of its force");
    assert!(!lands_in_rising_air(0.55, 0.29), "a quarter of it is");
    assert!(!lands_in_rising_air(0.39, 0.0), "as much");
    assert!(lands_in_rising_air(0.55, f32::NAN), "no share");
}

#[test]
fn thrust_is_taken_away_at_the_ground_alone() {
    for (height, testing) in [(Some(1.0), false), (Some(0.2), false), (None, false), (Some(0.04), true)] {
        let mut manager = TakeoffLanding::new(LandingConfig::default());
        lands(&mut manager, 1, height, 0.2);
        assert_eq!(manager.is_testing, testing, "{height:?}");
    }
}

/// It stands on one leg, and thrust turns it over.
#[test]
fn a_touch_that_is_felt_ends_the_ramp() {
    let config = LandingConfig::default();
    let ceilings = |push: f32| {
        let mut manager = TakeoffLanding::new(config);
        let mut ceiling = f32::MAX;
        let mut step = |k: u64| {
            let demand = ControlOutput { thrust: ceiling.min(1.0), ..Default::default() };
            let pushed = if (480..484).contains(&k) { push } else { 0.0 };
            let estimate = StateEstimate {
                height: 0.04,
                velocity: Vec3::new(0.0, 0.0, 0.1),
                specific_force: Vec3::new(0.0, 0.0, -GRAVITY * demand.thrust - pushed),
                valid: Validity::ALL,
                ..Default::default()
            };
            let phase = if k < 400 { FlightPhase::Flying } else { FlightPhase::Landing };
            let setpoint = Setpoint::default();
            let input = flown(&estimate, phase, &setpoint, &demand);
            ceiling = manager.step(Instant::from_micros(2_500 * k), &input).thrust_ceiling;
            ceiling
        };
        let last = |ceilings: core::ops::Range<u64>, step: &mut dyn FnMut(u64) -> f32| ceilings.map(step).last();
        [last(0..485, &mut step), last(485..501, &mut step)].map(Option::unwrap_or_default)
    };
    let [before, after] = ceilings(0.0);
    assert!(before > 0.85 && after > 0.85, "{before}, {after}");
    assert_eq!(ceilings(25.0), [config.ceiling_share; 2]);
}

/// The first ceiling of thrust of a landing after this phase, without height and climb rate.
#[test]
fn a_blind_landing_gives_up_more_thrust_when_it_breaks_off_a_take_off() {
    let first = |phase: FlightPhase| {
        let mut manager = TakeoffLanding::new(LandingConfig::default());
        let estimate = nothing(0.0, 0.0, 0.0);
        let (setpoint, demand) = (Setpoint::default(), ControlOutput { thrust: 1.0, ..Default::default() });
        let mut step = |k: u64, phase| {
            let input = flown(&estimate, phase, &setpoint, &demand);
            manager.step(Instant::from_micros(2_500 * k), &input).thrust_ceiling
        };
        step(0, phase);
        step(1, FlightPhase::Landing)
    };
    assert_eq!([FlightPhase::TakeOff, FlightPhase::Flying].map(first), [0.87, 0.95]);
}

/// The height says that it is up, and the estimate that it sinks as it is asked to.
#[test]
fn what_something_carries_has_landed_whatever_the_estimate_says() {
    let landed = |follows: bool| {
        let mut manager = TakeoffLanding::new(LandingConfig::default());
        (0..2_400u64).any(|k| {
            let share = 1.0 - 0.5 * (k.saturating_sub(400).min(800) as f32 / 800.0);
            let estimate = StateEstimate {
                height: 1.0,
                velocity: Vec3::new(0.0, 0.0, 0.3),
                specific_force: Vec3::new(0.0, 0.0, -GRAVITY * if follows { share } else { 1.0 }),
                valid: Validity::ALL,
                ..Default::default()
            };
            let (setpoint, demand) = (Setpoint::default(), ControlOutput { thrust: share, ..Default::default() });
            let phase = if k < 400 { FlightPhase::Flying } else { FlightPhase::Landing };
            let input = flown(&estimate, phase, &setpoint, &demand);
            manager.step(Instant::from_micros(2_500 * k), &input).landed
        })
    };
    assert!(landed(false) && !landed(true));
}
