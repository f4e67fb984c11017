//! Driver of the VL53L3CX: two chips on one bus.

use super::{hover, registers};
use crate::standing;
use core::cell::RefCell;
use embedded_hal::digital::OutputPin;
use embedded_hal_async::i2c::I2c;
use stampfly_drivers::RangeFinder;
use stampfly_drivers::chip::ChipError;
use stampfly_drivers::chip::vl53l3cx::{BootAddress, Config, DistanceMode, NoXshut, Vl53l3cx};
use stampfly_drivers::shared::SharedI2c;
use stampfly_sim::chips::{self, Attached, I2cBus, ShutdownPin};
use stampfly_sim::sensors::Mount;
use stampfly_sim::time::{Clock, Tasks, block_on};
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::{Duration, Instant};

const BELOW: u8 = 0x30;
const AHEAD: u8 = 0x31;

struct Bench {
    bus: I2cBus,
    pins: [ShutdownPin; 2],
    /// Bottom and front.
    attached: [Attached; 2],
}

fn bench(simulation: &Simulation) -> Bench {
    let (world, clock) = (&simulation.world, &simulation.clock);
    let bus = I2cBus::new(clock, 1);
    let (chips, pins): (Vec<_>, Vec<_>) =
        [Mount::Bottom, Mount::Front].map(|mount| chips::Vl53l3cx::new(world, clock, 1, mount)).into_iter().unzip();
    let attached: Vec<_> = chips.into_iter().map(|chip| bus.attach(Vl53l3cx::BOOT_ADDRESS, chip)).collect();
    Bench { bus, pins: pins.try_into().expect("two"), attached: attached.try_into().expect("two") }
}

type Driver<'b> = Vl53l3cx<'b, I2cBus, ShutdownPin, Clock>;

/// Both drivers with handles to their chips.
fn drivers<'b>(
    simulation: &Simulation,
    boot: &'b BootAddress,
    config: Config,
) -> (Driver<'b>, Driver<'b>, [Attached; 2]) {
    let Bench { bus, pins: [below_pin, ahead_pin], attached } = bench(simulation);
    let clock = || simulation.clock.clone();
    let below = Vl53l3cx::new(bus.clone(), below_pin, boot, BELOW, clock(), config);
    (below, Vl53l3cx::new(bus, ahead_pin, boot, AHEAD, clock(), config), attached)
}

#[test]
fn another_part_is_named() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut below, mut ahead, attached) = drivers(&simulation, &boot, Config::default());
    attached[0].set_id(0xCC);
    let outcome = block_on(&simulation.clock, below.start());
    assert_eq!(outcome, Err(ChipError::Identification { found: 0xCCAA }));
    assert_eq!(block_on(&simulation.clock, ahead.start()), Ok(()), "the neighbour starts");
}

#[test]
fn both_move_and_are_told_what_the_configuration_says() {
    for (mode, periods) in
        [(DistanceMode::Short, [7, 5]), (DistanceMode::Medium, [11, 9]), (DistanceMode::Long, [15, 13])]
    {
        let (simulation, boot) = (standing(), BootAddress::new());
        let (mut below, mut ahead, attached) = drivers(&simulation, &boot, Config { mode, ..Config::default() });
        assert_eq!(block_on(&simulation.clock, below.start()), Ok(()));
        assert_eq!(block_on(&simulation.clock, ahead.start()), Ok(()));
        for (chip, address) in attached.iter().zip([BELOW, AHEAD]) {
            assert_eq!(registers(chip, 0x0001), [address]);
            assert_eq!([0x0060, 0x0063].map(|register| chip.peek(register)), periods, "laser periods");
            // Interrupt at a new measurement, active high, measuring.
            assert_eq!([0x0046, 0x0030, 0x0087].map(|register| chip.peek(register)), [0x20, 0x01, 0x40]);
            // 33.333 ms in ticks of the slow oscillator.
            let ticks = u32::from_be_bytes(registers(chip, 0x006C));
            let per_millisecond = f64::from(u16::from_be_bytes(registers(chip, 0x00DE))) * 1.075;
            assert!((f64::from(ticks) / per_millisecond - 33.333).abs() < 0.01, "{ticks} ticks");
        }
    }
}

#[test]
fn in_flight_the_distance_is_that_of_the_registers_and_the_truth() {
    let simulation = Simulation::new(&SimulationConfig::example());
    let boot = BootAddress::new();
    let (mut below, _ahead, [chip, _]) = drivers(&simulation, &boot, Config::default());
    let Simulation { clock, world, sensors } = simulation;
    let truth = world.clone();
    let samples = RefCell::new(Vec::new());
    let mut tasks = Tasks::new(clock.clone());
    hover(&mut tasks, clock.clone(), world, sensors.motors);
    tasks.spawn(async {
        loop {
            let sample = below.next().await.expect("no fault is simulated");
            // The read cleared the interrupt, but the distance stays until the next measurement.
            let millimetres = u16::from_be_bytes(registers(&chip, 0x0096));
            assert!((sample.data.distance - f32::from(millimetres) * 1e-3).abs() < 1e-6, "{sample:?} {millimetres}");
            let now = truth.truth_at(sample.at);
            let along_the_beam = -now.position.z / (now.attitude * stampfly_types::Vec3::z()).z;
            samples.borrow_mut().push((sample, sample.data.distance - along_the_beam));
        }
    });
    tasks.run_until(Instant::from_secs(6));
    drop(tasks);
    let samples = samples.into_inner();
    assert!(samples.len() > 160, "{}", samples.len());
    assert!(!samples[0].0.data.valid, "the first is not vouched for");
    let valid: Vec<_> = samples[1..].iter().filter(|(sample, _)| sample.data.valid).collect();
    assert!(valid.len() * 100 > samples.len() * 97, "{} of {}", valid.len(), samples.len());
    // At most 3 mm of the specimen's offset; four standard deviations of a measurement; 1 m/s for
    // the 2 ms between two polls.
    let worst = valid.iter().map(|(_, error)| error.abs()).fold(0.0, f32::max);
    assert!(worst < 0.003 + 4.0 * 0.0017 + 0.002, "{worst} m");
}

