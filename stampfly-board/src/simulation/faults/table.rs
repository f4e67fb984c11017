//! The table of what can go wrong in a flight of the StampFly, and what each row does.

use super::act::{Act, Thing};
use crate::topics::{Id, TOPICS};
use stampfly_bus::{Band, TopicInfo};
use stampfly_sim::fault::{Class, Distortion, Effect, Fault, FaultKind, Measure};
use stampfly_sim::plant::RotorFault;
use std::vec;
use std::vec::Vec;

use Class::{Cut, Degraded, Landed, Transparent};
use Measure::{BelowOne, EitherWay, Number, Times};

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
        .sized(BelowOne, [0.02, 1.0], "a nick in a blade to a propeller that has come off")
}

const fn on(name: &'static str) -> FaultKind {
    number(name, ("", 1.0, 0.0, 1.0), Cut, "The motor turns at this duty whatever is commanded.").sized(
        Number,
        [0.05, 1.0],
        "a transistor that leaks to one that is a wire",
    )
}

/// Every fault. Units are SI; axes are the body's. The sizes that are plausible come from data
/// sheets, recordings and physics, and not from what this flight stack finds.
pub const FAULTS: &[FaultKind] =
    &[
        plain("imu-silent", Cut, "No inertial sample arrives."),
        plain("imu-stuck", Cut, "Inertial samples repeat the last one."),
        plain("imu-zero", Cut, "Inertial samples are zero."),
        plain("imu-nan", Cut, "Inertial samples are no numbers."),
        number("imu-scale", ("", 0.5, 0.0, 2.0), Cut, "Rates and accelerations are this many times as large.").sized(
            Times,
            [1.02, 2.0],
            "a few times the sensitivity's tolerance to a range register that is one step off",
        ),
        // On its last rates the vehicle flies for 50 ms, 20 samples: at 3 rad/s, which a gust makes,
        // its tilt is then 9° larger than the estimate.
        number(
            "imu-garbage",
            ("samples", 2.0, 1.0, 400.0),
            Degraded,
            "So many inertial samples are at the negative end of the range.",
        )
        .sized(Number, [1.0, 100.0], "one frame to the time in which the chip is configured again")
        .above(20.0, Cut),
        plain("gyro-stuck", Cut, "Rates repeat the last ones."),
        plain("gyro-zero", Cut, "Rates are zero."),
        // Above 3.5 rad/s it leans by 60° within 0.3 s, and nothing but the rates could have said
        // so.
        number("gyro-bias", ("rad/s", 1.0, -35.0, 35.0), Landed, "The roll rate is too high by this.")
            .sized(EitherWay, [0.01, 10.0], "half of the data sheet's offset to a third of the range, after a blow")
            .above(3.5, Cut),
        number("gyro-spikes", ("rad/s", 20.0, 0.0, 35.0), Cut, "One rate in twenty is off by this.").sized(
            Number,
            [0.1, 35.0],
            "what vibration makes to the end of the range",
        ),
        plain("accel-stuck", Landed, "Accelerations repeat the last ones."),
        plain("accel-zero", Landed, "Accelerations are zero."),
        number("accel-bias", ("m/s^2", 2.0, -80.0, 80.0), Degraded, "The vertical acceleration is too high by this.")
            .sized(EitherWay, [0.1, 10.0], "half of the data sheet's offset to one gravity, after a blow")
            .above(2.0, Landed),
        plain("tof-silent", Degraded, "No range arrives."),
        FaultKind::or_last(
            "tof-stuck",
            ("m", 0.0, 10.0),
            Landed,
            "The range stays at this, or at the last one, as valid as before.",
        )
        .sized(Number, [0.02, 4.0], "a window that is touched to the chip's reach"),
        number("tof-bias", ("m", -0.3, -10.0, 10.0), Landed, "The range is too long by this.").sized(
            EitherWay,
            [0.01, 2.0],
            "half of the data sheet's error to half of the chip's reach",
        ),
        number("tof-scale", ("", 0.5, 0.0, 10.0), Landed, "The range is this many times as long.").sized(
            Times,
            [1.03, 4.0],
            "what specimens differ by to a timing budget that is two steps off",
        ),
        number("tof-alias", ("m", 0.25, 0.01, 10.0), Landed, "The range wraps around at this.").sized(
            Number,
            [0.1, 1.5],
            "the lowest height of a mission to the highest: at more nothing wraps",
        ),
        number("tof-outliers", ("", 0.3, 0.0, 1.0), Landed, "This share of ranges is 0.03 m.").sized(
            Number,
            [0.01, 1.0],
            "an insect to a thread that hangs before the window",
        ),
        plain("flow-silent", Landed, "No flow sample arrives."),
        plain("flow-stuck", Landed, "Flow repeats the last sample."),
        plain("flow-zero", Landed, "Flow is zero, with good quality."),
        plain("flow-reversed", Landed, "Flow has the opposite sign."),
        plain("flow-swapped", Landed, "Forward and right flow change places."),
        number("flow-bias", ("rad", 0.02, -1.0, 1.0), Landed, "Forward flow is too high by this in every sample.")
            .sized(
                EitherWay,
                [0.0005, 0.074],
                "a quarter of a count to the largest motion that the chip follows, 7.4 rad/s at 100 Hz",
            ),
        plain("floor-dark", Landed, "The flow sensor sees no features and says so."),
        number("floor-moves", ("m/s", 0.3, -3.0, 3.0), Landed, "The floor moves north at this speed.").sized(
            EitherWay,
            [0.02, 1.0],
            "a curtain in a draught to a moving walkway",
        ),
        number("slope", ("", 0.2, -2.0, 2.0), Degraded, "The floor rises by this for each metre to the north.").sized(
            EitherWay,
            [0.02, 0.35],
            "a floor that is not level to 20 deg: on a steeper one it lies tilted however it lands",
        ),
        number("edge", ("m", 0.7, -0.5, 3.0), Degraded, "From 0.3 m ahead on, the floor is lower by this, for good.")
            .sized(Number, [0.02, 1.5], "a rug to a gallery"),
        number("ceiling", ("m", 0.2, 0.02, 10.0), Cut, "There is a ceiling this far above the vehicle.").sized(
            Number,
            [0.05, 1.0],
            "the underside of a shelf to more than a mission climbs",
        ),
        number("wall", ("m", 0.4, 0.05, 10.0), Cut, "There is a wall this far ahead of the vehicle.").sized(
            Number,
            [0.05, 1.0],
            "just beside the propellers to as far as a mission goes",
        ),
        number("hand", ("s", 3.0, 0.1, 600.0), Landed, "A hand holds the vehicle where it is for this long.").sized(
            Number,
            [0.1, 30.0],
            "a touch to a hand that carries it away",
        ),
        plain("baro-silent", Degraded, "No pressure arrives."),
        plain("baro-stuck", Transparent, "Pressure repeats the last sample."),
        number("baro-step", ("m", 3.0, -1000.0, 1000.0), Transparent, "The barometric altitude jumps up by this.")
            .sized(EitherWay, [0.1, 100.0], "a door that is opened to a byte that is read wrong"),
        number("mag-bent", ("uT", 100.0, -2000.0, 2000.0), Transparent, "A magnet adds this field, to the right.")
            .sized(EitherWay, [3.0, 1000.0], "steel in a floor to a loudspeaker at a hand's breadth"),
        plain("power-silent", Landed, "No sample of the battery monitor arrives."),
        number("power-volts", ("V", 2.55, 0.0, 10.0), Landed, "The battery monitor reports this voltage.").sized(
            Number,
            [0.3, 6.0],
            "an open line to a supply of 5 V that is read too high",
        ),
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
        )
        .sized(Number, [0.1, 10.0], "a burst of other traffic to a walk round a corner"),
        plain("pilot-nan", Landed, "The pilot's sticks are no numbers."),
        number("stall", ("ms", 20.0, 0.0, 10_000.0), Degraded, "The flight band does not run for this long.")
            .sized(Number, [2.5, 250.0], "one period of the loop to the longest flash write")
            .above(48.0, Cut),
        plain("starve", Landed, "The background band does not run."),
    ];

