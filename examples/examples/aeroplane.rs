//! Two circuits of an aeroplane: take-off, cruising, landing, taxiing, and again. Prints each stage as it begins.
//!
//! The modes are in `plane/`, one file each, with the table of which follows which. What flies is a point; the numbers are those
//! of a foam aeroplane of 1.5 kg.

mod plane;

use plane::Seen;
use plane::geometry::{Point, Runway};
use plane::model::Motion;
use plane::path_manager::PathManager;
use stampfly_mode::stage::{Duration, Instant};
use stampfly_types::math;

const STEP: Duration = Duration::from_millis(20);
/// Altitude of the field, m.
const FIELD: f32 = 30.0;
const START: Point = Point { north: 0.0, east: 0.0, altitude: FIELD };
/// rad.
const HEADING: f32 = 0.6;

/// A flight as it goes on.
struct Flight {
    now: Instant,
    motion: Motion,
    manager: PathManager,
    runway: Runway,
    route: [Point; 4],
    /// Without one, positions are unknown.
    has_fix: bool,
}

impl Flight {
    fn new() -> Self {
        let runway = Runway { threshold: START, stopping: START.ahead(HEADING, 200.0), heading: HEADING };
        // A circuit to the left: ahead, across, back, and across again, 60 m above the field.
        let [ahead, left] = [HEADING, HEADING - core::f32::consts::FRAC_PI_2];
        let corner = |along, aside| Point { altitude: FIELD + 60.0, ..START.ahead(ahead, along).ahead(left, aside) };
        Self {
            now: Instant::ZERO,
            motion: Motion {
                position: START,
                airspeed: 0.0,
                heading: HEADING,
                path: 0.0,
                bank: 0.0,
                on_ground: true,
                field: FIELD,
                // From aside: it drifts for as long as its nose is straight, from 5 m to the ground.
                wind: [0.3, -0.4],
            },
            manager: PathManager::new(),
            runway,
            route: [corner(600.0, 0.0), corner(600.0, 400.0), corner(-900.0, 400.0), corner(-900.0, 100.0)],
            has_fix: true,
        }
    }

    /// One cycle of the path manager, and what the aeroplane makes of it.
    fn step(&mut self, cleared: bool) {
        let motion = &self.motion;
        let last = self.route[self.route.len() - 1];
        let seen = Seen {
            runway: &self.runway,
            route: &self.route,
            begin_landing: motion.position.distance(last) < 70.0,
            cleared,
            position: self.has_fix.then_some(motion.position),
            altitude: motion.position.altitude,
            airspeed: motion.airspeed,
            track: motion.track(),
            on_ground: motion.on_ground,
        };
        let controls = self.manager.cycle(self.now, &seen, motion);
        self.motion.step(&controls, STEP.seconds());
        self.now += STEP;
    }

    /// Flies until it is in this place.
    #[cfg(test)]
    fn reach(&mut self, place: &str) {
        let limit = self.now + Duration::from_secs(900);
        while self.place() != place {
            self.step(true);
            assert!(self.now < limit, "in {} instead of {place}, {:?}", self.place(), self.motion);
        }
    }

    fn place(&self) -> String {
        self.manager.selector.to_string()
    }
}

/// Flies until the aeroplane has taxied back for this number of times, and hands every new stage to `tell`.
fn fly(landings: u32, mut tell: impl FnMut(&Flight, &str)) -> Flight {
    let (mut flight, mut before) = (Flight::new(), String::new());
    while flight.now < Instant::from_secs(3_600) {
        let done = flight.manager.selector.active().map_or(0, |active| active.mode().landings);
        flight.step(done < landings);
        let place = flight.place();
        if place != before {
            tell(&flight, &place);
            if done == landings && place == "Taxiing/Hold" {
                break;
            }
            before = place;
        }
    }
    flight
}

