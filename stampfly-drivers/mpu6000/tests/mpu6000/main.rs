//! Tests of the MPU-6000 driver on the emulated chip: start, samples, bus faults, restarts, dropped
//! calls.

mod another_driver;

use core::cell::RefCell;
use core::future::Future;
use core::pin::pin;
use core::task::{Context, Waker};
use embedded_hal::spi;
use stampfly_mpu6000::blocking::{self, Blocking, BlockingClock};
use stampfly_mpu6000::{
    AccelRange, Axis, AxisMap, BusClock, ChipError, Config, Duration, Filter, GyroRange, Imu, Instant, Mpu6000,
    SensorError, SensorErrorKind,
};
use stampfly_sim::chips::{self, Attached, BusError, Faults, Flaw, SpiBus, SpiPort};
use stampfly_sim::plant::WindConfig;
use stampfly_sim::time::{Clock, block_on};
use stampfly_sim::{Simulation, SimulationConfig};
use std::rc::Rc;

type Port = SpiPort<chips::Mpu6000>;
type Driver = Mpu6000<Port, Clock, fn(&mut Port, BusClock)>;

/// The chip's x axis points right, y forward, z up.
const AXES: AxisMap = AxisMap::new(Axis::PlusY, Axis::PlusX, Axis::MinusZ).expect("a rotation");

struct Bench {
    _simulation: Simulation,
    clock: Clock,
    bus: SpiBus,
    attached: Attached,
    imu: Driver,
}

fn chip() -> (Simulation, SpiBus, Port, Attached) {
    let simulation = Simulation::new(&SimulationConfig { wind: WindConfig::CALM, ..SimulationConfig::example() });
    let bus = SpiBus::new(&simulation.clock, 1);
    let chip = chips::Mpu6000::new(&simulation.world, &simulation.clock, 1, 0.0);
    let (port, attached) = bus.attach(1_000_000, chip);
    (simulation, bus, port, attached)
}

fn set(port: &mut Port, clock: BusClock) {
    port.set_frequency(match clock {
        BusClock::Setup => 1_000_000,
        BusClock::Data => 20_000_000,
    });
}

fn bench(config: Config) -> Bench {
    let (simulation, bus, port, attached) = chip();
    let clock = simulation.clock.clone();
    let imu = Mpu6000::new(port, clock.clone(), AXES, config).with_bus_clock(set as fn(&mut Port, BusClock));
    Bench { _simulation: simulation, clock, bus, attached, imu }
}

impl Bench {
    fn run<T>(&mut self, call: impl AsyncFnOnce(&mut Driver) -> T) -> T {
        block_on(&self.clock, call(&mut self.imu))
    }

    fn started() -> Self {
        let mut bench = bench(Config::default());
        bench.run(async |imu| imu.start().await).expect("it starts");
        bench
    }

    fn next(&mut self) -> Result<stampfly_mpu6000::Sample<stampfly_mpu6000::ImuData>, ChipError<BusError>> {
        self.run(async |imu| imu.next().await)
    }
}

#[test]
fn it_resets_the_chip_and_tells_it_what_the_configuration_says() {
    let mut bench = bench(Config::default());
    let analyser = bench.bus.analyse();
    bench.run(async |imu| imu.start().await).expect("it starts");
    let writes: Vec<(u8, u8)> = analyser
        .take()
        .into_iter()
        .filter_map(|seen| match seen {
            chips::Seen::Transfer { wrote, .. } if wrote[0] & 0x80 == 0 => Some((wrote[0], wrote[1])),
            _ => None,
        })
        .collect();
    assert_eq!(writes, [(0x6B, 0x80), (0x68, 0x07), (0x6A, 0x10), (0x6B, 0x03), (0x19, 0x00)]);
    for (register, value) in [(0x6B, 0x03), (0x6A, 0x10), (0x19, 0), (0x1A, 0), (0x1B, 0x18), (0x1C, 0x18)] {
        assert_eq!(bench.attached.peek(register), value, "{register:#04x}");
    }
    let took = bench.clock.now().as_micros();
    assert!((355_000..357_000).contains(&took), "{took}");
    let config = Config {
        accel_range: AccelRange::G4,
        gyro_range: GyroRange::Dps500,
        filter: Filter::Hz42,
        divider: 4,
        interval: Duration::from_millis(5),
    };
    let mut bench = self::bench(config);
    bench.run(async |imu| imu.start().await).expect("it starts");
    assert_eq!([0x19, 0x1A, 0x1B, 0x1C].map(|register| bench.attached.peek(register)), [4, 3, 0x08, 0x08]);
}

