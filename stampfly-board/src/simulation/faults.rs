//! What can go wrong in a flight of the StampFly: the table of faults, and where each acts.
//!
//! `stampfly faults` and `docs/faults.md` print the table. Sensor faults act on samples on their way to the bus, behind
//! models and behind drivers alike; a dead bus also silences emulated chips; motor faults act on the plant.

use crate::messages::TelemetryFrame;
use stampfly_bus::Band;
use stampfly_sim::World;
use stampfly_sim::chips::{AttachedChips, Faults};
use stampfly_sim::fault::{Class, Distortion, Effect, Fault, FaultKind, Injector, Line};
use stampfly_sim::plant::{Beyond, Hand, Motion, RotorFault, Scene};
use stampfly_types::Instant;
use stampfly_types::messages::{BaroData, FlowData, GuidedCommand, ImuData, MagData, PilotInput, PowerData, TofData};
use std::vec;
use std::vec::Vec;

use Class::{Cut, Degraded, Landed, Transparent};

const fn plain(name: &'static str, expected: Class, meaning: &'static str) -> FaultKind {
    FaultKind::plain(name, expected, meaning)
}

const fn number(
    name: &'static str,
    value: (&'static str, f64, f64, f64),
    expected: Class,
    meaning: &'static str,
) -> FaultKind {
    FaultKind::number(name, value, expected, meaning)
}

/// A motor's faults.
const fn thrust(name: &'static str) -> FaultKind {
    number(name, ("", 0.5, 0.0, 1.0), Cut, "The motor's propeller has this share of its thrust, and all of its drag.")
}

const fn on(name: &'static str) -> FaultKind {
    number(name, ("", 1.0, 0.0, 1.0), Cut, "The motor turns at this duty whatever is commanded.")
}

/// Every fault. Units are SI; axes are the body's.
pub const FAULTS: &[FaultKind] = &[
    plain("imu-silent", Cut, "No inertial sample arrives."),
    plain("imu-stuck", Cut, "Inertial samples repeat the last one."),
    plain("imu-zero", Cut, "Inertial samples are zero."),
    plain("imu-nan", Cut, "Inertial samples are no numbers."),
    number("imu-scale", ("", 0.5, 0.0, 2.0), Cut, "Rates and accelerations are this many times as large."),
    number(
        "imu-garbage",
        ("samples", 2.0, 1.0, 400.0),
        Degraded,
        "So many inertial samples are at the negative end of the range.",
    ),
    plain("gyro-stuck", Cut, "Rates repeat the last ones."),
    plain("gyro-zero", Cut, "Rates are zero."),
    number("gyro-bias", ("rad/s", 1.0, -35.0, 35.0), Landed, "The roll rate is too high by this."),
    number("gyro-spikes", ("rad/s", 20.0, 0.0, 35.0), Cut, "One rate in twenty is off by this."),
    plain("accel-stuck", Cut, "Accelerations repeat the last ones."),
    plain("accel-zero", Cut, "Accelerations are zero."),
    number("accel-bias", ("m/s^2", 2.0, -80.0, 80.0), Degraded, "The vertical acceleration is too high by this."),
    plain("tof-silent", Degraded, "No range arrives."),
    FaultKind::or_last(
        "tof-stuck",
        ("m", 0.0, 10.0),
        Degraded,
        "The range stays at this, or at the last one, as valid as before.",
    ),
    number("tof-bias", ("m", -0.3, -10.0, 10.0), Degraded, "The range is too long by this."),
    number("tof-scale", ("", 0.5, 0.0, 10.0), Degraded, "The range is this many times as long."),
    number("tof-alias", ("m", 0.25, 0.01, 10.0), Degraded, "The range wraps around at this."),
    number("tof-outliers", ("", 0.3, 0.0, 1.0), Degraded, "This share of ranges is 0.03 m."),
    plain("flow-silent", Landed, "No flow sample arrives."),
    plain("flow-stuck", Landed, "Flow repeats the last sample."),
    plain("flow-zero", Landed, "Flow is zero, with good quality."),
    plain("flow-reversed", Landed, "Flow has the opposite sign."),
    plain("flow-swapped", Landed, "Forward and right flow change places."),
    number("flow-bias", ("rad", 0.02, -1.0, 1.0), Landed, "Forward flow is too high by this in every sample."),
    plain("floor-dark", Landed, "The flow sensor sees no features and says so."),
    number("floor-moves", ("m/s", 0.3, -3.0, 3.0), Landed, "The floor moves north at this speed."),
    number("slope", ("", 0.2, -2.0, 2.0), Degraded, "The floor rises by this for each metre to the north."),
    number("edge", ("m", 0.7, -0.5, 3.0), Degraded, "From 0.3 m ahead on, the floor is lower by this."),
    number("ceiling", ("m", 0.2, 0.02, 10.0), Cut, "There is a ceiling this far above the vehicle."),
    number("wall", ("m", 0.4, 0.05, 10.0), Cut, "There is a wall this far ahead of the vehicle."),
    plain("hand", Landed, "A hand holds the vehicle where it is."),
    plain("baro-silent", Transparent, "No pressure arrives."),
    plain("baro-stuck", Transparent, "Pressure repeats the last sample."),
    number("baro-step", ("m", 3.0, -1000.0, 1000.0), Transparent, "The barometric altitude jumps up by this."),
    number("mag-bent", ("uT", 100.0, -2000.0, 2000.0), Transparent, "A magnet adds this field, to the right."),
    plain("power-silent", Landed, "No sample of the battery monitor arrives."),
    number("power-volts", ("V", 2.55, 0.0, 10.0), Landed, "The battery monitor reports this voltage."),
    plain("i2c-dead", Landed, "The I2C bus is dead: no range, pressure, field and battery voltage."),
    plain("spi-dead", Cut, "The SPI bus is dead: no inertial sample and no flow."),
    thrust("motor-1-thrust"),
    on("motor-1-stuck"),
    thrust("motor-2-thrust"),
    on("motor-2-stuck"),
    thrust("motor-3-thrust"),
    on("motor-3-stuck"),
    thrust("motor-4-thrust"),
    on("motor-4-stuck"),
    plain("link-lost", Landed, "The radio is silent in both directions."),
    number(
        "link-flap",
        ("s", 2.9, 0.1, 60.0),
        Landed,
        "The radio is silent for this long, works for 0.2 s, and so on.",
    ),
    plain("pilot-nan", Landed, "The pilot's sticks are no numbers."),
    number("stall", ("ms", 20.0, 0.0, 10_000.0), Degraded, "The flight band does not run for this long.")
        .above(24.0, Cut),
    plain("starve", Landed, "The background band does not run."),
];

/// Where a fault acts, and how.
#[derive(Clone, Copy, Debug)]
enum Act {
    Imu(Distortion),
    Tof(Distortion),
    Flow(Distortion),
    Mag(Distortion),
    Baro(Distortion),
    Power(Distortion),
    /// Sticks only.
    Pilot(Distortion),
    /// Both directions, pilot and program.
    Link(Effect),
    /// The chips on a bus do not answer: only where there are chips.
    Bus(fn(&AttachedChips) -> Vec<&stampfly_sim::chips::Attached>),
    Rotor(usize, RotorFault),
    Scene(Thing),
    HoldUp(Band, Option<f64>),
}

/// What stands in the way.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Thing {
    Edge(f64),
    Slope(f64),
    FloorVelocity(f64),
    Ceiling(f64),
    Wall(f64),
    Hand,
}

