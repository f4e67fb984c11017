//! A person who flies by sight: what they see, late, and what their hands do about it.
//!
//! | part | what it is |
//! |---|---|
//! | [`Eye`] | where the vehicle really is, 0.2 s ago |
//! | [`Hand`] | from there to a place: which way to lean, how much throttle, which way to turn |
//! | [`Places`] | a mission in places, as text, and how it is flown |
//!
//! For vehicles that are flown by sticks alone. What the sticks mean, and how they travel to the vehicle, is the vehicle's matter.

use crate::World;
use crate::time::Clock;
use core::cell::Cell;
use core::str::FromStr;
use stampfly_types::{Duration, GRAVITY, Instant, Vec3, frame};
use std::collections::VecDeque;

/// Between two looks.
pub const LOOK: Duration = Duration::from_millis(20);
/// Looks until a pilot reacts: 0.2 s, a trained person's reaction to what is seen.
const REACTION: usize = 10;
/// How fast a person climbs, sinks and travels, m/s.
const CLIMB: f32 = 0.5;
const SINK: f32 = 0.4;
/// And how fast the last bit, m, to set it down.
const SETS_DOWN: f32 = 0.2;
const LOW: f32 = 0.3;
const SPEED: f32 = 1.0;
/// How fast the lean and the throttle that stay over a place are learned.
const LEARNS_LEAN: f32 = 0.02;
const LEARNS_THROTTLE: f32 = 0.001;
/// A place is reached within these distances, m: beside and above.
const REACHED: [f32; 2] = [0.5, 0.3];
/// A place that is not reached in this time is given up.
const LONGEST_LEG: Duration = Duration::from_secs(30);
/// Nobody leans further, in units of gravity.
const LEAN: f32 = 0.4;

/// What was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// World NED, from where it stood, m.
    pub position: Vec3,
    /// World NED, m/s.
    pub velocity: Vec3,
    /// Heading, rad.
    pub yaw: f32,
    /// Where the thrust pushes it, forward and right, in units of gravity.
    pub lean: [f32; 2],
    /// It touches something.
    pub contact: bool,
}

/// Somebody who looks at the vehicle.
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
    /// From now on. Positions count from where the vehicle stands now.
    #[must_use]
    pub fn new(world: &World, now: Instant) -> Self {
        Self { world: world.clone(), spot: world.truth_at(now).position, past: VecDeque::new() }
    }

    /// Looks. Call it once in [`LOOK`]: what is seen is ten looks old.
    pub fn look(&mut self, now: Instant) -> Seen {
        let truth = self.world.truth_at(now);
        let yaw = frame::yaw(&truth.attitude);
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

/// What the hands want.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wish {
    /// Lean forward and to the right, in units of gravity.
    pub lean: [f32; 2],
    /// Throttle beside the one that hovers, a share.
    pub throttle: f32,
    /// How far to turn clockwise, rad.
    pub turn: f32,
}

/// Somebody's hands, and what they have learned.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hand {
    throttle: f32,
    lean: [f32; 2],
}

impl Hand {
    /// To this place, or down to the ground below it, facing north.
    pub fn steer(&mut self, seen: &Seen, place: Vec3, sinks: bool) -> Wish {
        let ahead = frame::from_yaw(-seen.yaw);
        let (error, velocity) = (ahead * (place - seen.position), ahead * seen.velocity);
        let limit = |value: f32, most: f32| value.clamp(-most, most);
        for (learned, error) in self.lean.iter_mut().zip([error.x, error.y]) {
            *learned = limit(*learned + LEARNS_LEAN * LOOK.seconds() * limit(error, 0.5), 0.3);
        }
        let axes = [(error.x, velocity.x, self.lean[0]), (error.y, velocity.y, self.lean[1])];
        // 2 1/s of damping: two fifths of what the reaction time would bear.
        let lean = axes.map(|(error, velocity, learned)| {
            limit(2.0 * (limit(0.7 * error, SPEED) - velocity) / GRAVITY + learned, LEAN)
        });
        let sink = if -seen.position.z < LOW { SETS_DOWN } else { SINK };
        let climb = if sinks { -sink } else { limit(-0.8 * error.z, CLIMB) };
        let wrong = climb + velocity.z;
        self.throttle = limit(self.throttle + LEARNS_THROTTLE * wrong, 0.2);
        Wish { lean, throttle: self.throttle + 0.12 * wrong, turn: -seen.yaw }
    }
}

/// Places to fly to one after another: take off to the first, land at the last.
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

/// A place, and how long to stay there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// World NED, from where it stood, m.
    pub place: Vec3,
    /// s.
    pub stay: f32,
}

/// What a mission has come to, for whoever watches.
#[derive(Debug, Default)]
pub struct Progress {
    /// Legs that were flown.
    pub legs: Cell<usize>,
    /// Is it at a place, flying?
    pub stays: Cell<bool>,
    /// It is over.
    pub finished: Cell<bool>,
}

impl Places {
    /// Flies to one place after the other, stays there, and lands. `steer` looks, moves the sticks towards a place, or down to the ground there, and waits for
    /// the next [look](LOOK).
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
