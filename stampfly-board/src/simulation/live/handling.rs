//! What somebody does to the simulated vehicle with their hands: holds it some way, turns it round, warms it.
//!
//! Lines that begin with `world` at any command line of the vehicle. They are no commands of the vehicle, which knows nothing of
//! them: its sensors show them. For calibrations; in flight a hand is a fault.

use core::f64::consts::{FRAC_PI_2, PI, TAU};
use core::fmt::Write as _;
use stampfly_sim::plant::{Hand, Plant, Pose};
use stampfly_sim::{Specimen, World};
use stampfly_types::{Duration, Instant, frame};
use std::cell::RefCell;
use std::string::String;
use std::vec::Vec;

/// How it can be held, with roll and pitch, rad.
const HOLDS: [(&str, [f64; 2]); 6] = [
    ("level", [0.0, 0.0]),
    ("nose-down", [0.0, -FRAC_PI_2]),
    ("tail-down", [0.0, FRAC_PI_2]),
    ("right-down", [FRAC_PI_2, 0.0]),
    ("left-down", [-FRAC_PI_2, 0.0]),
    ("upside-down", [PI, 0.0]),
];
const USAGE: &str = "usage: world hold level|nose-down|tail-down|right-down|left-down|upside-down | turn [SECONDS] | down | \
                     warm KELVINS [SECONDS] | truth";
/// A hand holds it so high above the floor, m.
const HEIGHT: f64 = 0.25;
/// A hand takes so long to get anywhere.
const CARRY: Duration = Duration::from_secs(1);
/// To turn through every attitude.
const TURN: f32 = 40.0;
/// To warm up.
const WARM: f32 = 60.0;
/// No longer than this, s.
const LONGEST: f32 = 3600.0;
/// Turns about the nose while that sweeps once.
const ROLLS: f64 = 11.0;

/// A hand, and what it does.
#[derive(Clone, Debug)]
enum Doing {
    Nothing,
    Carries { from: Hand, to: Hand, begun: Instant, lets_go: bool },
    Turns { place: [f64; 3], begun: Instant, length: f64, before: Hand },
}

/// Whoever stands beside the vehicle.
#[derive(Debug)]
pub struct Handling {
    world: World,
    /// Height of a vehicle that stands, m.
    standing: f64,
    doing: RefCell<Doing>,
}

impl Handling {
    pub fn new(world: &World) -> Self {
        let height = |plant: &Plant| -Pose::standing(plant.parameters(), 0.0).position.z;
        let standing = world.inspect_as(height).unwrap_or_default();
        Self { world: world.clone(), standing, doing: RefCell::new(Doing::Nothing) }
    }

    /// Does what is asked behind the word `world`, and says so.
    pub fn obey(&self, now: Instant, line: &str) -> String {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let number = |word: &str, bound: f32| word.parse().ok().filter(|value: &f32| value.abs() <= bound);
        match words[..] {
            ["hold", how] => {
                let Some((_, [roll, pitch])) = HOLDS.iter().find(|(name, _)| *name == how) else { return USAGE.into() };
                let place = self.place(now, HEIGHT);
                self.carry(now, Hand::new(place, [*roll, *pitch, 0.0]), false);
                std::format!("a hand holds it {how}")
            }
            ["down"] => {
                let place = self.place(now, self.standing);
                self.carry(now, Hand::new(place, [0.0; 3]), true);
                "it is put down".into()
            }
            ["turn"] => self.turn(now, TURN),
            ["turn", seconds] => match number(seconds, LONGEST).filter(|seconds| *seconds >= 10.0) {
                Some(seconds) => self.turn(now, seconds),
                None => USAGE.into(),
            },
            ["warm", kelvins] => self.warm(now, number(kelvins, 50.0), Some(WARM)),
            ["warm", kelvins, seconds] => self.warm(now, number(kelvins, 50.0), number(seconds, LONGEST)),
            ["truth"] => truth(&self.world.specimen(), &self.world, now),
            _ => USAGE.into(),
        }
    }