impl Thing {
    /// Puts it there, relative to the vehicle, or takes it away.
    fn put(self, scene: &mut Scene, motion: &Motion, there: bool) {
        match self {
            Self::Edge(drop) => scene.edge = there.then(|| (Beyond::ahead_of(motion, EDGE_AHEAD), drop)),
            Self::Slope(rise) => {
                scene.slope = if there { [rise, 0.0] } else { [0.0; 2] };
                scene.pivot = [motion.position.x, motion.position.y];
            }
            Self::FloorVelocity(north) => scene.floor_velocity = if there { [north, 0.0] } else { [0.0; 2] },
            Self::Ceiling(above) => scene.ceiling = there.then(|| above - motion.position.z),
            Self::Wall(ahead) => scene.wall = there.then(|| Beyond::ahead_of(motion, ahead)),
            Self::Hand => {
                scene.hand = there.then_some(Hand { position: motion.position, attitude: motion.attitude });
            }
        }
    }
}

/// How far ahead an edge is, m: no vehicle of this size stands on it.
const EDGE_AHEAD: f64 = 0.3;

const GYRO: &[&str] = &["gyro"];
const ACCEL: &[&str] = &["accel"];
const IMU: &[&str] = &["accel", "gyro"];
const RANGE: &[&str] = &["distance"];
const FLOW: &[&str] = &["delta_x", "delta_y"];

