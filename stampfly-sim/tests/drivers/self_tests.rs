//! The self tests of the chips that have none of their own: a healthy chip passes and measures on as before, each way of
//! failing is named, and whatever the bus does, they end.

use crate::spoilt::{Spoil, Spoilt};
use crate::standing;
use core::cell::Cell;
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::ina3221::{self, Channel, Ina3221};
use stampfly_drivers::chip::pmw3901::{self, Pmw3901};
use stampfly_drivers::chip::vl53l3cx::{self, BootAddress, Vl53l3cx};
use stampfly_drivers::chip::{AxisMap, ChipError, I2cRegisters};
use stampfly_drivers::{Barometer, OpticalFlow, PowerMonitor, RangeFinder};
use stampfly_sim::chips::{self, Attached, BusError, Faults, I2cBus, ShutdownPin, SpiBus, SpiPort};
use stampfly_sim::sensors::Mount;
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Micros;

type Outcome = Result<(), ChipError<BusError>>;
type Bench<D> = (Clock, Attached, D);
type Change = fn(u16, &mut [u8]);

thread_local! {
    /// For answers that are another every time.
    static LAST: Cell<u8> = const { Cell::new(0) };
}

fn barometer(spoil: Spoil) -> Bench<Bmp280<I2cRegisters<Spoilt<I2cBus>>, Clock>> {
    let (simulation, config) = (standing(), bmp280::Config::default());
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let attached = bus.attach(Bmp280::SDO_LOW, chips::Bmp280::new(&simulation.world, &clock, 1));
    clock.advance_to(clock.now() + Micros::from_millis(2));
    let bus = Spoilt { bus, clock: clock.clone(), spoil };
    (clock.clone(), attached, Bmp280::new(bus, Bmp280::SDO_LOW, clock, config))
}

fn monitor_of(channel: Channel, spoil: Spoil) -> Bench<Ina3221<I2cRegisters<Spoilt<I2cBus>>, Clock>> {
    let (simulation, config) = (standing(), ina3221::Config { channel, ..Default::default() });
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let attached = bus.attach(Ina3221::A0_GROUND, chips::Ina3221::new(&simulation.world, &clock, 1));
    let bus = Spoilt { bus, clock: clock.clone(), spoil };
    (clock.clone(), attached, Ina3221::new(bus, Ina3221::A0_GROUND, clock, config))
}

fn monitor(spoil: Spoil) -> Bench<Ina3221<I2cRegisters<Spoilt<I2cBus>>, Clock>> {
    monitor_of(Channel::Two, spoil)
}

fn flow(spoil: Spoil) -> Bench<Pmw3901<Spoilt<SpiPort<chips::Pmw3901>>, Clock>> {
    let (simulation, config) = (standing(), pmw3901::Config::default());
    let clock = simulation.clock.clone();
    let chip = chips::Pmw3901::new(&simulation.world, &clock, 1);
    let (bus, attached) = SpiBus::new(&clock, 1).attach(2_000_000, chip);
    let bus = Spoilt { bus, clock: clock.clone(), spoil };
    (clock.clone(), attached, Pmw3901::new(bus, clock, AxisMap::STAMPFLY_FLOW, config))
}

type Range = Vl53l3cx<'static, Spoilt<I2cBus>, ShutdownPin, Clock>;

fn range_at(mount: Mount, spoil: Spoil) -> Bench<Range> {
    let (simulation, config) = (standing(), vl53l3cx::Config::default());
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let (chip, pin) = chips::Vl53l3cx::new(&simulation.world, &clock, 1, mount);
    let attached = bus.attach(Vl53l3cx::BOOT_ADDRESS, chip);
    let bus = Spoilt { bus, clock: clock.clone(), spoil };
    let boot = Box::leak(Box::new(BootAddress::new()));
    (clock.clone(), attached, Vl53l3cx::new(bus, pin, boot, 0x30, clock, config))
}

