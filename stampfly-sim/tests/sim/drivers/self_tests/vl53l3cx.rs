//! Self-test of the VL53L3CX's driver.

use super::{Bench, FAILED, Outcome, configuration, identification, put, restless};
use crate::drivers::spoilt::{Spoil, Spoilt};
use crate::standing;
use stampfly_drivers::RangeFinder;
use stampfly_drivers::chip::vl53l3cx::{BootAddress, Config, Vl53l3cx};
use stampfly_drivers::chip::{ChipError, TransferLimit};
use stampfly_sim::chips::{self, Faults, I2cBus, ShutdownPin};
use stampfly_sim::sensors::Mount;
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Duration;

type Range = Vl53l3cx<'static, Spoilt<I2cBus>, ShutdownPin, Clock>;

fn range_at(mount: Mount, spoil: Spoil) -> Bench<Range> {
    let (simulation, config) = (standing(), Config::default());
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let (chip, pin) = chips::Vl53l3cx::new(&simulation.world, &clock, 1, mount);
    let attached = bus.attach(Vl53l3cx::BOOT_ADDRESS, chip);
    let bus = Spoilt { bus, clock: clock.clone(), spoil };
    let boot = Box::leak(Box::new(BootAddress::new()));
    let driver =
        Vl53l3cx::new(bus, pin, boot, 0x30, clock.clone(), config).with_transfer_limit(TransferLimit::I2C_SENSORS);
    (clock, attached, driver)
}

fn range(spoil: Spoil) -> Bench<Range> {
    range_at(Mount::Bottom, spoil)
}

#[test]
fn tells_a_healthy_chip_from_a_broken_one() {
    tells_healthy_from_broken!(range, 160, distance, 0.01);
}

#[test]
fn ends_in_time() {
    // 21 periods plus one second.
    ends_in_time!(range, 9, 1_700);
}

#[test]
fn says_what_failed() {
    const NO_SAMPLE: Outcome = Err(ChipError::NoSample);
    says!(
        range,
        500,
        [
            (put(0x10F, 2, 0, &[0xCC]), identification(0xCCAA)),
            (put(0x10F, 2, 1, &[0]), identification(0xEA00)),
            (put(0xE5, 1, 0, &[2]), configuration(2)),
            (put(0x5E, 12, 2, &[0x0B]), configuration(0x0B)),
            (restless(0xDE), Err(ChipError::Data)),
            // No measurement; all with one number; all equal; no chip on the bus.
            (put(0x30, 2, 1, &[0]), NO_SAMPLE),
            (put(0x89, 17, 2, &[7]), NO_SAMPLE),
            (put(0x89, 17, 0, &[7; 17]), NO_SAMPLE),
            (put(0x89, 17, 0, &[0xFF; 17]), Err(ChipError::Data)),
            // Nothing measured; laser, detector or computation failed; no status.
            (put(0x89, 17, 0, &[0]), FAILED),
            (put(0x89, 17, 0, &[2]), FAILED),
            (put(0x89, 17, 0, &[3]), FAILED),
            (put(0x89, 17, 0, &[10]), FAILED),
            (put(0x89, 17, 0, &[31]), FAILED),
        ]
    );
}

#[test]
fn passes_without_a_target_and_leaves_the_next_sample_vouched_for() {
    let (clock, _, mut ahead) = range_at(Mount::Front, Spoil::NOT);
    assert_eq!(block_on(&clock, ahead.self_test()), Ok(()));
    let (clock, _, mut below) = range(Spoil::NOT);
    assert_eq!(block_on(&clock, below.self_test()), Ok(()));
    assert!(block_on(&clock, below.next()).expect("a measurement").data.valid);
}
