//! What can be broken on a vehicle that stands on a [`Bench`](super::Bench): chips, wires, motors, light, flash.
//!
//! Each acts where it would on a vehicle, at the chip's registers, on the bus, at a plug. Nobody who examines the vehicle is
//! told. For what can go wrong in flight see [`faults`](crate::simulation::faults).

use crate::VehicleConfig;
use crate::golden::{FLIGHT, TOLERANCE};
use crate::schedule::Runnables;
use crate::topics;
use core::fmt;
use stampfly_flight::doctor::{FlashAccess, Restart};
use stampfly_flight::golden::{self, GoldenError, Report, Verdict};
use stampfly_sim::chips::{Board, Faults, Flaw, Nonsense};
use stampfly_types::messages::PilotInput;
use std::boxed::Box;
use std::format;
use std::string::String;
use std::vec::Vec;

/// What is broken. Motors are counted from zero; chips are named by what they measure.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub enum Defect {
    /// The chip answers nothing.
    Dead(&'static str),
    /// Another part has been soldered.
    OtherChip(&'static str),
    /// The sensing element is broken: the chip answers and feels nothing.
    Numb(&'static str),
    /// A share of its transfers fails: a bad joint.
    Loose(&'static str),
    /// Soldered otherwise, covered, stuck.
    Flaw(&'static str, Flaw),
    /// SDA is shorted to ground.
    I2cShorted,
    /// The line from the chips on SPI stays low.
    SpiStuck,
    /// The battery has this share of its charge.
    Battery(f64),
    /// The motor is not plugged in.
    MotorDead(usize),
    /// The motor is plugged in the wrong way round.
    MotorReversed(usize),
    /// Two motors have each other's plugs.
    MotorsSwapped(usize, usize),
    /// The status light has no supply.
    LightDark,
    /// The buzzer is torn off.
    BuzzerSilent,
    /// The button's contact is always this.
    Button(bool),
    /// What the transmitter sends when its sticks are moved; nothing when it is silent.
    Transmitter(fn(PilotInput) -> Option<PilotInput>),
    /// The memory controller's registers as a boot loader for another board sets them: control, clock.
    Flash(u32, u32),
    /// Something else takes the processor: everything lasts so many times as long.
    Load(f32),
    /// Why the processor started.
    Restart(Restart),
    /// A bit of the flash is wrong, in the record of the self test.
    FlashBit,
}

impl fmt::Debug for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = FAULTS.iter().find(|fault| core::mem::discriminant(&fault.1) == core::mem::discriminant(self));
        f.write_str(named.map_or("chip", |fault| fault.0))
    }
}

/// A defect with its name, which is that of the finding which it should lead to.
#[derive(Clone, Debug)]
pub struct Fault {
    /// Stable.
    pub name: String,
    /// What is broken.
    pub defect: Defect,
}

/// Chips on the board.
const CHIPS: [&str; 7] = crate::simulation::sensing::NAMES;
/// On SPI, where a chip's start is some hundred transfers, and a bad joint has to let them pass now and then.
const ON_SPI: [&str; 2] = [CHIPS[0], CHIPS[3]];
/// Share of the transfers that fail.
const RARELY: f64 = 0.015;
const OFTEN: f64 = 0.1;
/// Those whose sensing element can be told to feel nothing.
const NUMB: [&str; 4] = ["imu", "flow", "mag", "tof"];
/// Magnetometer and barometer, whose converters can hang.
const STUCK: [&str; 2] = [CHIPS[4], CHIPS[5]];
/// An axis that points the other way.
const X_REVERSED: [[i8; 3]; 3] = [[-1, 0, 0], [0, 1, 0], [0, 0, 1]];
const Y_REVERSED: [[i8; 3]; 3] = [[1, 0, 0], [0, -1, 0], [0, 0, 1]];
const Z_REVERSED: [[i8; 3]; 3] = [[1, 0, 0], [0, 1, 0], [0, 0, -1]];
/// A quarter and a half turn about z, and a half turn about x.
const QUARTER: [[i8; 3]; 3] = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]];
const HALF: [[i8; 3]; 3] = [[-1, 0, 0], [0, -1, 0], [0, 0, 1]];
const OVERTURNED: [[i8; 3]; 3] = [[1, 0, 0], [0, -1, 0], [0, 0, -1]];
/// Forward and right change places.
const SWAPPED: [[i8; 3]; 3] = [[0, 1, 0], [1, 0, 0], [0, 0, 1]];