/// What a fault does. Empty only for a name that is not in the table.
fn acts(fault: &Fault) -> Vec<Act> {
    let value = fault.value.unwrap_or_default();
    let number = value as f32;
    let imu = |fields, effect| vec![Act::Imu(Distortion::of(fields, effect))];
    let tof = |effect| vec![Act::Tof(Distortion::of(RANGE, effect))];
    let flow = |effect| vec![Act::Flow(Distortion::of(FLOW, effect))];
    let silent = Distortion::SILENT;
    match fault.kind.name {
        "imu-silent" => vec![Act::Imu(silent)],
        "imu-stuck" => imu(IMU, Effect::Stuck),
        "imu-zero" => imu(IMU, Effect::Set(0.0)),
        "imu-nan" => imu(IMU, Effect::Set(f32::NAN)),
        "imu-scale" => imu(IMU, Effect::Scale(number)),
        // Ranges of the BMI270 as the driver sets them: 8 g and 2000 °/s.
        "imu-garbage" => vec![
            Act::Imu(Distortion::of(ACCEL, Effect::Set(-78.453)).for_samples(value as u32)),
            Act::Imu(Distortion::of(GYRO, Effect::Set(-34.907)).for_samples(value as u32)),
        ],
        "gyro-stuck" => imu(GYRO, Effect::Stuck),
        "gyro-zero" => imu(GYRO, Effect::Set(0.0)),
        "gyro-bias" => imu(&["gyro[0]"], Effect::Add(number)),
        "gyro-spikes" => imu(GYRO, Effect::Spikes { share: 0.05, size: number }),
        "accel-stuck" => imu(ACCEL, Effect::Stuck),
        "accel-zero" => imu(ACCEL, Effect::Set(0.0)),
        "accel-bias" => imu(&["accel[2]"], Effect::Add(number)),
        "tof-silent" => vec![Act::Tof(silent)],
        // A range that is given is vouched for: that is what the fault is about.
        "tof-stuck" => match fault.value {
            Some(_) => vec![
                Act::Tof(Distortion::of(RANGE, Effect::Set(number))),
                Act::Tof(Distortion::of(&["status"], Effect::Word(0))),
                Act::Tof(Distortion::of(&["valid"], Effect::Word(1))),
            ],
            None => vec![Act::Tof(Distortion::whole(Effect::Stuck))],
        },
        "tof-bias" => tof(Effect::Add(number)),
        "tof-scale" => tof(Effect::Scale(number)),
        "tof-alias" => tof(Effect::Wrap(number)),
        "tof-outliers" => tof(Effect::Outliers { share: value, value: 0.03 }),
        "flow-silent" => vec![Act::Flow(silent)],
        "flow-stuck" => vec![Act::Flow(Distortion::whole(Effect::Stuck))],
        "flow-zero" => flow(Effect::Set(0.0)),
        "flow-reversed" => flow(Effect::Scale(-1.0)),
        "flow-swapped" => flow(Effect::Swap),
        "flow-bias" => vec![Act::Flow(Distortion::of(&["delta_x"], Effect::Add(number)))],
        "floor-dark" => vec![
            Act::Flow(Distortion::of(FLOW, Effect::Set(0.0))),
            Act::Flow(Distortion::of(&["quality", "valid"], Effect::Word(0))),
        ],
        "floor-moves" => vec![Act::Scene(Thing::FloorVelocity(value))],
        "slope" => vec![Act::Scene(Thing::Slope(value))],
        "edge" => vec![Act::Scene(Thing::Edge(value))],
        "ceiling" => vec![Act::Scene(Thing::Ceiling(value))],
        "wall" => vec![Act::Scene(Thing::Wall(value))],
        "hand" => vec![Act::Scene(Thing::Hand)],
        "baro-silent" => vec![Act::Baro(silent)],
        "baro-stuck" => vec![Act::Baro(Distortion::whole(Effect::Stuck))],
        // 12 Pa a metre at sea level.
        "baro-step" => vec![
            Act::Baro(Distortion::of(&["altitude"], Effect::Add(number))),
            Act::Baro(Distortion::of(&["pressure"], Effect::Add(-12.0 * number))),
        ],
        "mag-bent" => vec![Act::Mag(Distortion::of(&["field[1]"], Effect::Add(number)))],
        "power-silent" => vec![Act::Power(silent)],
        "power-volts" => vec![Act::Power(Distortion::of(&["voltage"], Effect::Set(number)))],
        "i2c-dead" => vec![
            Act::Tof(silent),
            Act::Mag(silent),
            Act::Baro(silent),
            Act::Power(silent),
            Act::Bus(|chips| vec![&chips.tof, &chips.tof_front, &chips.mag, &chips.baro, &chips.power]),
        ],
        "spi-dead" => vec![Act::Imu(silent), Act::Flow(silent), Act::Bus(|chips| vec![&chips.imu, &chips.flow])],
        "link-lost" => vec![Act::Link(Effect::Silent)],
        "link-flap" => vec![Act::Link(Effect::Gaps { off: value, on: 0.2 })],
        "pilot-nan" => vec![Act::Pilot(Distortion::whole(Effect::Set(f32::NAN)))],
        "stall" => vec![Act::HoldUp(Band::Flight, Some(1e-3 * value))],
        "starve" => vec![Act::HoldUp(Band::Background, None)],
        motor => motor_fault(motor, value).into_iter().collect(),
    }
}