fn main() {
    println!("{:>8}  {:<19} {:>7} {:>7} {:>8} {:>7}", "time", "stage", "along", "aside", "height", "speed");
    fly(2, |flight, place| {
        let here = flight.motion.position;
        let (sin, cos) = math::sin_cos(START.direction(here) - HEADING);
        println!(
            "{:>6.1} s  {place:<19} {:>5.0} m {:>5.0} m {:>6.1} m {:>3.0} m/s",
            flight.now.seconds_f64(),
            // Plus zero: no minus zero.
            (START.distance(here) * cos).round() + 0.0,
            (START.distance(here) * sin).round() + 0.0,
            here.altitude - FIELD,
            flight.motion.airspeed
        );
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use plane::path_manager::State;

    const CIRCUIT: [&str; 11] = [
        "TakeOff/Roll",
        "TakeOff/Climb",
        "Cruising/Cruise",
        "Landing/Transition",
        "Landing/Slope",
        "Landing/Flare",
        "Landing/Decrab",
        "Landing/Touchdown",
        "Taxiing/Return",
        "Taxiing/LineUp",
        "Taxiing/Hold",
    ];

    #[test]
    fn the_second_circuit_is_as_complete_as_the_first() {
        let mut places = Vec::new();
        let flight = fly(2, |_, place| places.push(place.to_owned()));
        assert_eq!(places, [CIRCUIT, CIRCUIT].concat());
        assert!(flight.motion.position.distance(START) < 10.0 && flight.motion.on_ground);
    }

    #[test]
    fn it_comes_down_on_the_slope_and_gently_on_the_runway() {
        let (mut flight, mut sink_rate, mut off_slope) = (Flight::new(), 0.0f32, 0.0f32);
        while flight.place() != "Taxiing/Return" {
            let before = flight.motion;
            flight.step(true);
            if flight.place() == "Landing/Touchdown" && flight.motion.on_ground && !before.on_ground {
                sink_rate = -before.airspeed * math::sin(before.path);
                let aside = math::sin(START.direction(before.position) - HEADING) * START.distance(before.position);
                assert!(aside.abs() < 10.0, "{aside} m beside the middle");
            }
            if flight.place() == "Landing/Slope" && flight.motion.position.altitude < FIELD + 40.0 {
                let slope = plane::geometry::Slope::to(&flight.runway, FIELD + 60.0);
                off_slope =
                    off_slope.max((slope.altitude(flight.motion.position) - flight.motion.position.altitude).abs());
            }
            assert!(flight.now < Instant::from_secs(600));
        }
        assert!(sink_rate > 0.0 && sink_rate < 1.0, "{sink_rate} m/s");
        assert!(off_slope < 3.0, "{off_slope} m");
    }

    /// Where it goes in this time when something outside changes its motion before every step.
    fn disturbed(flight: &mut Flight, seconds: u64, disturb: impl Fn(&mut Motion)) -> Vec<String> {
        let (mut places, end) = (vec![flight.place()], flight.now + Duration::from_secs(seconds));
        while flight.now < end {
            disturb(&mut flight.motion);
            flight.step(true);
            if places.last() != Some(&flight.place()) {
                places.push(flight.place());
            }
        }
        places
    }

    #[test]
    fn a_landing_that_floats_goes_round() {
        let mut flight = Flight::new();
        flight.reach("Landing/Flare");
        let held = flight.motion;
        // A wind from below holds it up, at its speed.
        let places = disturbed(&mut flight, 22, |motion| {
            (motion.position.altitude, motion.airspeed) = (held.position.altitude, held.airspeed);
        });
        assert_eq!(places, ["Landing/Flare", "TakeOff/Climb"], "fast enough, it does not roll");
    }

    #[test]
    fn a_take_off_that_does_not_climb_lands() {
        let mut flight = Flight::new();
        flight.reach("TakeOff/Climb");
        let places = disturbed(&mut flight, 61, |motion| motion.position.altitude = FIELD + 20.0);
        assert_eq!(places, ["TakeOff/Climb", "Landing/Transition"]);
    }

    #[test]
    fn an_aeroplane_that_does_not_move_is_parked() {
        let mut flight = Flight::new();
        flight.step(true);
        let places = disturbed(&mut flight, 700, |motion| motion.airspeed = 0.0);
        assert_eq!(places, ["TakeOff/Roll", "Taxiing/Return", "Taxiing/Park"]);
    }

    #[test]
    fn a_mode_without_its_position_fails_and_the_path_manager_notices() {
        let mut flight = Flight::new();
        flight.reach("Cruising/Cruise");
        flight.has_fix = false;
        flight.step(true);
        assert!(flight.manager.selector.is_error());
        assert_eq!(flight.manager.state, State::FatalFailure);
    }
}
