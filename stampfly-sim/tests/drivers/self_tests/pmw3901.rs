//! PMW3901.

use super::{Bench, Change, FAILED, LAST, Outcome, configuration, identification};
use crate::spoilt::{Spoil, Spoilt};
use crate::standing;
use stampfly_drivers::OpticalFlow;
use stampfly_drivers::chip::pmw3901::{Config, Pmw3901};
use stampfly_drivers::chip::{AxisMap, ChipError};
use stampfly_sim::chips::{self, Faults, SpiBus, SpiPort};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Micros;

fn flow(spoil: Spoil) -> Bench<Pmw3901<Spoilt<SpiPort<chips::Pmw3901>>, Clock>> {
    let (simulation, config) = (standing(), Config::default());
    let clock = simulation.clock.clone();
    let chip = chips::Pmw3901::new(&simulation.world, &clock, 1);
    let (bus, attached) = SpiBus::new(&clock, 1).attach(2_000_000, chip);
    let bus = Spoilt { bus, clock: clock.clone(), spoil };
    (clock.clone(), attached, Pmw3901::new(bus, clock, AxisMap::STAMPFLY_FLOW, config))
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
    // The burst: motion, observation, x, y, quality, sum, brightest, darkest, shutter.
    says!(
        flow,
        300,
        [
            (
                |register, answer| if register == 0x00 {
                    answer[0] = 0x42
                },
                identification(0x42B6)
            ),
            (
                |register, answer| if register == 0x5F {
                    answer[0] = 0x49
                },
                identification(0x4949)
            ),
            (
                |register, answer| if register == 0x47 {
                    answer[0] = 0
                },
                configuration(0)
            ),
            // Another value every time it is asked; one that stays counts as one that cannot be read back. Two banks have
            // such a register, each is asked twice: the sixth answer is the one that the second start ends with.
            (
                |register, answer| {
                    if register == 0x4E {
                        LAST.set(LAST.get() % 100 + 1);
                        answer[0] = LAST.get();
                    }
                },
                configuration(6),
            ),
            (
                |register, answer| if register == 0x16 {
                    answer.fill(0xFF)
                },
                Err(ChipError::Data)
            ),
            (
                |register, answer| if register == 0x16 {
                    answer[8..10].copy_from_slice(&[0x10, 0x11])
                },
                FAILED
            ),
            (
                |register, answer| if register == 0x16 {
                    answer[7..10].fill(0)
                },
                FAILED
            ),
            (
                |register, answer| if register == 0x16 {
                    answer[10..].fill(0)
                },
                FAILED
            ),
        ]
    );
}

#[test]
fn passes_in_the_dark() {
    says!(
        flow,
        200,
        [
            (
                |register, answer| if register == 0x16 {
                    answer[2..].copy_from_slice(&[0, 0, 0, 0, 0, 1, 2, 1, 0x1F, 0xFF])
                },
                Ok(())
            ),
            (
                |register, answer| if register == 0x16 {
                    answer[2..].copy_from_slice(&[0, 0, 0, 0, 0, 0, 0, 0, 0x1F, 0xFF])
                },
                Ok(())
            ),
        ]
    );
}