/// Every fault that is not one of each chip's.
#[rustfmt::skip]
const FAULTS: &[(&str, Defect)] = &[
    ("imu-x-reversed", Defect::Flaw("imu", Flaw::Mounting(X_REVERSED))),
    ("imu-y-reversed", Defect::Flaw("imu", Flaw::Mounting(Y_REVERSED))),
    ("imu-z-reversed", Defect::Flaw("imu", Flaw::Mounting(Z_REVERSED))),
    ("imu-axes-swapped", Defect::Flaw("imu", Flaw::Mounting(SWAPPED))),
    ("imu-turned-90", Defect::Flaw("imu", Flaw::Mounting(QUARTER))),
    ("imu-turned-180", Defect::Flaw("imu", Flaw::Mounting(HALF))),
    ("imu-upside-down", Defect::Flaw("imu", Flaw::Mounting(OVERTURNED))),
    ("mag-turned", Defect::Flaw("mag", Flaw::Mounting(HALF))),
    ("mag-mirrored", Defect::Flaw("mag", Flaw::Mounting(Y_REVERSED))),
    ("tof-offset", Defect::Flaw("tof", Flaw::Offset(0.2))),
    ("tof-covered", Defect::Flaw("tof", Flaw::Covered(0.025))),
    ("tof-light-mode", Defect::Flaw("tof", Flaw::LightMode(Nonsense::Unseen))),
    ("tof-front-covered", Defect::Flaw("tof_front", Flaw::Covered(0.025))),
    ("flow-x-reversed", Defect::Flaw("flow", Flaw::Mounting(X_REVERSED))),
    ("flow-y-reversed", Defect::Flaw("flow", Flaw::Mounting(Y_REVERSED))),
    ("flow-turned-180", Defect::Flaw("flow", Flaw::Mounting(HALF))),
    ("flow-axes-swapped", Defect::Flaw("flow", Flaw::Mounting(SWAPPED))),
    ("battery-weak", Defect::Battery(0.03)),
    ("power-voltage-scale", Defect::Flaw("power", Flaw::Voltage(2.0))),
    ("power-current-scale", Defect::Flaw("power", Flaw::Current(10.0))),
    ("motor-1-dead", Defect::MotorDead(0)),
    ("motor-2-dead", Defect::MotorDead(1)),
    ("motor-3-dead", Defect::MotorDead(2)),
    ("motor-4-dead", Defect::MotorDead(3)),
    ("motor-2-reversed", Defect::MotorReversed(1)),
    ("motor-3-reversed", Defect::MotorReversed(2)),
    ("motors-1-3-swapped", Defect::MotorsSwapped(0, 2)),
    ("motors-1-2-swapped", Defect::MotorsSwapped(0, 1)),
    ("light-dark", Defect::LightDark),
    ("buzzer-silent", Defect::BuzzerSilent),
    ("button-stuck", Defect::Button(true)),
    ("button-dead", Defect::Button(false)),
    ("i2c-shorted", Defect::I2cShorted),
    ("spi-stuck", Defect::SpiStuck),
    ("transmitter-silent", Defect::Transmitter(|_| None)),
    ("stick-roll-reversed", Defect::Transmitter(|sticks| Some(PilotInput { roll: -sticks.roll, ..sticks }))),
    ("stick-pitch-reversed", Defect::Transmitter(|sticks| Some(PilotInput { pitch: -sticks.pitch, ..sticks }))),
    ("stick-yaw-reversed", Defect::Transmitter(|sticks| Some(PilotInput { yaw: -sticks.yaw, ..sticks }))),
    ("stick-throttle-reversed", Defect::Transmitter(|sticks| Some(PilotInput { throttle: -sticks.throttle, ..sticks }))),
    ("sticks-swapped", Defect::Transmitter(|sticks| {
        Some(PilotInput { roll: sticks.yaw, yaw: sticks.roll, pitch: sticks.throttle, throttle: sticks.pitch, ..sticks })
    })),
    ("flash-slow", Defect::Flash(1 << 23, 0x0001_0001)),
    ("passes-late", Defect::Load(3.5)),
    ("restart-brown-out", Defect::Restart(Restart::BrownOut)),
    ("restart-watchdog", Defect::Restart(Restart::Watchdog)),
    ("self-test-differs", Defect::FlashBit),
];

