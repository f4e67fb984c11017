//! A model pilot who flies by sight: delayed observation and stick response.
//!
//! | part | purpose |
//! |---|---|
//! | [`Eye`] | true position, velocity and heading, 0.2 s old |
//! | [`Hand`] | controller from an observation and a target position to tilt, throttle and turn |
//! | [`Places`] | a mission of target positions as text |
//!
//! For vehicles that take stick input only. The vehicle's crate maps [`Wish`] to stick positions
//! and transmits them.

use crate::World;
use crate::time::Clock;
use core::cell::Cell;
use core::str::FromStr;
use stampfly_types::{Duration, GRAVITY, Instant, Vec3, frame};
use std::collections::VecDeque;

/// Period of observation.
pub const LOOK: Duration = Duration::from_millis(20);
/// Reaction time in looks: 0.2 s, a trained person's reaction to a visual stimulus.
const REACTION: usize = 10;
/// Speeds of climb, descent and travel, m/s.
const CLIMB: f32 = 0.5;
const SINK: f32 = 0.4;
/// Descent rate below [`LOW`], m/s.
const SETS_DOWN: f32 = 0.2;
const LOW: f32 = 0.3;
const SPEED: f32 = 1.0;
/// Integrator gains for the tilt and throttle that hold a position: 1/s of tilt per metre, and
/// throttle per m/s and look.
const LEARNS_LEAN: f32 = 0.02;
const LEARNS_THROTTLE: f32 = 0.001;
/// Horizontal and vertical distance within which a position is reached, m.
const REACHED: [f32; 2] = [0.5, 0.3];
/// Time after which a position that was not reached is skipped.
const LONGEST_LEG: Duration = Duration::from_secs(30);
/// Largest tilt command, in units of gravity.
const LEAN: f32 = 0.4;

/// One observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// World NED, relative to the start, m.
    pub position: Vec3,
    /// World NED, m/s.
    pub velocity: Vec3,
    /// Heading, rad.
    pub yaw: f32,
    /// Tilt: horizontal direction of the thrust, forward and right, in units of gravity.
    pub lean: [f32; 2],
    /// Contact with the ground.
    pub contact: bool,
}

/// An observer of the vehicle with a reaction time.
///
/// ```
/// use stampfly_sim::sight::Eye;
/// use stampfly_sim::{Simulation, SimulationConfig};
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let mut eye = Eye::new(&simulation.world, simulation.clock.now());
/// assert_eq!(eye.look(simulation.clock.now()).position.norm(), 0.0, "where it stands");
/// ```
#[derive(Clone, Debug)]
pub struct Eye {
    world: World,
    spot: Vec3,
    past: VecDeque<Seen>,
}

impl Eye {
    /// Starts to observe. Positions are relative to the vehicle's present position.
    #[must_use]
    pub fn new(world: &World, now: Instant) -> Self {
        Self { world: world.clone(), spot: world.truth_at(now).position, past: VecDeque::new() }
    }

    /// Observes the vehicle and returns the observation of ten looks ago (the present one until
    /// there are ten). Call it every [`LOOK`].
    pub fn look(&mut self, now: Instant) -> Seen {
        let truth = self.world.truth_at(now);
        let yaw = frame::yaw(&truth.attitude);
        // The thrust axis in the horizontal frame of the heading: its horizontal part is the tilt.
        let up = frame::from_yaw(-yaw) * (truth.attitude * Vec3::new(0.0, 0.0, -1.0));
        let seen = Seen {
            position: truth.position - self.spot,
            velocity: truth.velocity,
            yaw,
            lean: [up.x, up.y],
            contact: truth.contact,
        };
        self.past.push_back(seen);
        if self.past.len() > REACTION { self.past.pop_front().unwrap_or(seen) } else { seen }
    }
}

/// Stick response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wish {
    /// Tilt forward and to the right, in units of gravity.
    pub lean: [f32; 2],
    /// Throttle relative to hover, as a share of the full range.
    pub throttle: f32,
    /// Angle to turn clockwise, rad.
    pub turn: f32,
}

/// The pilot's controller: proportional control of position and velocity, with learned hover
/// throttle and trim.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hand {
    throttle: f32,
    lean: [f32; 2],
}

