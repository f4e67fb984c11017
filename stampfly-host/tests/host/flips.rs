//! Turning over, in every direction and on many seeds: once round, back to its height and its place, without an alert, and down
//! again as after any flight.
//!
//! The figures of `docs/explain/controllers.md`:
//! `STAMPFLY_THOROUGH=1 cargo test --release -p stampfly-host --test host flips -- --nocapture`.

use crate::thorough::thorough;
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::Id;
use stampfly_flight::Observer;
use stampfly_flight::newest::message;
use stampfly_host::campaign;
use stampfly_param::parameters;
use stampfly_sim::Truth;
use stampfly_sim::vehicle::Witness;
use stampfly_types::messages::{Alerts, FlightPhase, FlightStatus, StateEstimate, SystemAlert};
use stampfly_types::{Duration, Instant, Vec3};

const WAYS: [&str; 4] = ["left", "right", "forward", "back"];
/// Above the floor, m.
const HEIGHT: f32 = 1.5;

/// What happened from the beginning of the flip on.
#[derive(Default)]
struct Seen {
    phase: FlightPhase,
    /// Of the flip, and since when the vehicle has flown on.
    began: Option<Instant>,
    ended: Option<Instant>,
    /// Turned through about roll and pitch, rad, and the truth of the step before.
    turned: [f32; 2],
    last: Option<Instant>,
    start: Vec3,
    /// Highest above where it began, lowest below, and farthest beside it, m.
    above: f32,
    below: f32,
    beside: f32,
    /// From the place where it began, three seconds after the flip, and of the estimate from the truth, m.
    left: Option<[f32; 2]>,
    /// Attitude of the estimate against the truth's tilt just after the flip, rad.
    tilt_error: f32,
    position: Vec3,
    upright: Vec3,
    alerts: Alerts,
}

impl Observer for Seen {}

impl Witness<Runnables> for Seen {
    fn published(&mut self, topic: usize, at: Instant, _: u32, words: &[u32]) {
        match Id::ALL.get(topic) {
            Some(Id::flight_status) => {
                let Some(FlightStatus { phase, .. }) = message(words) else { return };
                if phase == FlightPhase::Flip && self.phase != phase {
                    self.began = Some(at);
                }
                if self.phase == FlightPhase::Flip && self.phase != phase {
                    self.ended = Some(at);
                }
                self.phase = phase;
            }
            Some(Id::system_alert) if self.began.is_some() => {
                self.alerts |= message::<SystemAlert>(words).map_or(Alerts::ALL, |alert| alert.active);
            }
            Some(Id::estimate_state) => {
                if let Some(estimate) = message::<StateEstimate>(words) {
                    self.position = estimate.position;
                    self.upright = estimate.attitude * Vec3::z();
                }
            }
            _ => {}
        }
    }

    fn beside(&mut self, _: usize, at: Instant, _: u32, words: &[u32]) {
        let Some(truth) = message::<Truth>(words) else { return };
        if self.began.is_none() {
            self.start = truth.position;
            return;
        }
        let away = truth.position - self.start;
        if self.left.is_none() {
            self.above = self.above.max(-away.z);
            self.below = self.below.max(away.z);
            self.beside = self.beside.max(away.horizontal().norm());
        }
        if let Some(ended) = self.ended {
            if at.since(ended) < Duration::from_millis(100) {
                self.tilt_error = self
                    .tilt_error
                    .max(nalgebra::Vector3::from(truth.attitude * Vec3::z()).angle(&self.upright.into()));
            }
            if at.since(ended) >= Duration::from_secs(3) && self.left.is_none() {
                self.left = Some([away.norm(), (truth.position - self.position).horizontal().norm()]);
            }
        } else {
            let dt = self.last.map_or(0.0, |last| at.since(last).seconds());
            self.turned[0] += truth.angular_rate.x * dt;
            self.turned[1] += truth.angular_rate.y * dt;
        }
        self.last = Some(at);
    }
}

fn setup(seed: u64, mission: &str, controller: f32) -> Setup {
    let mission = Mission::parse(mission).expect("a mission");
    let mut setup = Setup { mission, ..Setup::reference(seed) };
    parameters::set(&mut setup.vehicle, "controller.type", controller).expect("a parameter");
    setup
}

#[test]
fn in_every_direction() {
    println!(
        "| way | lasts, s | above, m | below, m | beside, m | 3 s later from its place, m | position error, m | tilt error, deg |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for way in WAYS {
        let mission = format!("arm; takeoff {HEIGHT}; hover 2; flip {way}; hover 5; land");
        let setups: Vec<_> = (1..=thorough(4, 20)).map(|seed| (seed, setup(seed, &mission, 0.0))).collect();
        let flights = campaign::run::<StampFly, Seen>(&setups, &|_, _| Seen::default(), &|_| {});
        let mut worst = [0.0f32; 7];
        for flight in &flights {
            let (seen, seed) = (&flight.witness, flight.seed);
            let (began, ended) = (seen.began.expect("it begins"), seen.ended.expect("it ends"));
            let [left, error] = seen.left.expect("it flies on");
            let lasts = ended.since(began).seconds();
            let figures = [lasts, seen.above, seen.below, seen.beside, left, error, seen.tilt_error.to_degrees()];
            worst.iter_mut().zip(figures).for_each(|(worst, figure)| *worst = worst.max(figure));
            let once = core::f32::consts::TAU;
            let expected = match way {
                "left" => [-once, 0.0],
                "right" => [once, 0.0],
                "forward" => [0.0, -once],
                _ => [0.0, once],
            };
            for (turned, expected) in seen.turned.iter().zip(expected) {
                assert!((turned - expected).abs() < 0.8, "{way}, seed {seed}: turned {:?}", seen.turned);
            }
            assert!(flight.succeeded(), "{way}, seed {seed}");
            assert_eq!(seen.alerts, Alerts::NONE, "{way}, seed {seed}: {:?}", seen.alerts.names().collect::<Vec<_>>());
        }
        let [lasts, above, below, beside, left, error, tilt] = worst;
        println!("| {way} | {lasts:.2} | {above:.2} | {below:.2} | {beside:.2} | {left:.2} | {error:.2} | {tilt:.1} |");
        assert!(lasts < 2.5 && above < 1.0 && below < 0.7 && beside < 1.0 && left < 0.5, "{way}: {worst:?}");
    }
}

/// What speaks against it leaves the vehicle where it is, and the flight goes on.
#[test]
fn too_low_it_stays_as_it_is() {
    let mission = "arm; takeoff 0.5; hover 2; flip left; hover 2; land";
    let flights = campaign::run::<StampFly, Seen>(&[(1, setup(1, mission, 0.0))], &|_, _| Seen::default(), &|_| {});
    assert!(flights[0].succeeded() && flights[0].witness.began.is_none());
}

#[test]
fn with_every_controller() {
    for controller in [1.0, 2.0] {
        let mission = "arm; takeoff 1.5; hover 2; flip right; hover 5; flip back; hover 4; land";
        let setups: Vec<_> = (1..=thorough(2, 4)).map(|seed| (seed, setup(seed, mission, controller))).collect();
        for flight in campaign::run::<StampFly, Seen>(&setups, &|_, _| Seen::default(), &|_| {}) {
            let seen = &flight.witness;
            assert!(flight.succeeded() && seen.ended.is_some(), "controller {controller}, seed {}", flight.seed);
            assert_eq!(seen.alerts, Alerts::NONE, "controller {controller}, seed {}", flight.seed);
        }
    }
}