const GYRO: &[&str] = &["gyro"];
const ACCEL: &[&str] = &["accel", "accel_peak"];
const IMU: &[&str] = &["accel", "accel_peak", "gyro"];
const RANGE: &[&str] = &["distance"];
const FLOW: &[&str] = &["delta_x", "delta_y"];

/// What a fault does. Empty only for a name that is not in the table.
pub(super) fn acts(fault: &Fault) -> Vec<Act> {
    let name = fault.kind.name;
    let (about, what) = name.split_once('-').unwrap_or((name, ""));
    let value = fault.value.unwrap_or_default();
    let number = value as f32;
    let on = |topic, fields, effect| Act::Sample(topic, Distortion::of(fields, effect));
    let imu = |fields, effect| vec![on(Id::sensor_imu, fields, effect)];
    let tof = |fields, effect| on(Id::sensor_tof, fields, effect);
    let flow = |fields, effect| on(Id::sensor_flow, fields, effect);
    let silent = |topic| Act::Sample(topic, Distortion::SILENT);
    match (name, sensor(about), what) {
        (_, Some(topic), "silent") => vec![silent(topic)],
        // A range that is given is vouched for: that is what the fault is about.
        ("tof-stuck", ..) if fault.value.is_some() => {
            vec![tof(RANGE, Effect::Set(number)), tof(&["status"], Effect::Word(0)), tof(&["valid"], Effect::Word(1))]
        }
        (_, Some(topic), "stuck") => vec![Act::Sample(topic, Distortion::whole(Effect::Stuck))],
        ("imu-zero", ..) => imu(IMU, Effect::Set(0.0)),
        ("imu-nan", ..) => imu(IMU, Effect::Set(f32::NAN)),
        ("imu-scale", ..) => imu(IMU, Effect::Scale(number)),
        // Ranges of the BMI270 as the driver sets them: 8 g and 2000 °/s.
        ("imu-garbage", ..) => [(ACCEL, -78.453), (GYRO, -34.907)]
            .map(|(fields, end)| Distortion::of(fields, Effect::Set(end)).for_samples(value as u32))
            .map(|distortion| Act::Sample(Id::sensor_imu, distortion))
            .to_vec(),
        ("gyro-stuck", ..) => imu(GYRO, Effect::Stuck),
        ("gyro-zero", ..) => imu(GYRO, Effect::Set(0.0)),
        ("gyro-bias", ..) => imu(&["gyro[0]"], Effect::Add(number)),
        ("gyro-spikes", ..) => imu(GYRO, Effect::Spikes { share: 0.05, size: number }),
        ("accel-stuck", ..) => imu(ACCEL, Effect::Stuck),
        ("accel-zero", ..) => imu(ACCEL, Effect::Set(0.0)),
        ("accel-bias", ..) => imu(&["accel[2]"], Effect::Add(number)),
        ("tof-bias", ..) => vec![tof(RANGE, Effect::Add(number))],
        ("tof-scale", ..) => vec![tof(RANGE, Effect::Scale(number))],
        ("tof-alias", ..) => vec![tof(RANGE, Effect::Wrap(number))],
        ("tof-outliers", ..) => vec![tof(RANGE, Effect::Outliers { share: value, value: 0.03 })],
        ("flow-zero", ..) => vec![flow(FLOW, Effect::Set(0.0))],
        ("flow-reversed", ..) => vec![flow(FLOW, Effect::Scale(-1.0))],
        ("flow-swapped", ..) => vec![flow(FLOW, Effect::Swap)],
        ("flow-bias", ..) => vec![flow(&["delta_x"], Effect::Add(number))],
        ("floor-dark", ..) => vec![flow(FLOW, Effect::Set(0.0)), flow(&["quality", "valid"], Effect::Word(0))],
        ("floor-moves", ..) => vec![Act::Scene(Thing::FloorVelocity(value))],
        ("slope", ..) => vec![Act::Scene(Thing::Slope(value))],
        ("edge", ..) => vec![Act::Scene(Thing::Edge(value))],
        ("ceiling", ..) => vec![Act::Scene(Thing::Ceiling(value))],
        ("wall", ..) => vec![Act::Scene(Thing::Wall(value))],
        ("hand", ..) => vec![Act::Scene(Thing::Hand(value))],
        // 12 Pa a metre at sea level.
        (_, Some(topic), "step") => {
            vec![on(topic, &["altitude"], Effect::Add(number)), on(topic, &["pressure"], Effect::Add(-12.0 * number))]
        }
        ("mag-bent", ..) => vec![on(Id::sensor_mag, &["field[1]"], Effect::Add(number))],
        ("power-volts", ..) => vec![on(Id::sensor_power, &["voltage"], Effect::Set(number))],
        ("i2c-dead", ..) => [Id::sensor_tof, Id::sensor_mag, Id::sensor_baro, Id::sensor_power]
            .map(silent)
            .into_iter()
            .chain([Act::Bus(|chips| vec![&chips.tof, &chips.tof_front, &chips.mag, &chips.baro, &chips.power])])
            .collect(),
        ("spi-dead", ..) => {
            vec![silent(Id::sensor_imu), silent(Id::sensor_flow), Act::Bus(|chips| vec![&chips.imu, &chips.flow])]
        }
        ("link-lost", ..) => link(Effect::Silent),
        ("link-flap", ..) => link(Effect::Gaps { off: value, on: 0.2 }),
        ("pilot-nan", ..) => vec![Act::Sample(Id::command_pilot, Distortion::whole(Effect::Set(f32::NAN)))],
        ("stall", ..) => vec![Act::HoldUp(Band::Flight, Some(1e-3 * value))],
        ("starve", ..) => vec![Act::HoldUp(Band::Background, None)],
        _ => motor_fault(name, value).into_iter().collect(),
    }
}

/// The topic of the sensor that a fault's name begins with.
fn sensor(name: &str) -> Option<Id> {
    let is_its = |info: &TopicInfo| info.name.strip_prefix("sensor_") == Some(name);
    TOPICS.iter().position(is_its).and_then(|place| Id::ALL.get(place).copied())
}

/// Both directions of the radio, pilot and program.
fn link(effect: Effect) -> Vec<Act> {
    [Id::command_pilot, Id::command_guided, Id::telemetry]
        .map(|topic| Act::Sample(topic, Distortion::whole(effect)))
        .to_vec()
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