impl Hand {
    /// One control step toward `place`, or down to the ground there if `sinks`, facing north. Call
    /// it every [`LOOK`].
    pub fn steer(&mut self, seen: &Seen, place: Vec3, sinks: bool) -> Wish {
        // Errors in the vehicle's heading frame, in which the sticks act.
        let ahead = frame::from_yaw(-seen.yaw);
        let (error, velocity) = (ahead * (place - seen.position), ahead * seen.velocity);
        let limit = |value: f32, most: f32| value.clamp(-most, most);
        for (learned, error) in self.lean.iter_mut().zip([error.x, error.y]) {
            *learned = limit(*learned + LEARNS_LEAN * LOOK.seconds() * limit(error, 0.5), 0.3);
        }
        let axes = [(error.x, velocity.x, self.lean[0]), (error.y, velocity.y, self.lean[1])];
        // Velocity damping of 2 1/s: two fifths of what the reaction time allows.
        let lean = axes.map(|(error, velocity, learned)| {
            limit(2.0 * (limit(0.7 * error, SPEED) - velocity) / GRAVITY + learned, LEAN)
        });
        let sink = if -seen.position.z < LOW { SETS_DOWN } else { SINK };
        let climb = if sinks { -sink } else { limit(-0.8 * error.z, CLIMB) };
        // World z points down: `velocity.z` is the sink rate, so this is the error of the climb
        // rate.
        let wrong = climb + velocity.z;
        self.throttle = limit(self.throttle + LEARNS_THROTTLE * wrong, 0.2);
        Wish { lean, throttle: self.throttle + 0.12 * wrong, turn: -seen.yaw }
    }
}

/// Positions to fly to in order: take off toward the first, land at the last.
///
/// ```
/// use stampfly_sim::sight::Places;
/// let places: Places = "0,0,1.5,2; 3,0,1.5,0".parse()?;
/// assert_eq!(places.0[1].place.to_array(), [3.0, 0.0, -1.5]);
/// assert!("0,0,1.5".parse::<Places>().is_err() && "0,0,-1,0".parse::<Places>().is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Places(pub Vec<Leg>);

/// A position and the time to stay there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// World NED, relative to the start, m.
    pub place: Vec3,
    /// Time to stay, s.
    pub stay: f32,
}

/// Progress of a mission, shared with an observer.
#[derive(Debug, Default)]
pub struct Progress {
    /// Legs flown.
    pub legs: Cell<usize>,
    /// Holding a position in the air.
    pub stays: Cell<bool>,
    /// The mission is over.
    pub finished: Cell<bool>,
}

impl Places {
    /// Flies to each position in order, stays there, and lands at the last. `steer` observes, moves
    /// the sticks toward a position (or, with `true`, down to the ground there) and waits for the
    /// next [look](LOOK).
    pub async fn fly(&self, clock: &Clock, progress: &Progress, steer: &mut impl AsyncFnMut(Vec3, bool) -> Seen) {
        let mut last = Vec3::zeros();
        for Leg { place, stay } in &self.0 {
            last = *place;
            let began = clock.now();
            loop {
                let away = steer(last, false).await.position - last;
                let there = away.horizontal().norm() < REACHED[0] && away.z.abs() < REACHED[1];
                if there || clock.now().since(began) > LONGEST_LEG {
                    break;
                }
            }
            progress.stays.set(true);
            let until = clock.now() + Duration::from_seconds(*stay);
            while clock.now() < until {
                steer(last, false).await;
            }
            progress.stays.set(false);
            progress.legs.set(progress.legs.get() + 1);
        }
        while !steer(last, true).await.contact {}
    }
}

impl FromStr for Places {
    type Err = String;

    /// Reads `north,east,up,seconds`, in metres, separated by semicolons.
    fn from_str(text: &str) -> Result<Self, String> {
        let leg = |text: &str| {
            let numbers: Result<Vec<f32>, _> = text.split(',').map(|number| number.trim().parse()).collect();
            match numbers.as_deref() {
                Ok(&[north, east, up, stay])
                    if [north, east].iter().all(|m| m.abs() <= 100.0)
                        && (0.3..=50.0).contains(&up)
                        && (0.0..=600.0).contains(&stay) =>
                {
                    Ok(Leg { place: Vec3::new(north, east, -up), stay })
                }
                _ => Err(format!("'{}' is not north,east,up,seconds", text.trim())),
            }
        };
        let legs = text.split(';').filter(|leg| !leg.trim().is_empty()).map(leg);
        let legs = legs.collect::<Result<Vec<_>, _>>()?;
        if legs.is_empty() { Err("it has no place to fly to".into()) } else { Ok(Self(legs)) }
    }
}
