//! What can go wrong in a flight of the quadcopter, and where it acts.

use core::cell::Cell;
use stampfly_sim::World;
use stampfly_sim::chips::Air;
use stampfly_sim::fault::{Class, Distortion, Effect, Fault, FaultKind, Injector, Line, Measure};
use stampfly_sim::plant::{Beyond, Motion, Plant, RotorFault, Scene};
use stampfly_types::messages::ImuData;
use stampfly_types::{Duration, Instant};
use std::prelude::v1::*;

/// Every fault. It has one inertial sensor and a pilot who sees it: what takes either away ends the flight.
pub const FAULTS: &[FaultKind] = &[
    FaultKind::plain("imu-silent", Class::Cut, "No inertial sample arrives."),
    FaultKind::number("gyro-bias", ("rad/s", 0.1, -1.0, 1.0), Class::Degraded, "The roll rate is too high by this.")
        .sized(Measure::EitherWay, [0.01, 1.0], "what a calibration leaves to a fifteenth of the range, after a blow"),
    FaultKind::number(
        "accel-bias",
        ("m/s^2", 1.0, -5.0, 5.0),
        Class::Degraded,
        "The forward acceleration is too high by this.",
    )
    .sized(Measure::EitherWay, [0.1, 5.0], "the data sheet's offset to half a gravity, after a blow"),
    FaultKind::plain("link-lost", Class::Cut, "No packet arrives."),
    // With six of ten lost, ten running are lost about once a second, and a tenth of a second is a
    // pilot's reaction.
    FaultKind::number("link-loss", ("", 0.3, 0.0, 1.0), Class::Transparent, "This share of packets is lost.")
        .sized(Measure::Number, [0.01, 1.0], "a quiet room to one in which nothing gets through")
        .above(0.6, Class::Cut),
    // With less than half of a rotor the others cannot hold it level.
    FaultKind::number(
        "motor-weak",
        ("", 0.2, 0.0, 1.0),
        Class::Degraded,
        "The first motor's propeller lacks this share of its thrust.",
    )
    .sized(Measure::Number, [0.02, 1.0], "a nick in a blade to a propeller that has come off")
    .above(0.5, Class::Cut),
    FaultKind::plain("imu-stuck", Class::Cut, "Inertial samples repeat the last one."),
    FaultKind::number(
        "motor-stuck",
        ("", 1.0, 0.0, 1.0),
        Class::Cut,
        "The first motor turns at this duty whatever is commanded.",
    )
    .sized(Measure::Number, [0.05, 1.0], "a controller that drags to one that no longer listens"),
    FaultKind::number("wall", ("m", 0.4, 0.1, 10.0), Class::Cut, "There is a wall this far ahead of the vehicle.")
        .sized(Measure::Number, [0.1, 3.0], "just beside the propellers to as far as a mission goes"),
    FaultKind::number("ceiling", ("m", 0.2, 0.05, 10.0), Class::Cut, "There is a ceiling this far above the vehicle.")
        .sized(Measure::Number, [0.05, 2.0], "just above it to more than a mission climbs"),
    FaultKind::number(
        "slope",
        ("", 0.2, -1.0, 1.0),
        Class::Degraded,
        "The floor rises by this for each metre to the north.",
    )
    .sized(Measure::EitherWay, [0.02, 0.35], "a meadow to 20 deg, on which it does not stand"),
];

/// The plant's rotor that is the document's first motor.
const FIRST: usize = 1;

/// What is wrong in one flight.
#[derive(Clone)]
pub(super) struct Wrong {
    pub injector: Injector,
    /// What the transmitter's packets go through.
    pub air: Air,
    /// Steps in which an obstacle pushed, at the last look.
    strikes: Cell<u64>,
}

impl Wrong {
    pub fn new(faults: &[Fault], start: Instant, air: Air) -> Self {
        Self { injector: Injector::new(start, faults), air, strikes: Cell::default() }
    }

    /// The way of inertial samples to the bus.
    pub fn imu(&self, seed: u64) -> Line<ImuData> {
        let effect = |fault: &Fault| {
            let value = fault.value.unwrap_or_default() as f32;
            match fault.kind.name {
                "imu-silent" => Some(Distortion::SILENT),
                "imu-stuck" => Some(Distortion::whole(Effect::Stuck)),
                "gyro-bias" => Some(Distortion::of(&["gyro[0]"], Effect::Add(value))),
                "accel-bias" => Some(Distortion::of(&["accel[0]"], Effect::Add(value))),
                _ => None,
            }
        };
        let acts = self.injector.faults().enumerate();
        let acts: Vec<_> = acts.filter_map(|(place, fault)| Some((place, effect(fault)?))).collect();
        Line::new(&self.injector, &acts, seed)
    }

    /// Switches what acts beside the bus on and off.
    pub fn act(&self, now: Instant, world: &World) {
        let mut loss = 0.0f64;
        let strikes = world.inspect_as(|plant: &Plant| plant.ground().strikes()).unwrap_or_default();
        let struck = strikes > self.strikes.replace(strikes);
        for (place, fault) in self.injector.faults().enumerate() {
            let (active, value) = (self.injector.is_active(place, now), fault.value.unwrap_or_default());
            match fault.kind.name {
                "link-lost" if active => loss = 1.0,
                "link-loss" if active => loss = loss.max(value),
                "motor-weak" => {
                    let fault = if active { RotorFault { thrust: 1.0 - value, duty: None } } else { RotorFault::NONE };
                    world.set_rotor_fault(now, FIRST, fault);
                }
                "motor-stuck" => {
                    let fault = RotorFault { duty: active.then_some(value), ..RotorFault::NONE };
                    world.set_rotor_fault(now, FIRST, fault);
                }
                "wall" | "ceiling" | "slope" => {
                    world.change_scene(now, |scene, motion| {
                        put(scene, motion, fault.kind.name, active.then_some(value))
                    });
                    // What nothing runs into changes nothing.
                    if active && !struck && fault.kind.name != "slope" {
                        continue;
                    }
                }
                _ => continue,
            }
            if active {
                self.injector.note_change(place);
            }
        }
        self.air.set_loss(loss);
    }
}

/// Puts something where the vehicle is, or takes it away; what is there stays.
fn put(scene: &mut Scene, motion: &Motion, name: &str, value: Option<f64>) {
    match (name, value) {
        ("wall", Some(distance)) => scene.wall = scene.wall.or_else(|| Some(Beyond::ahead_of(motion, distance))),
        ("wall", None) => scene.wall = None,
        ("ceiling", Some(above)) => scene.ceiling = scene.ceiling.or(Some(above - motion.position.z)),
        ("ceiling", None) => scene.ceiling = None,
        (_, Some(rise)) if scene.slope == [0.0; 2] => {
            (scene.slope, scene.pivot) = ([rise, 0.0], [motion.position.x, motion.position.y]);
        }
        (_, None) => scene.slope = [0.0; 2],
        _ => {}
    }
}

/// After a fault has begun there is this much time to land in: the longest mission, and some more.
pub(super) const PATIENCE: Duration = Duration::from_secs(90);