    /// Above where it is.
    fn place(&self, now: Instant, height: f64) -> [f64; 3] {
        let at = self.world.motion_at(now).position;
        [at.x, at.y, -height]
    }

    /// Where the hand is; where the vehicle is, before there is one.
    fn hand(&self, now: Instant) -> Hand {
        let motion = self.world.motion_at(now);
        let free = Hand { position: motion.position, attitude: motion.attitude };
        self.doing.borrow().at(now).map_or(free, |(hand, _)| hand)
    }

    fn carry(&self, now: Instant, to: Hand, lets_go: bool) {
        let from = self.hand(now);
        self.doing.replace(Doing::Carries { from, to, begun: now, lets_go });
    }

    fn turn(&self, now: Instant, seconds: f32) -> String {
        let (before, place) = (self.hand(now), self.place(now, HEIGHT));
        self.doing.replace(Doing::Turns { place, begun: now, length: seconds.into(), before });
        std::format!("a hand turns it through every attitude, for {seconds} s")
    }

    fn warm(&self, now: Instant, kelvins: Option<f32>, seconds: Option<f32>) -> String {
        let (Some(kelvins), Some(seconds)) = (kelvins, seconds.filter(|seconds| *seconds >= 0.0)) else {
            return USAGE.into();
        };
        self.world.warm(now, kelvins.into(), Duration::from_seconds(seconds));
        std::format!("it is {kelvins} K warmer than by itself in {seconds} s")
    }

    /// Moves the hand on.
    pub fn poll(&self, now: Instant) {
        let Some((hand, is_over)) = self.doing.borrow().at(now) else { return };
        self.world.change_scene(now, |scene, _| scene.hand = Some(hand));
        if is_over {
            self.doing.replace(Doing::Nothing);
            self.world.change_scene(now, |scene, _| scene.hand = None);
        }
    }
}

impl Doing {
    /// Where the hand is, and whether it lets go now. `None` without a hand.
    fn at(&self, now: Instant) -> Option<(Hand, bool)> {
        match self {
            Self::Nothing => None,
            Self::Carries { from, to, begun, lets_go } => {
                let share = now.since(*begun).seconds_f64() / CARRY.seconds_f64();
                // It stands for a moment before the hand lets go.
                Some((from.toward(to, share), *lets_go && share > 1.5))
            }
            Self::Turns { place, begun, length, before } => {
                let seconds = now.since(*begun).seconds_f64();
                let share = (seconds / length).min(1.0);
                // The nose goes over half a circle and a bit, so that it points along the field and against it whatever its dip,
                // and the vehicle rolls about it all the while.
                let pitch = -1.2 + (PI + 0.8) * share;
                let hand = Hand::new(*place, [TAU * ROLLS * share, pitch, 0.0]);
                Some((before.toward(&hand, seconds / CARRY.seconds_f64()), false))
            }
        }
    }
}

/// What nobody on the vehicle sees: what is wrong with its sensors, its attitude, its temperature.
fn truth(specimen: &Specimen, world: &World, now: Instant) -> String {
    let mut text = String::new();
    let mut line = |name: &str, numbers: &[f64]| {
        _ = write!(text, "{name}");
        numbers.iter().for_each(|number| _ = write!(text, " {number:.6}"));
        text.push_str("\r\n");
    };
    line("accel_bias", specimen.accel_bias.as_slice());
    line("accel_gain", specimen.accel_matrix.diagonal().as_slice());
    line("accel_drift", specimen.accel_drift.as_slice());
    line("gyro_bias", specimen.gyro_bias.as_slice());
    line("gyro_drift", specimen.gyro_drift.as_slice());
    line("hard_iron", specimen.hard_iron.as_slice());
    let iron = &specimen.soft_iron;
    line("soft_iron", &[iron.m11, iron.m22, iron.m33, iron.m12, iron.m13, iron.m23]);
    let truth = world.truth_at(now);
    line("attitude", &frame::roll_pitch_yaw(&truth.attitude).map(f64::from));
    line("warmth", &[world.warmth_at(now)]);
    text.truncate(text.trim_end().len());
    text
}
