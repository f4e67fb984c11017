//! What can go wrong in a flight of the quadcopter, and where it acts.

use stampfly_sim::World;
use stampfly_sim::chips::Air;
use stampfly_sim::fault::{Class, Distortion, Effect, Fault, FaultKind, Injector, Line};
use stampfly_sim::plant::RotorFault;
use stampfly_types::messages::ImuData;
use stampfly_types::{Duration, Instant};
use std::prelude::v1::*;

/// Every fault. It has one inertial sensor and a pilot who sees it: what takes either away ends the flight.
pub const FAULTS: &[FaultKind] = &[
    FaultKind::plain("imu-silent", Class::Cut, "No inertial sample arrives."),
    FaultKind::number("gyro-bias", ("rad/s", 0.1, -1.0, 1.0), Class::Degraded, "The roll rate is too high by this."),
    FaultKind::number(
        "accel-bias",
        ("m/s^2", 1.0, -5.0, 5.0),
        Class::Degraded,
        "The forward acceleration is too high by this.",
    ),
    FaultKind::plain("link-lost", Class::Cut, "No packet arrives."),
    FaultKind::number("link-loss", ("", 0.3, 0.0, 1.0), Class::Transparent, "This share of packets is lost."),
    FaultKind::number(
        "motor-weak",
        ("", 0.2, 0.0, 1.0),
        Class::Degraded,
        "The first motor's propeller lacks this share of its thrust.",
    ),
];

/// What is wrong in one flight.
#[derive(Clone)]
pub(super) struct Wrong {
    pub injector: Injector,
    /// What the transmitter's packets go through.
    pub air: Air,
}

impl Wrong {
    pub fn new(faults: &[Fault], start: Instant, air: Air) -> Self {
        Self { injector: Injector::new(start, faults), air }
    }

    /// The way of inertial samples to the bus.
    pub fn imu(&self, seed: u64) -> Line<ImuData> {
        let effect = |fault: &Fault| {
            let value = fault.value.unwrap_or_default() as f32;
            match fault.kind.name {
                "imu-silent" => Some(Distortion::SILENT),
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
        for (place, fault) in self.injector.faults().enumerate() {
            let (active, value) = (self.injector.is_active(place, now), fault.value.unwrap_or_default());
            match fault.kind.name {
                "link-lost" if active => loss = 1.0,
                "link-loss" if active => loss = loss.max(value),
                // The document's first motor is the plant's second.
                "motor-weak" => {
                    let fault = if active { RotorFault { thrust: 1.0 - value, duty: None } } else { RotorFault::NONE };
                    world.set_rotor_fault(now, 1, fault);
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

/// After a fault has begun there is this much time to land in: the longest mission, and some more.
pub(super) const PATIENCE: Duration = Duration::from_secs(90);
