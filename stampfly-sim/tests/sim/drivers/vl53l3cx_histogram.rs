//! The VL53L3CX's histogram mode on the emulated chip, and the trial of its normal mode.

use super::registers;
use crate::standing;
use stampfly_drivers::chip::ChipError;
use stampfly_drivers::chip::vl53l3cx::{BootAddress, Config, Implausible, NoXshut, RangeFinder, Ranging, Vl53l3cx};
use stampfly_drivers::{Sample, SensorError, SensorErrorKind};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{self, Attached, BusError, Flaw, I2cBus, Nonsense, ShutdownPin};
use stampfly_sim::sensors::Mount;
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::messages::TofData;
use stampfly_types::{Duration, Instant, math};

const ADDRESS: u8 = 0x30;
const AT_TARGET: Ranging = Ranging::Automatic { target: true };
const ANYWHERE: Ranging = Ranging::Automatic { target: false };
const NONSENSE: [(Nonsense, Implausible); 5] = [
    (Nonsense::Silent, Implausible::Silent),
    (Nonsense::Failing, Implausible::Failing),
    (Nonsense::Frozen, Implausible::Frozen),
    (Nonsense::Unseen, Implausible::Unseen),
    (Nonsense::Blind, Implausible::Blind),
];

type Driver<'b> = Vl53l3cx<'b, I2cBus, ShutdownPin, Clock>;
type Outcome = Result<Sample<TofData>, ChipError<BusError>>;

/// A driver of the specimen of this seed, and its chip.
fn driver<'b>(
    simulation: &Simulation,
    boot: &'b BootAddress,
    (seed, mount): (u64, Mount),
    ranging: Ranging,
) -> (Driver<'b>, Attached) {
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let (chip, pin) = chips::Vl53l3cx::new(&simulation.world, &clock, seed, mount);
    let attached = bus.attach(Vl53l3cx::BOOT_ADDRESS, chip);
    let config = Config { ranging, ..Config::default() };
    (Vl53l3cx::new(bus, pin, boot, ADDRESS, clock, config), attached)
}

fn several(driver: &mut Driver<'_>, clock: &Clock, count: usize) -> Vec<Outcome> {
    (0..count).map(|_| block_on(clock, driver.next())).collect()
}

fn valid(outcomes: &[Outcome]) -> Vec<TofData> {
    outcomes.iter().filter_map(|outcome| outcome.ok()).map(|sample| sample.data).filter(|data| data.valid).collect()
}

/// Mean and standard deviation.
fn spread(values: impl Iterator<Item = f32> + Clone) -> (f32, f32) {
    let count = values.clone().count() as f32;
    let mean = values.clone().sum::<f32>() / count;
    (mean, math::sqrt(values.map(|value| (value - mean) * (value - mean)).sum::<f32>() / count))
}

#[test]
fn every_distance_within_reach_is_measured_and_its_noise_is_known() {
    for (metres, seed) in [0.03, 0.05, 0.1, 0.2, 0.4, 0.8, 1.3, 2.0, 2.6, 3.1].into_iter().zip(1..) {
        let (simulation, boot) = (standing(), BootAddress::new());
        let (mut below, chip) = driver(&simulation, &boot, (seed, Mount::Bottom), Ranging::Histogram);
        chip.set_flaw(Some(Flaw::Covered(metres)));
        let outcomes = several(&mut below, &simulation.clock, 402);
        let data = valid(&outcomes);
        assert!(data.len() >= 395, "{} at {metres} m: {:?}", data.len(), outcomes[3]);
        assert!(!outcomes[0].as_ref().expect("a sample").data.valid, "the first is not vouched for");
        let (mean, deviation) = spread(data.iter().map(|data| data.distance));
        let (said, _) = spread(data.iter().map(|data| data.sigma));
        // Four standard deviations of the mean, and a hundredth of a bin for the reference pulse.
        assert!((mean - metres as f32).abs() < 4.0 * deviation / 20.0 + 0.002, "{mean} m at {metres} m");
        assert!((0.7..1.5).contains(&(said / deviation)), "{said} m is said, {deviation} m is, at {metres} m");
    }
}

#[test]
fn what_is_out_of_reach_is_never_taken_for_something_near() {
    // 3.97 m and 4.76 m correspond to the laser periods: a target at one or two of them appears at
    // zero in one part.
    for centimetres in (330..1_000).step_by(13) {
        let (simulation, boot) = (standing(), BootAddress::new());
        let (mut below, chip) = driver(&simulation, &boot, (7, Mount::Bottom), Ranging::Histogram);
        chip.set_flaw(Some(Flaw::Covered(f64::from(centimetres) / 100.0)));
        let outcomes = several(&mut below, &simulation.clock, 12);
        assert_eq!(valid(&outcomes), [], "{centimetres} cm");
        assert!(outcomes.iter().all(Result::is_ok), "it is measured all the same");
    }
}