fn range(spoil: Spoil) -> Bench<Range> {
    range_at(Mount::Bottom, spoil)
}

/// Healthy, or with a sensing element that feels nothing: the outcome follows, in time, and the chip measures as before.
macro_rules! tells_healthy_from_broken {
    ($bench:expr, $millis:expr, $figure:ident, $tolerance:expr) => {
        for broken in [false, true] {
            let (clock, attached, mut driver) = $bench(Spoil::NOT);
            let mut figure = || {
                let sample = block_on(&clock, driver.next()).expect("a sample");
                (sample.at, sample.data.$figure)
            };
            let [.., before] = [0; 5].map(|_| figure());
            attached.set_broken(broken);
            let begun = clock.now();
            let outcome = block_on(&clock, driver.self_test());
            let took = clock.now().since(begun);
            assert_eq!(outcome, if broken { Err(ChipError::SelfTest) } else { Ok(()) });
            assert!(took < Micros::from_millis($millis), "{took}");
            attached.set_broken(false);
            let after = [0; 5].map(|_| {
                let sample = block_on(&clock, driver.next()).expect("a sample");
                (sample.at, sample.data.$figure)
            });
            let off = after.map(|(at, figure)| (at > before.0, (figure - before.1).abs() < $tolerance));
            assert_eq!(off[2..], [(true, true); 3], "{before:?} and then {after:?}");
        }
    };
}

/// On a bus that never answers, refuses, garbles or is slow, before and after a start.
macro_rules! ends_in_time {
    ($bench:expr, $slow:expr, $millis:expr) => {
        let limit = Micros::from_millis($millis);
        let faults = [
            Faults { dead: true, ..Faults::default() },
            Faults { refusals: 1.0, ..Faults::default() },
            Faults { refusals: 0.1, ..Faults::default() },
            Faults { bit_errors: 0.001, ..Faults::default() },
            Faults { bit_errors: 0.3, ..Faults::default() },
        ];
        for faults in faults {
            for started in [false, true] {
                let (clock, attached, mut driver) = $bench(Spoil::NOT);
                if started {
                    assert_eq!(block_on(&clock, driver.start()), Ok(()));
                }
                attached.set_faults(faults);
                let begun = clock.now();
                let outcome = block_on(&clock, driver.self_test());
                let took = clock.now().since(begun);
                assert!(took < limit, "{faults:?}: {took}");
                assert!(outcome.is_err() || faults.refusals + faults.bit_errors < 0.2, "{faults:?}: {outcome:?}");
                attached.set_faults(Faults::default());
                assert_eq!(block_on(&clock, driver.self_test()), Ok(()), "after {faults:?}");
            }
        }
        let outcomes: [(Micros, Outcome); 2] =
            [(Micros::from_secs(100), Err(ChipError::BusTimeout)), (Micros::from_millis($slow), Ok(()))];
        for (delay, expected) in outcomes {
            let (clock, _, mut driver) = $bench(Spoil::slow(delay));
            let begun = clock.now();
            assert_eq!(block_on(&clock, driver.self_test()), expected, "{delay} more");
            let took = clock.now().since(begun);
            assert!(took < limit, "{delay} more: {took}");
        }
    };
}

/// Each change of the chip's answers has its outcome.
macro_rules! says {
    ($bench:expr, $millis:expr, $changes:expr) => {
        let changes: &[(Change, Outcome)] = &$changes;
        for (number, (change, expected)) in changes.iter().enumerate() {
            let (clock, _, mut driver) = $bench(Spoil::changed(*change));
            let begun = clock.now();
            assert_eq!(block_on(&clock, driver.self_test()), *expected, "change {number}");
            assert!(clock.now().since(begun) < Micros::from_millis($millis), "change {number}");
        }
    };
}

const fn identification(found: u16) -> Outcome {
    Err(ChipError::Identification { found })
}

