//! The default controller beside the incremental one, on vehicles that are not as the airframe says.
//!
//! The figures of `docs/explain/controllers.md`:
//! `STAMPFLY_THOROUGH=1 cargo test --release -p stampfly-host --test host controllers -- --nocapture`.

use crate::thorough::thorough;
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::faults::FAULTS;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::Id;
use stampfly_flight::Observer;
use stampfly_flight::newest::message;
use stampfly_host::campaign::{self, Spread};
use stampfly_param::parameters;
use stampfly_sim::Truth;
use stampfly_sim::fault::Fault;
use stampfly_sim::vehicle::Witness;
use stampfly_types::messages::{ControlOutput, FlightPhase, FlightStatus};
use stampfly_types::{Instant, Vec3, frame};

/// What differs from the vehicle as it is built.
struct Case {
    name: &'static str,
    change: fn(&mut Setup),
    fault: Option<&'static str>,
}

const fn case(name: &'static str, change: fn(&mut Setup)) -> Case {
    Case { name, change, fault: None }
}

fn inertia(setup: &mut Setup, factor: f64) {
    let plant = &mut setup.simulation.plant;
    plant.inertia_x *= factor;
    plant.inertia_y *= factor;
    plant.inertia_z *= factor;
}

const CASES: [Case; 9] = [
    case("as built", |_| {}),
    case("gusts of 2 m/s", |setup| setup.simulation.wind.gust = 2.0),
    case("twice the vibration", |setup| setup.simulation.vibration *= 2.0),
    case("motor lag x0.5", |setup| setup.simulation.plant.rotor_inertia *= 0.5),
    case("motor lag x2", |setup| setup.simulation.plant.rotor_inertia *= 2.0),
    case("inertia -30 %", |setup| inertia(setup, 0.7)),
    case("inertia +30 %", |setup| inertia(setup, 1.3)),
    Case { name: "one motor at 80 %", change: |_| {}, fault: Some("motor-1-thrust=0.8@ground+100") },
    Case { name: "80 % from the hover on", change: |_| {}, fault: Some("motor-1-thrust=0.8@hover+100") },
];

/// What a flight says of the innermost loop: how fast the vehicle turned about roll and pitch, how far it leaned at most, and how
/// much the demanded torque changed from one period to the next.
#[derive(Default)]
struct Seen {
    flies: bool,
    turned: Mean,
    worked: Mean,
    torque: Option<Vec3>,
    tilt: f32,
}

#[derive(Clone, Copy, Default)]
struct Mean {
    sum: f64,
    count: u32,
}

impl Mean {
    fn add(&mut self, square: f32) {
        self.sum += f64::from(square);
        self.count += 1;
    }

    fn root(self) -> f64 {
        (self.sum / f64::from(self.count.max(1))).sqrt()
    }
}

impl Observer for Seen {}

impl Witness<Runnables> for Seen {
    fn published(&mut self, topic: usize, _: Instant, _: u32, words: &[u32]) {
        match Id::ALL.get(topic) {
            Some(Id::flight_status) => {
                self.flies = message::<FlightStatus>(words).is_some_and(|status| status.phase == FlightPhase::Flying);
            }
            Some(Id::control_output) if self.flies => {
                let torque = message::<ControlOutput>(words).map(|output| output.torque);
                if let (Some(now), Some(before)) = (torque, self.torque) {
                    self.worked.add((now - before).horizontal().norm_squared());
                }
                self.torque = torque;
            }
            _ => {}
        }
    }

    fn beside(&mut self, _: usize, _: Instant, _: u32, words: &[u32]) {
        if let Some(truth) = message::<Truth>(words).filter(|_| self.flies) {
            self.turned.add(truth.angular_rate.horizontal().norm_squared());
            self.tilt = self.tilt.max(frame::tilt(&truth.attitude));
        }
    }
}

/// Medians over the flights of one case: position error, m, root mean square of the rate, deg/s, and of the torque's change,
/// µN·m; the largest lean of all flights, deg.
fn fly(case: &Case, controller: f32) -> [f64; 4] {
    let setups: Vec<(u64, Setup)> = (1..=thorough(2, 6))
        .map(|seed| {
            let mut setup = Setup::reference(seed);
            (case.change)(&mut setup);
            setup.faults.extend(case.fault.map(|text| Fault::parse(text, FAULTS).expect("a fault")));
            parameters::set(&mut setup.vehicle, "controller.type", controller).expect("a parameter");
            (seed, setup)
        })
        .collect();
    let flights = campaign::run::<StampFly, Seen>(&setups, &|_, _| Seen::default(), &|_| {});
    for flight in &flights {
        let outcome = &flight.flown.outcome;
        assert!(
            outcome.finished && outcome.metrics.landed,
            "{}, controller {controller}, seed {}",
            case.name,
            flight.seed
        );
    }
    let middle =
        |figure: &dyn Fn(usize) -> f64| Spread::of((0..flights.len()).map(figure).collect()).expect("flights").p50;
    let tilts = flights.iter().map(|flight| f64::from(flight.witness.tilt.to_degrees()));
    [
        middle(&|place| flights[place].flown.outcome.metrics.pos_rms_m.expect("it flew")),
        middle(&|place| flights[place].witness.turned.root().to_degrees()),
        middle(&|place| flights[place].witness.worked.root() * 1e6),
        tilts.fold(0.0, f64::max),
    ]
}

#[test]
fn the_incremental_loop_beside_the_default_one() {
    println!(
        "| the vehicle | controller | position error, m | turns at, deg/s | torque changes by, µN·m | largest lean, deg |"
    );
    println!("|---|---|---|---|---|---|");
    for case in &CASES {
        let [usual, incremental] = [(0.0, "cascade"), (2.0, "incremental")].map(|(controller, name)| {
            let figures = fly(case, controller);
            let [position, turned, worked, tilt] = figures;
            println!("| {} | {name} | {position:.3} | {turned:.1} | {worked:.1} | {tilt:.1} |", case.name);
            figures
        });
        assert!(incremental[0] < 1.2 * usual[0] + 0.005, "{}: position", case.name);
        assert!(incremental[1] < 1.5 * usual[1], "{}: it turns more", case.name);
    }
}