#[test]
fn nonsense_of_the_light_mode_is_noticed_and_the_distance_is_right_within_a_second() {
    for (nonsense, reason) in NONSENSE {
        let (simulation, boot) = (standing(), BootAddress::new());
        let (mut below, chip) = driver(&simulation, &boot, (3, Mount::Bottom), AT_TARGET);
        chip.set_flaw(Some(Flaw::LightMode(nonsense)));
        assert_eq!((below.ranging(), below.doubt()), (Ranging::Light, None));
        let begun = simulation.clock.now();
        let said = loop {
            match block_on(&simulation.clock, below.next()) {
                Err(ChipError::Implausible) => break ChipError::<BusError>::Implausible,
                Err(ChipError::NoSample) if nonsense == Nonsense::Silent => {}
                outcome => assert!(outcome.is_ok(), "{outcome:?}"),
            }
        };
        assert_eq!(said.kind(), SensorErrorKind::Implausible);
        assert_eq!((below.ranging(), below.doubt()), (Ranging::Histogram, Some(reason)));
        let data = loop {
            let data = block_on(&simulation.clock, below.next()).expect("a sample").data;
            if data.valid {
                break data;
            }
        };
        let took = simulation.clock.now().since(begun);
        assert!(took < Duration::from_millis(800), "{nonsense:?}: {took}");
        assert!((data.distance - 0.03).abs() < 0.012, "{nonsense:?}: it stands on the floor, {data:?}");
        let after = several(&mut below, &simulation.clock, 100);
        assert_eq!(valid(&after).len(), 100, "{nonsense:?}");
    }
}

#[test]
fn without_the_second_way_nonsense_stays_nonsense() {
    for (nonsense, _) in NONSENSE {
        let (simulation, boot) = (standing(), BootAddress::new());
        let (mut below, chip) = driver(&simulation, &boot, (3, Mount::Bottom), Ranging::Light);
        chip.set_flaw(Some(Flaw::LightMode(nonsense)));
        let right = valid(&several(&mut below, &simulation.clock, 60))
            .iter()
            .filter(|data| (data.distance - 0.03).abs() < 0.012)
            .count();
        assert_eq!((right, below.ranging(), below.doubt()), (0, Ranging::Light, None), "{nonsense:?}");
    }
}

#[test]
fn a_chip_that_ranges_by_itself_is_not_asked_anything_else() {
    for mount in [Mount::Bottom, Mount::Front] {
        let run = |ranging| {
            let (simulation, boot) = (standing(), BootAddress::new());
            let (mut driver, _) = driver(&simulation, &boot, (5, mount), ranging);
            let outcomes = several(&mut driver, &simulation.clock, 200);
            assert_eq!((driver.ranging(), driver.doubt()), (Ranging::Light, None));
            (outcomes, simulation.clock.now())
        };
        // Sample by sample, to the microsecond.
        assert_eq!(run(Ranging::Light), run(ANYWHERE), "{mount:?}");
    }
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut below, _) = driver(&simulation, &boot, (5, Mount::Bottom), AT_TARGET);
    assert!(several(&mut below, &simulation.clock, 200).iter().all(Result::is_ok));
    assert_eq!(below.ranging(), Ranging::Light);
}

#[test]
fn where_neither_way_sees_anything_the_light_mode_stays() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut ahead, _) = driver(&simulation, &boot, (5, Mount::Front), AT_TARGET);
    let outcomes = several(&mut ahead, &simulation.clock, 300);
    let changes: Vec<_> = (0..300).filter(|n| outcomes[*n].is_err()).collect();
    assert_eq!(changes.len(), 2, "there and back: {changes:?}");
    assert!(changes[1] < 27, "settled in the first 24 measurements: {changes:?}");
    assert_eq!([0, 1].map(|n| outcomes[changes[n]]), [Err(ChipError::Implausible), Err(ChipError::SelfTest)]);
    assert_eq!((ahead.ranging(), ahead.doubt()), (Ranging::Light, Some(Implausible::Blind)));
}

#[test]
fn what_has_been_settled_is_not_asked_again() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut below, chip) = driver(&simulation, &boot, (3, Mount::Bottom), AT_TARGET);
    several(&mut below, &simulation.clock, 30);
    // In flight the chip's own distances fail, then it restarts: neither changes the method of
    // ranging.
    chip.set_flaw(Some(Flaw::LightMode(Nonsense::Frozen)));
    several(&mut below, &simulation.clock, 60);
    chip.reset();
    let after = several(&mut below, &simulation.clock, 60);
    assert_eq!(after.iter().filter(|outcome| outcome.is_err()).count(), 1, "it restarted");
    assert_eq!((below.ranging(), below.doubt()), (Ranging::Light, None));
}

#[test]
fn a_chip_that_restarts_goes_on_with_histograms() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut below, chip) = driver(&simulation, &boot, (3, Mount::Bottom), AT_TARGET);
    chip.set_flaw(Some(Flaw::LightMode(Nonsense::Blind)));
    several(&mut below, &simulation.clock, 40);
    assert_eq!(below.ranging(), Ranging::Histogram);
    chip.reset();
    let outcomes = several(&mut below, &simulation.clock, 10);
    assert_eq!(outcomes[0], Err(ChipError::Restarted));
    assert_eq!(valid(&outcomes).len(), 8, "{outcomes:?}");
    assert_eq!(below.ranging(), Ranging::Histogram);
}