const fn configuration(status: u8) -> Outcome {
    Err(ChipError::Configuration { status })
}

const FAILED: Outcome = Err(ChipError::SelfTest);

mod of_the_barometer {
    use super::*;

    #[test]
    fn tells_a_healthy_chip_from_a_broken_one() {
        tells_healthy_from_broken!(barometer, 30, pressure, 20.0);
    }

    #[test]
    fn ends_in_time() {
        ends_in_time!(barometer, 9, 400);
    }

    #[test]
    fn says_what_failed() {
        // The result: status, control, configuration, nothing, pressure, temperature.
        says!(
            barometer,
            60,
            [
                (
                    |register, answer| if register == 0xD0 {
                        answer[0] = 0x55
                    },
                    identification(0x55)
                ),
                (
                    |register, answer| if register == 0x88 {
                        answer.fill(0)
                    },
                    Err(ChipError::Data)
                ),
                (
                    |register, answer| if register == 0x88 {
                        answer.fill(0xFF)
                    },
                    Err(ChipError::Data)
                ),
                // T1, P1.
                (
                    |register, answer| if register == 0x88 {
                        answer[..2].fill(0)
                    },
                    Err(ChipError::Data)
                ),
                (
                    |register, answer| if register == 0x88 {
                        answer[6..8].fill(0)
                    },
                    Err(ChipError::Data)
                ),
                // Copies its calibration for ever.
                (
                    |register, answer| if (register, answer.len()) == (0xF3, 1) {
                        answer[0] = 1
                    },
                    configuration(1)
                ),
                (
                    |register, answer| if register == 0xF4 {
                        answer[0] = 0x24
                    },
                    configuration(0x24)
                ),
                (
                    |register, answer| if register == 0xF4 {
                        answer[1] = 0
                    },
                    configuration(0)
                ),
                // Begins no conversion, ends none.
                (
                    |register, answer| if (register, answer.len()) == (0xF3, 2) {
                        answer.fill(0)
                    },
                    Err(ChipError::NoSample)
                ),
                (
                    |register, answer| if answer.len() == 10 && register == 0xF3 {
                        answer[0] = 8
                    },
                    Err(ChipError::NoSample)
                ),
                // Never measured; either one at an end; 90 °C.
                (
                    |_, answer| if answer.len() == 10 {
                        answer[4..7].copy_from_slice(&[0x80, 0, 0])
                    },
                    FAILED
                ),
                (
                    |_, answer| if answer.len() == 10 {
                        answer[7..].copy_from_slice(&[0x80, 0, 0])
                    },
                    FAILED
                ),
                (
                    |_, answer| if answer.len() == 10 {
                        answer[4..7].fill(0)
                    },
                    FAILED
                ),
                (
                    |_, answer| if answer.len() == 10 {
                        answer[4..7].fill(0xFF)
                    },
                    FAILED
                ),
                (
                    |_, answer| if answer.len() == 10 {
                        answer[7..].fill(0)
                    },
                    FAILED
                ),
                (
                    |_, answer| if answer.len() == 10 {
                        answer[7..].copy_from_slice(&[0xB1, 0x40, 0])
                    },
                    FAILED
                ),
            ]
        );
    }
}

mod of_the_monitor {
    use super::*;

    #[test]
    fn tells_a_healthy_chip_from_a_broken_one() {
        tells_healthy_from_broken!(monitor, 12, voltage, 0.03);
    }

    #[test]
    fn ends_in_time() {
        ends_in_time!(monitor, 9, 200);
    }