#[test]
fn the_first_sample_and_the_rhythm_are_in_time() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut below, _ahead, _) = drivers(&simulation, &boot, Config::default());
    let clock = &simulation.clock;
    let begun = clock.now();
    block_on(clock, below.next()).expect("a measurement");
    assert!(clock.now().since(begun) < Duration::from_millis(85), "{}", clock.now().since(begun));
    let stamps: Vec<_> = (0..60).map(|_| block_on(clock, below.next()).expect("a measurement").at).collect();
    let mean = stamps[59].since(stamps[0]).seconds() / 59.0;
    // A measurement begins when the previous one has been read, which is up to 2 ms plus a read
    // after its end.
    assert!((0.0327..0.0360).contains(&mean), "{mean} s between samples");
}

#[test]
fn without_a_target_no_distance_is_vouched_for() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (_below, mut ahead, _) = drivers(&simulation, &boot, Config::default());
    for _ in 0..60 {
        let sample = block_on(&simulation.clock, ahead.next()).expect("a measurement");
        assert!(!sample.data.valid && sample.data.status == 2, "{sample:?}");
    }
}

#[test]
fn the_self_test_of_one_is_not_noticed_by_the_other() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut below, mut ahead, attached) = drivers(&simulation, &boot, Config::default());
    let clock = &simulation.clock;
    block_on(clock, ahead.next()).expect("a measurement");
    for broken in [false, true] {
        attached[0].set_broken(broken);
        assert_eq!(block_on(clock, below.self_test()), if broken { Err(ChipError::SelfTest) } else { Ok(()) });
        assert!(block_on(clock, ahead.next()).is_ok(), "still there");
    }
    assert_eq!(block_on(clock, ahead.self_test()), Ok(()), "one is broken, the other is not");
}

#[test]
fn a_chip_without_a_pin_starts_before_its_neighbour_and_again_after_a_dip_of_the_supply() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let Bench { bus, pins: [_, ahead_pin], attached } = bench(&simulation);
    let (clock, config) = (&simulation.clock, Config::default());
    let mut below = Vl53l3cx::new(bus.clone(), NoXshut, &boot, BELOW, clock.clone(), config);
    let mut ahead = Vl53l3cx::new(bus, ahead_pin, &boot, AHEAD, clock.clone(), config);
    for _ in 0..3 {
        block_on(clock, below.next()).expect("a measurement");
    }
    block_on(clock, ahead.next()).expect("a measurement");
    assert!(block_on(clock, below.next()).expect("a measurement").data.valid);
    // Already moved, and reset at its new address.
    assert_eq!(block_on(clock, below.self_test()), Ok(()));
    assert_eq!(registers(&attached[0], 0x0001), [BELOW]);
    assert!(block_on(clock, ahead.next()).is_ok(), "notices nothing");
    attached[0].reset();
    assert_eq!(block_on(clock, below.next()), Err(ChipError::Restarted));
    assert!(block_on(clock, below.next()).is_ok());
    assert_eq!(registers(&attached[0], 0x0001), [BELOW]);
}

#[test]
fn a_chip_wakes_between_the_transfers_of_a_bus_that_is_never_quiet() {
    for phase in 0..20 {
        let simulation = standing();
        let Bench { bus, pins: [pin, mut asleep], .. } = bench(&simulation);
        asleep.set_low().expect("a pin");
        bus.attach(0x76, chips::Bmp280::new(&simulation.world, &simulation.clock, 1));
        let mut shared = SharedI2c::<_, 2>::new(bus);
        let ([mut greedy, range], _) = shared.split();
        let (boot, clock) = (BootAddress::new(), simulation.clock.clone());
        let mut below = Vl53l3cx::new(range, pin, &boot, BELOW, clock.clone(), Config::default());
        let outcome = RefCell::new(None);
        let mut tasks = Tasks::new(clock.clone());
        let timer = clock.clone();
        tasks.spawn(async move {
            timer.sleep_until(timer.now() + Duration::from_micros(2_000 + 7 * phase)).await;
            loop {
                let mut bytes = [0; 10];
                greedy.write_read(0x76, &[0xF3], &mut bytes).await.expect("it has started");
            }
        });
        tasks.spawn(async { *outcome.borrow_mut() = Some(below.start().await) });
        tasks.run_until(clock.now() + Duration::from_secs(1));
        drop(tasks);
        assert_eq!(outcome.into_inner(), Some(Ok(())), "phase {phase}");
    }
}