/// `motor-N-thrust`, `motor-N-stuck`.
fn motor_fault(name: &str, value: f64) -> Option<Act> {
    let (number, what) = name.strip_prefix("motor-")?.split_once('-')?;
    let rotor = number.parse::<usize>().ok()?.checked_sub(1)?;
    let fault = match what {
        "thrust" => RotorFault { thrust: value, ..RotorFault::NONE },
        "stuck" => RotorFault { duty: Some(value), ..RotorFault::NONE },
        _ => return None,
    };
    Some(Act::Rotor(rotor, fault))
}

/// The edges between sensors and bus.
pub(super) struct SensorLines {
    pub imu: Line<ImuData>,
    pub tof: Line<TofData>,
    pub flow: Line<FlowData>,
    pub mag: Line<MagData>,
    pub baro: Line<BaroData>,
    pub power: Line<PowerData>,
}

/// The radio.
pub(super) struct RadioLines {
    pub pilot: Line<PilotInput>,
    pub guided: Line<GuidedCommand>,
    pub telemetry: Line<TelemetryFrame>,
}

/// What is wrong in one flight, and where it acts.
pub(super) struct Wrong {
    pub injector: Injector,
    acts: Vec<(usize, Act)>,
    seed: u64,
    /// Which acts beside the bus were in force at the last look.
    in_force: Vec<bool>,
    /// Steps in which an obstacle pushed, at the last look.
    strikes: u64,
}

impl Wrong {
    /// These faults, in a flight with this start and seed.
    pub fn new(faults: &[Fault], start: Instant, seed: u64) -> Self {
        let acts: Vec<_> = faults
            .iter()
            .enumerate()
            .flat_map(|(place, fault)| acts(fault).into_iter().map(move |act| (place, act)))
            .collect();
        Self { injector: Injector::new(start, faults), in_force: vec![false; acts.len()], strikes: 0, acts, seed }
    }