    #[test]
    fn says_what_failed() {
        says!(
            monitor,
            30,
            [
                (
                    |register, answer| if register == 0xFE {
                        answer.fill(0)
                    },
                    identification(0)
                ),
                (
                    |register, answer| if register == 0xFF {
                        answer[1] = 0x60
                    },
                    identification(0x3260)
                ),
                (
                    |register, answer| if register == 0 {
                        answer.copy_from_slice(&[0x71, 0x27])
                    },
                    configuration(0x71)
                ),
                (
                    |register, answer| if register == 0x0F {
                        answer[1] &= !1
                    },
                    Err(ChipError::NoSample)
                ),
                // 0 V, −8 mV, 26.008 V, the scale's end.
                (
                    |register, answer| if register == 4 {
                        answer.fill(0)
                    },
                    FAILED
                ),
                (
                    |register, answer| if register == 4 {
                        answer.copy_from_slice(&[0xFF, 0xF8])
                    },
                    FAILED
                ),
                (
                    |register, answer| if register == 4 {
                        answer.copy_from_slice(&[0x65, 0x98])
                    },
                    FAILED
                ),
                (
                    |register, answer| if register == 3 {
                        answer.copy_from_slice(&[0x7F, 0xF8])
                    },
                    FAILED
                ),
                (
                    |register, answer| if register == 3 {
                        answer.copy_from_slice(&[0x80, 0x00])
                    },
                    FAILED
                ),
            ]
        );
    }

    #[test]
    fn fails_on_a_channel_without_a_supply() {
        for channel in [Channel::One, Channel::Three] {
            let (clock, _, mut driver) = monitor_of(channel, Spoil::NOT);
            assert_eq!(block_on(&clock, driver.self_test()), FAILED, "{channel:?}");
        }
    }
}

mod of_the_flow_sensor {
    use super::*;

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
}

mod of_the_range_finder {
    use super::*;

    #[test]
    fn tells_a_healthy_chip_from_a_broken_one() {
        tells_healthy_from_broken!(range, 250, distance, 0.01);
    }

    #[test]
    fn ends_in_time() {
        // 21 periods and a second.
        ends_in_time!(range, 9, 1_700);
    }

    #[test]
    fn says_what_failed() {
        says!(
            range,
            500,
            [
                (
                    |register, answer| if register == 0x10F {
                        answer[0] = 0xCC
                    },
                    identification(0xCCAA)
                ),
                (
                    |register, answer| if register == 0x10F {
                        answer[1] = 0
                    },
                    identification(0xEA00)
                ),
                (
                    |register, answer| if register == 0xE5 {
                        answer[0] = 2
                    },
                    configuration(2)
                ),
                (
                    |register, answer| if register == 0x5E {
                        answer[2] = 0x0B
                    },
                    configuration(0x0B)
                ),
                (
                    |register, answer| if register == 0xDE {
                        answer[0] = LAST.replace(answer[0] ^ 1)
                    },
                    Err(ChipError::Data)
                ),
                // No measurement, none after the first, all of one number.
                (
                    |register, answer| if register == 0x30 {
                        answer[1] = 0
                    },
                    Err(ChipError::NoSample)
                ),
                (
                    |register, answer| if register == 0x89 {
                        answer[2] = 7
                    },
                    Err(ChipError::NoSample)
                ),
                (
                    |register, answer| if register == 0x89 {
                        answer.fill(7)
                    },
                    Err(ChipError::NoSample)
                ),
                (
                    |register, answer| if register == 0x89 {
                        answer.fill(0xFF)
                    },
                    Err(ChipError::Data)
                ),
                // Nothing measured, laser, detector, computation, no status at all.
                (
                    |register, answer| if register == 0x89 {
                        answer[0] = 0
                    },
                    FAILED
                ),
                (
                    |register, answer| if register == 0x89 {
                        answer[0] = 2
                    },
                    FAILED
                ),
                (
                    |register, answer| if register == 0x89 {
                        answer[0] = 3
                    },
                    FAILED
                ),
                (
                    |register, answer| if register == 0x89 {
                        answer[0] = 10
                    },
                    FAILED
                ),
                (
                    |register, answer| if register == 0x89 {
                        answer[0] = 31
                    },
                    FAILED
                ),
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
}
