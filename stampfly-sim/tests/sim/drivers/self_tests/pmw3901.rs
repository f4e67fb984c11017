//! Self-test of the PMW3901's driver.

use super::{Bench, FAILED, Outcome, configuration, identification, put, restless};
use crate::drivers::spoilt::{Spoil, Spoilt};
use crate::{mounting, standing};
use stampfly_drivers::OpticalFlow;
use stampfly_drivers::chip::ChipError;
use stampfly_drivers::chip::pmw3901::{Config, Pmw3901};
use stampfly_sim::chips::{self, Faults, SpiBus, SpiPort};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Duration;

fn flow(spoil: Spoil) -> Bench<Pmw3901<Spoilt<SpiPort<chips::Pmw3901>>, Clock>> {
    let (simulation, config) = (standing(), Config::default());
    let clock = simulation.clock.clone();
    let chip = chips::Pmw3901::new(&simulation.world, &clock, 1);
    let (bus, attached) = SpiBus::new(&clock, 1).attach(2_000_000, chip);
    let bus = Spoilt { bus, clock: clock.clone(), spoil };
    (clock.clone(), attached, Pmw3901::new(bus, clock, mounting::FLOW, config))
}

#[test]
fn tells_a_healthy_chip_from_a_broken_one() {
    tells_healthy_from_broken!(flow, 200, delta_x, 0.02);
}

#[test]
fn ends_in_time() {
    ends_in_time!(flow, 8, 4_200);
}

#[test]
fn says_what_failed() {
    says!(
        flow,
        300,
        [
            (put(0x00, 1, 0, &[0x42]), identification(0x42B6)),
            (put(0x5F, 1, 0, &[0x49]), identification(0x4949)),
            (put(0x47, 1, 0, &[0]), configuration(0)),
            // A constant value counts as one that cannot be read back. Two banks have such a
            // register and each is read twice, so the second start ends with the sixth answer.
            (restless(0x4E), configuration(6)),
            // The burst: maximum and minimum from byte 8, the shutter from byte 10.
            (put(0x16, 12, 0, &[0xFF; 12]), Err(ChipError::Data)),
            (put(0x16, 12, 8, &[0x10, 0x11]), FAILED),
            (put(0x16, 12, 7, &[0; 3]), FAILED),
            (put(0x16, 12, 10, &[0; 2]), FAILED),
        ]
    );
}

#[test]
fn passes_in_the_dark() {
    says!(
        flow,
        200,
        [
            (put(0x16, 12, 2, &[0, 0, 0, 0, 0, 1, 2, 1, 0x1F, 0xFF]), Ok(())),
            (put(0x16, 12, 2, &[0, 0, 0, 0, 0, 0, 0, 0, 0x1F, 0xFF]), Ok(())),
        ]
    );
}