#[test]
fn it_is_set_up_as_st_sets_it_up() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut below, chip) = driver(&simulation, &boot, (3, Mount::Bottom), Ranging::Histogram);
    block_on(&simulation.clock, below.next()).expect("it measures");
    assert_eq!(registers(&chip, 0x0001), [ADDRESS]);
    assert_eq!(registers(&chip, 0x0470), [1], "the patch acts");
    assert_eq!(registers(&chip, 0x0472), [0, 7, 0, 7, 0x29, 0xC9, 0x0E, 0x40, 0x28, 0]);
    assert_eq!(registers(&chip, 0x0496), [3, 0x6D, 3, 0x6F, 7, 0x29]);
    assert_eq!(registers(&chip, 0x0024), [0x14, 0], "40 Mcps");
    assert_eq!([0x0060, 0x0063].map(|register| chip.peek(register)), [9, 11], "periods of 20 and 24 bins");
    assert_eq!([0x0046, 0x0030, 0x0083, 0x0085, 0x0087].map(|register| chip.peek(register)), [0x20, 1, 1, 1, 0x26]);
}

#[test]
fn samples_come_in_time_and_are_stamped_in_the_middle() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut below, _) = driver(&simulation, &boot, (3, Mount::Bottom), Ranging::Histogram);
    let clock = &simulation.clock;
    let begun = clock.now();
    block_on(clock, below.next()).expect("a measurement");
    let took = clock.now().since(begun);
    assert!(took < Duration::from_millis(100), "{took} to the first");
    let (mut stamps, mut ages) = (Vec::new(), Vec::new());
    for _ in 0..60 {
        let at = block_on(clock, below.next()).expect("a measurement").at;
        stamps.push(at);
        ages.push(clock.now().since(at).seconds());
    }
    let mean = stamps[59].since(stamps[0]).seconds() / 59.0;
    // 33 ms, plus the transfers in between.
    assert!((0.033..0.0405).contains(&mean), "{mean} s between samples");
    // Half a measurement, a read of 2 ms, and up to 2 ms between two polls.
    assert!(ages.iter().all(|age| (0.0165..0.0215).contains(age)), "{ages:?}");
}

#[test]
fn its_self_test_tells_a_broken_chip() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut below, chip) = driver(&simulation, &boot, (3, Mount::Bottom), Ranging::Histogram);
    assert_eq!(block_on(&simulation.clock, below.self_test()), Ok(()));
    chip.set_broken(true);
    assert_eq!(block_on(&simulation.clock, below.self_test()), Err(ChipError::SelfTest));
}

#[test]
fn a_call_dropped_anywhere_leaves_the_next_one_right() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut below, chip) = driver(&simulation, &boot, (3, Mount::Bottom), Ranging::Histogram);
    chip.set_flaw(Some(Flaw::Covered(0.7)));
    let clock = &simulation.clock;
    for after in (100..90_000).step_by(1_370) {
        let mut tasks = stampfly_sim::time::Tasks::new(clock.clone());
        tasks.spawn(async { _ = below.next().await });
        tasks.run_until(clock.now() + Duration::from_micros(after));
        drop(tasks);
        let outcomes = several(&mut below, clock, 3);
        let right = valid(&outcomes).iter().filter(|data| (data.distance - 0.7).abs() < 0.015).count();
        assert!(right >= 1 && right == valid(&outcomes).len(), "after {after} µs: {outcomes:?}");
    }
}

#[test]
fn one_that_nobody_came_for_is_not_delivered() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let (mut below, chip) = driver(&simulation, &boot, (3, Mount::Bottom), Ranging::Histogram);
    let clock = &simulation.clock;
    chip.set_flaw(Some(Flaw::Covered(0.7)));
    several(&mut below, clock, 3);
    clock.advance_to(clock.now() + Duration::from_secs(1));
    chip.set_flaw(Some(Flaw::Covered(0.6)));
    let asked = clock.now();
    let sample = block_on(clock, below.next()).expect("a measurement");
    assert!(sample.at > asked && (sample.data.distance - 0.6).abs() < 0.015, "{sample:?}");
}

#[test]
fn without_a_pin_it_changes_as_well() {
    let (simulation, boot) = (standing(), BootAddress::new());
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let (chip, _pin) = chips::Vl53l3cx::new(&simulation.world, &clock, 3, Mount::Bottom);
    bus.attach(Vl53l3cx::BOOT_ADDRESS, chip).set_flaw(Some(Flaw::LightMode(Nonsense::Unseen)));
    let config = Config { ranging: ANYWHERE, ..Config::default() };
    let mut below = Vl53l3cx::new(bus, NoXshut, &boot, ADDRESS, clock.clone(), config);
    let last = (0..30).map(|_| block_on(&clock, below.next())).last().expect("thirty");
    assert!(last.is_ok_and(|sample| sample.data.valid && (sample.data.distance - 0.03).abs() < 0.012), "{last:?}");
    assert!(clock.now() < Instant::from_secs(3));
}