#[test]
fn samples_come_4000_times_a_second_in_si_units_and_body_axes_and_the_accelerometers_four_times_each() {
    let mut bench = Bench::started();
    let first = bench.next().expect("a sample");
    let (mut before, mut repeated) = (first, 0);
    let (mut accel, mut gyro) = (first.data.accel, first.data.gyro);
    for _ in 1..4_000 {
        let sample = bench.next().expect("a sample");
        let step = sample.at.since(before.at).as_micros();
        assert!((245..=255).contains(&step), "{step}");
        repeated += u32::from(sample.data.accel == before.data.accel);
        accel += sample.data.accel;
        gyro += sample.data.gyro;
        before = sample;
    }
    assert!((2_980..=3_050).contains(&repeated), "three of four: {repeated}");
    assert!((before.at.since(first.at).seconds() - 0.999_75).abs() < 1e-4);
    let (accel, gyro) = (accel / 4_000.0, gyro / 4_000.0);
    // Offsets of 50 and 80 mg, 3 % of scale; of 20 °/s.
    assert!(accel.x.abs() < 0.5 && accel.y.abs() < 0.5 && (accel.z + 9.81).abs() < 1.1, "{accel}");
    assert!(gyro.norm() < 0.61, "{gyro}");
    assert!((before.data.temperature - 25.0).abs() < 1.0 && before.data.accel_peak == 0.0);
}

#[test]
fn every_range_gives_the_same() {
    let mut found = Vec::new();
    for (accel_range, gyro_range) in [
        (AccelRange::G2, GyroRange::Dps250),
        (AccelRange::G4, GyroRange::Dps500),
        (AccelRange::G8, GyroRange::Dps1000),
        (AccelRange::G16, GyroRange::Dps2000),
    ] {
        let config = Config { accel_range, gyro_range, filter: Filter::Hz5, ..Config::default() };
        let mut bench = bench(Config { interval: Duration::from_millis(10), ..config });
        for _ in 0..30 {
            bench.next().expect("a sample");
        }
        found.push(bench.next().expect("a sample").data);
    }
    for pair in found.windows(2) {
        assert!(
            (pair[0].accel - pair[1].accel).norm() < 0.05 && (pair[0].gyro - pair[1].gyro).norm() < 0.01,
            "{pair:?}"
        );
    }
}

#[test]
fn an_interval_that_the_filter_does_not_allow_is_refused_before_anything_is_sent() {
    let mut bench = bench(Config { interval: Duration::from_micros(2_500), ..Config::default() });
    assert_eq!(bench.next(), Err(ChipError::InvalidConfiguration));
    assert_eq!(bench.clock.now(), Instant::ZERO);
}

#[test]
fn it_works_on_one_slow_clock_and_not_on_one_fast_one() {
    let (simulation, _, port, _) = chip();
    let clock = simulation.clock.clone();
    let mut imu = Mpu6000::new(port, clock.clone(), AXES, Config::default());
    for _ in 0..100 {
        block_on(&clock, imu.next()).expect("a sample");
    }
    let (mut port, _) = imu.release();
    port.set_frequency(20_000_000);
    let mut imu = Mpu6000::new(port, clock.clone(), AXES, Config::default());
    let refused = block_on(&clock, imu.next()).expect_err("settings at 20 MHz");
    assert_eq!(refused, ChipError::Identification { found: 0xFF });
}

#[test]
fn another_part_and_nobody_are_told_apart() {
    let mut bench = bench(Config::default());
    bench.attached.set_id(0x70);
    assert_eq!(bench.next(), Err(ChipError::Identification { found: 0x70 }), "an MPU-6500");
    bench.attached.set_faults(Faults { dead: true, ..Faults::default() });
    assert_eq!(bench.next().expect_err("nobody").kind(), SensorErrorKind::Absent);
    bench.attached.set_faults(Faults::default());
    bench.attached.set_id(0x68);
    bench.next().expect("it is back");
}

#[test]
fn a_chip_that_restarts_in_flight_says_so_once_and_its_zeros_are_no_sample() {
    let mut bench = Bench::started();
    for deaf in [0, 100_000] {
        bench.next().expect("a sample");
        bench.attached.reset();
        bench.clock.advance_to(bench.clock.now() + Duration::from_micros(deaf));
        assert_eq!(bench.next(), Err(ChipError::Restarted));
        bench.next().expect("set up again");
    }
}

/// A port to which the test has access as well.
#[derive(Clone)]
struct Shared(Rc<RefCell<Port>>);

impl spi::ErrorType for Shared {
    type Error = BusError;
}

impl spi::SpiDevice for Shared {
    fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), BusError> {
        self.0.borrow_mut().transaction(operations)
    }
}

#[test]
fn a_chip_that_lost_a_range_is_noticed_within_a_second() {
    let (simulation, _, port, attached) = chip();
    let clock = simulation.clock.clone();
    let time = clock.clone();
    let timebase = BlockingClock::new(clock.clone(), move || time.now());
    let mut port = Shared(Rc::new(RefCell::new(port)));
    let mut imu = Mpu6000::new(Blocking(port.clone()), timebase, AXES, Config::default());
    blocking::block_on(imu.next()).expect("a sample");
    spi::SpiDevice::write(&mut port, &[0x1C, 0x00]).expect("a transfer");
    let begin = clock.now();
    let error = loop {
        if let Err(error) = blocking::block_on(imu.next()) {
            break error;
        }
    };
    assert_eq!(error, ChipError::Restarted);
    assert!(clock.now().since(begin) <= Duration::from_millis(1_001));
    blocking::block_on(imu.next()).expect("set up again");
    assert_eq!(attached.peek(0x1C), 0x18);
}