    fn line<M: stampfly_types::Message>(&self, on_it: impl Fn(&Act) -> Option<Distortion>) -> Line<M> {
        let distortions: Vec<_> = self.acts.iter().filter_map(|(place, act)| Some((*place, on_it(act)?))).collect();
        Line::new(&self.injector, &distortions, self.seed)
    }

    pub fn sensor_lines(&self) -> SensorLines {
        macro_rules! on {
            ($Edge:ident) => {
                self.line(|act| if let Act::$Edge(distortion) = act { Some(*distortion) } else { None })
            };
        }
        SensorLines { imu: on!(Imu), tof: on!(Tof), flow: on!(Flow), mag: on!(Mag), baro: on!(Baro), power: on!(Power) }
    }

    pub fn radio_lines(&self) -> RadioLines {
        let link = |act: &Act| if let Act::Link(effect) = act { Some(Distortion::whole(*effect)) } else { None };
        let pilot = |act: &Act| if let Act::Pilot(distortion) = act { Some(*distortion) } else { link(act) };
        RadioLines { pilot: self.line(pilot), guided: self.line(link), telemetry: self.line(link) }
    }

    /// Switches what acts beside the bus on and off. Call it every turn.
    pub fn act(&mut self, now: Instant, world: &World, chips: Option<&AttachedChips>) {
        let strikes = world.inspect(|plant| plant.ground().strikes());
        let struck = strikes > self.strikes;
        self.strikes = strikes;
        for ((place, act), in_force) in self.acts.iter().zip(&mut self.in_force) {
            let active = self.injector.is_active(*place, now);
            let is_obstacle = matches!(act, Act::Scene(Thing::Ceiling(_) | Thing::Wall(_)));
            if struck && is_obstacle {
                self.injector.note_change(*place);
            }
            if active == *in_force {
                continue;
            }
            *in_force = active;
            match act {
                Act::Rotor(rotor, fault) => {
                    world.set_rotor_fault(now, *rotor, if active { *fault } else { RotorFault::NONE });
                }
                Act::Scene(thing) => world.change_scene(now, |scene, motion| thing.put(scene, motion, active)),
                Act::Bus(attached) => {
                    let Some(chips) = chips else { continue };
                    let faults = Faults { dead: active, ..Faults::default() };
                    attached(chips).into_iter().for_each(|chip| chip.set_faults(faults));
                }
                _ => continue,
            }
            if active && !is_obstacle {
                self.injector.note_change(*place);
            }
        }
    }

    /// Is this band's processor held up?
    pub fn is_held_up(&self, band: Band, now: Instant) -> bool {
        let mut held_up = false;
        for (place, act) in &self.acts {
            let Act::HoldUp(which, seconds) = act else { continue };
            let since = self.injector.begins(*place).filter(|_| *which == band && self.injector.is_active(*place, now));
            if since.is_some_and(|begun| seconds.is_none_or(|seconds| now.since(begun).seconds_f64() < seconds)) {
                self.injector.note_change(*place);
                held_up = true;
            }
        }
        held_up
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::format;

    #[test]
    fn every_row_acts_somewhere_and_has_a_name_of_its_own() {
        let names: BTreeSet<_> = FAULTS.iter().map(|kind| kind.name).collect();
        assert_eq!(names.len(), FAULTS.len());
        for kind in FAULTS {
            let fault = Fault::parse(&format!("{}@hover", kind.name), FAULTS).expect(kind.name);
            assert!(!acts(&fault).is_empty(), "{}", kind.name);
            assert!(kind.expected.may_be_acceptable());
            if let (Some(default), Some([low, high])) = (kind.value.default(), kind.value.range()) {
                assert!((low..=high).contains(&default), "{}", kind.name);
            }
        }
        let faults: Vec<_> =
            FAULTS.iter().filter_map(|kind| Fault::parse(&format!("{}@1", kind.name), FAULTS).ok()).collect();
        assert_eq!(faults.len(), FAULTS.len());
        // Lines panic when a field does not exist.
        let wrong = Wrong::new(&faults, Instant::ZERO, 1);
        let _ = (wrong.sensor_lines(), wrong.radio_lines());
    }
}
