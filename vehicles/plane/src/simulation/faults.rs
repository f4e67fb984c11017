//! What can go wrong in a flight of the aircraft, and where it acts.

use core::cell::Cell;
use stampfly_sim::World;
use stampfly_sim::fault::{Class, Distortion, Effect, Fault, FaultKind, Injector, Line, Measure};
use stampfly_sim::plant::{Aeroplane, RotorFault, Surface};
use stampfly_types::{Duration, Instant, Message};
use std::prelude::v1::*;
use std::rc::Rc;

/// Every fault.
pub const FAULTS: &[FaultKind] = &[
    FaultKind::plain("gnss-lost", Class::Landed, "The receiver has no fix."),
    FaultKind::plain("gnss-silent", Class::Landed, "The receiver says nothing."),
    FaultKind::plain("pitot-blocked", Class::Landed, "The pitot tube shows no pressure."),
    FaultKind::plain("pitot-silent", Class::Landed, "The pressure sensor of the pitot tube says nothing."),
    FaultKind::plain("mag-silent", Class::Degraded, "The compass says nothing."),
    FaultKind::plain("baro-silent", Class::Degraded, "The barometer says nothing."),
    FaultKind::plain("imu-silent", Class::Cut, "No inertial sample arrives."),
    FaultKind::number("gyro-bias", ("rad/s", 0.02, -0.5, 0.5), Class::Degraded, "The roll rate is too high by this.")
        .sized(Measure::EitherWay, [0.005, 0.5], "what a calibration leaves to half a radian a second, after a blow"),
    FaultKind::plain("link-lost", Class::Landed, "Nobody is heard."),
    FaultKind::plain("aileron-jammed", Class::Degraded, "The right aileron stays in its middle."),
    FaultKind::plain("imu-stuck", Class::Cut, "Inertial samples repeat the last one."),
    FaultKind::number(
        "accel-bias",
        ("m/s^2", 0.5, -30.0, 30.0),
        Class::Degraded,
        "The vertical acceleration is too high by this.",
    )
    .sized(Measure::EitherWay, [0.1, 10.0], "the data sheet's offset to one gravity, after a blow"),
    FaultKind::plain("propeller-lost", Class::Landed, "The propeller has no thrust."),
    FaultKind::number(
        "elevator-jammed",
        ("", 0.0, -1.0, 1.0),
        Class::Cut,
        "The elevator stays at this share of its deflection.",
    )
    .sized(Measure::EitherWay, [0.02, 1.0], "a servo's dead zone to its end"),
    FaultKind::number(
        "rudder-jammed",
        ("", 0.0, -1.0, 1.0),
        Class::Degraded,
        "The rudder, and the nose wheel with it, stay at this share of their deflection.",
    )
    .sized(Measure::EitherWay, [0.02, 1.0], "a servo's dead zone to its end"),
];

/// What is wrong in one flight.
#[derive(Clone)]
pub(super) struct Wrong {
    pub injector: Injector,
    /// Nothing gets through on the link.
    pub silent: Rc<Cell<bool>>,
}

impl Wrong {
    pub fn new(faults: &[Fault], start: Instant) -> Self {
        Self { injector: Injector::new(start, faults), silent: Rc::default() }
    }

    /// The way of a sensor's samples to the bus; the sensor's word is what its faults begin with.
    pub fn line<M: Message>(&self, sensor: &str, seed: u64) -> Line<M> {
        let effect = |fault: &Fault| {
            let value = fault.value.unwrap_or_default() as f32;
            let name = fault.kind.name;
            // Gyro and accelerometer are in the inertial sensor.
            let inside = ["gyro", "accel"].iter().find_map(|part| name.strip_prefix(part));
            let inside = inside.filter(|_| sensor == "imu");
            match name.strip_prefix(sensor).or(inside)? {
                "-stuck" => Some(Distortion::whole(Effect::Stuck)),
                "-bias" if name == "accel-bias" => Some(Distortion::of(&["accel[2]"], Effect::Add(value))),
                "-silent" => Some(Distortion::SILENT),
                "-lost" => Some(Distortion::of(&["fix"], Effect::Word(0))),
                "-blocked" => Some(Distortion::of(&["pressure"], Effect::Set(0.0))),
                "-bias" => Some(Distortion::of(&["gyro[0]"], Effect::Add(value))),
                _ => None,
            }
        };
        let acts = self.injector.faults().enumerate();
        let acts: Vec<_> = acts.filter_map(|(place, fault)| Some((place, effect(fault)?))).collect();
        Line::new(&self.injector, &acts, seed)
    }

    /// Switches what acts beside the bus on and off.
    pub fn act(&self, now: Instant, world: &World) {
        let mut silent = false;
        for (place, fault) in self.injector.faults().enumerate() {
            let active = self.injector.is_active(place, now);
            match fault.kind.name {
                "link-lost" => silent |= active,
                "aileron-jammed" | "elevator-jammed" | "rudder-jammed" => {
                    let at = active.then(|| fault.value.unwrap_or_default());
                    let surface = match fault.kind.name {
                        "elevator-jammed" => Surface::Elevator,
                        "rudder-jammed" => Surface::Rudder,
                        _ => Surface::RightAileron,
                    };
                    world.change(now, |plane: &mut Aeroplane| plane.jam(surface, at));
                }
                "propeller-lost" => {
                    let thrust = if active { 0.0 } else { 1.0 };
                    world.set_rotor_fault(now, 0, RotorFault { thrust, ..RotorFault::NONE });
                }
                _ => continue,
            }
            if active {
                self.injector.note_change(place);
            }
        }
        self.silent.set(silent);
    }
}

/// After a fault has begun there is this much time to land in: twice round the field, and some more.
pub(super) const PATIENCE: Duration = Duration::from_secs(900);