/// Every fault there is.
#[must_use]
pub fn all() -> Vec<Fault> {
    let of_chips: [(&str, fn(&'static str) -> Defect); 3] =
        [("dead", Defect::Dead), ("wrong-chip", Defect::OtherChip), ("loose", Defect::Loose)];
    let named = |chip: &str, what: &str| format!("{}-{what}", chip.replace('_', "-"));
    let each = CHIPS.iter().flat_map(|chip| {
        of_chips.iter().map(move |(what, defect)| Fault { name: named(chip, what), defect: defect(chip) })
    });
    let numb = NUMB.iter().map(|chip| Fault { name: named(chip, "numb"), defect: Defect::Numb(chip) });
    let stuck = STUCK.iter().map(|chip| Fault { name: named(chip, "stuck"), defect: Defect::Flaw(chip, Flaw::Stuck) });
    let others = FAULTS.iter().map(|(name, defect)| Fault { name: String::from(*name), defect: *defect });
    each.chain(numb).chain(stuck).chain(others).collect()
}

impl Defect {
    /// Breaks what is broken on the board.
    pub(super) fn damage(&self, board: &Board) {
        let chip = |name| board.attached.named(name).into_iter();
        match *self {
            Self::Dead(name) => chip(name).for_each(|chip| chip.set_faults(Faults { dead: true, ..Faults::default() })),
            Self::OtherChip(name) => chip(name).for_each(|chip| chip.set_id(0x5A)),
            Self::Numb(name) => chip(name).for_each(|chip| chip.set_broken(true)),
            Self::Loose(name) => {
                let refusals = if ON_SPI.contains(&name) { RARELY } else { OFTEN };
                chip(name).for_each(|chip| chip.set_faults(Faults { refusals, ..Faults::default() }));
            }
            Self::Flaw(name, flaw) => chip(name).for_each(|chip| chip.set_flaw(Some(flaw))),
            Self::I2cShorted => board.i2c.short_sda(true),
            Self::SpiStuck => board.imu.bus().hold_miso(Some(false)),
            _ => {}
        }
    }
}

/// The record of the self test, played as the vehicle plays it at power-on.
pub(super) fn self_test(defect: Option<&Defect>) -> Result<Report, GoldenError> {
    let play = |record: &[u8]| {
        let mut bus = Box::new(topics::Bus::new());
        golden::play::<Runnables>(&mut bus, record, &VehicleConfig::default(), TOLERANCE, &mut ())
    };
    if !matches!(defect, Some(Defect::FlashBit)) {
        return play(FLIGHT);
    }
    // The first bit from the middle on that changes what is computed and leaves the record readable:
    // what a byte means depends on the flight that was recorded.
    let middle = FLIGHT.len() / 2;
    let flipped = (middle..FLIGHT.len()).map(|at| {
        let mut record = FLIGHT.to_vec();
        record[at] ^= 0x10;
        play(&record)
    });
    flipped
        .take(MOST_FLIPS)
        .find(|report| matches!(report, Ok(report) if matches!(report.verdict, Verdict::WithinTolerance { .. })))
        .unwrap_or(Err(GoldenError::Damaged))
}

/// Bits that [`self_test`] tries: some samples.
const MOST_FLIPS: usize = 200;

/// How the memory controller is set.
pub(super) fn flash(defect: Option<&Defect>) -> FlashAccess {
    match defect {
        Some(Defect::Flash(control, clock)) => FlashAccess::from_registers(*control, *clock),
        _ => FlashAccess::from_registers(1 << 24, 1 << 31),
    }
}

pub(super) fn restart(defect: Option<&Defect>) -> Restart {
    match defect {
        Some(Defect::Restart(restart)) => *restart,
        _ => Restart::PowerOn,
    }
}

pub(super) fn load(defect: Option<&Defect>) -> f32 {
    match defect {
        Some(Defect::Load(times)) => *times,
        _ => 1.0,
    }
}

pub(super) fn is_dark(defect: Option<&Defect>) -> bool {
    matches!(defect, Some(Defect::LightDark))
}

pub(super) fn is_silent(defect: Option<&Defect>) -> bool {
    matches!(defect, Some(Defect::BuzzerSilent))
}