#[test]
fn a_chip_that_stays_asleep_is_asked_again_and_given_up_after_five_times() {
    for (requests, starts) in [(1, true), (4, true), (5, false)] {
        let mut bench = bench(Config::default());
        bench.attached.set_flaw(Some(Flaw::Sleepy(requests)));
        let started = bench.run(async |imu| imu.start().await);
        assert_eq!(started, if starts { Ok(()) } else { Err(ChipError::Configuration { status: 0x40 }) });
    }
}

#[test]
fn values_that_do_not_change_are_no_samples_after_a_fifth_of_a_second() {
    let mut bench = Bench::started();
    bench.next().expect("a sample");
    bench.attached.set_flaw(Some(Flaw::Stuck));
    let begin = bench.clock.now();
    let error = loop {
        if let Err(error) = bench.next() {
            break error;
        }
    };
    let took = bench.clock.now().since(begin).as_micros();
    assert!(error == ChipError::NoSample && (199_000..202_000).contains(&took), "{error} {took}");
    bench.attached.set_flaw(None);
    bench.next().expect("set up again");
}

#[test]
fn a_line_that_is_stuck_makes_no_samples() {
    for high in [false, true] {
        let mut bench = Bench::started();
        bench.next().expect("a sample");
        bench.bus.hold_miso(Some(high));
        assert_eq!(bench.next(), Err(if high { ChipError::Data } else { ChipError::Restarted }));
        assert_eq!(bench.next().expect_err("nobody").kind(), SensorErrorKind::Absent);
        bench.bus.hold_miso(None);
        bench.next().expect("it is back");
    }
}

#[test]
fn transfers_that_fail_are_errors_of_the_bus_and_cost_one_sample_each() {
    let mut bench = Bench::started();
    bench.next().expect("a sample");
    bench.attached.set_faults(Faults { refusals: 1.0, ..Faults::default() });
    assert_eq!(bench.next(), Err(ChipError::Bus(BusError::Overrun)));
    bench.attached.set_faults(Faults::default());
    let before = bench.clock.now();
    bench.next().expect("the next one");
    assert!(bench.clock.now().since(before).as_micros() < 300);
}

#[test]
fn the_self_test_passes_and_fails_with_a_sensor_that_does_not_move() {
    let mut bench = bench(Config::default());
    bench.run(async |imu| imu.self_test().await).expect("a good chip");
    bench.attached.set_broken(true);
    let failed = bench.run(async |imu| imu.self_test().await);
    // The chip answers, but its proof masses do not respond.
    assert_eq!(failed, Err(ChipError::SelfTest));
    bench.attached.set_broken(false);
    bench.next().expect("set up again");
    assert_eq!((bench.attached.peek(0x1B), bench.attached.peek(0x1C)), (0x18, 0x18));
}

#[test]
fn a_reader_that_comes_late_gets_the_newest_and_goes_on_from_there() {
    let mut bench = Bench::started();
    bench.next().expect("a sample");
    bench.clock.advance_to(bench.clock.now() + Duration::from_millis(30));
    let before = bench.clock.now();
    let late = bench.next().expect("a sample");
    assert!(late.at.since(before).as_micros() < 10);
    let next = bench.next().expect("a sample");
    assert!((245..=255).contains(&next.at.since(late.at).as_micros()), "no catching up");
}

/// Polls a future this number of times and drops it.
fn drop_after<F: Future>(clock: &Clock, polls: usize, future: F) {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    for _ in 0..polls {
        if future.as_mut().poll(&mut context).is_ready() {
            return;
        }
        clock.advance_to(clock.now() + Duration::from_micros(5_000));
    }
}

#[test]
fn a_start_and_a_sample_may_be_dropped_anywhere() {
    for polls in 1..90 {
        let mut bench = bench(Config::default());
        let clock = bench.clock.clone();
        drop_after(&clock, polls, bench.imu.next());
        bench.next().expect("a sample");
        drop_after(&clock, 1, bench.imu.next());
        bench.next().expect("a sample");
    }
}

#[test]
fn it_works_on_a_blocking_bus() {
    let (simulation, _, port, _) = chip();
    let clock = simulation.clock.clone();
    let time = clock.clone();
    let timebase = BlockingClock::new(clock, move || time.now());
    let mut imu = Mpu6000::new(Blocking(port), timebase, AXES, Config::default());
    for _ in 0..100 {
        let sample = blocking::block_on(imu.next()).expect("a sample");
        assert!((sample.data.accel.z + 9.81).abs() < 1.5);
    }
}
