//! Two chips on one bus: faults of one do not affect the other.

use crate::standing;
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::ina3221::{self, Ina3221};
use stampfly_drivers::{Barometer, PowerMonitor, SensorError, SensorErrorKind};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{self, Attached, Faults, I2cBus};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Duration;

/// A vehicle on the floor in still air, with barometer and battery monitor on one bus.
struct Bench {
    simulation: Simulation,
    clock: Clock,
    barometer: Attached,
    monitor: Attached,
    baro: Bmp280<stampfly_drivers::chip::I2cRegisters<I2cBus>, Clock>,
    power: Ina3221<stampfly_drivers::chip::I2cRegisters<I2cBus>, Clock>,
}

fn bench() -> Bench {
    let simulation = standing();
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let barometer = bus.attach(Bmp280::SDO_LOW, chips::Bmp280::new(&simulation.world, &clock, 1));
    let monitor = bus.attach(Ina3221::A0_GROUND, chips::Ina3221::new(&simulation.world, &clock, 1));
    // Both start up within 2 ms.
    clock.advance_to(clock.now() + Duration::from_millis(5));
    let baro = Bmp280::i2c(bus.clone(), Bmp280::SDO_LOW, clock.clone(), bmp280::Config::default());
    let power = Ina3221::new(bus, Ina3221::A0_GROUND, clock.clone(), ina3221::Config::default());
    Bench { simulation, clock, barometer, monitor, baro, power }
}

impl Bench {
    fn pressure(&mut self) -> Result<f32, SensorErrorKind> {
        let sample = block_on(&self.clock, self.baro.next());
        sample.map(|sample| sample.data.pressure).map_err(|error| error.kind())
    }

    fn voltage(&mut self) -> Result<f32, SensorErrorKind> {
        let sample = block_on(&self.clock, self.power.next());
        sample.map(|sample| sample.data.voltage).map_err(|error| error.kind())
    }

    /// Duration and result of a call.
    fn timed<T>(&mut self, call: impl FnOnce(&mut Self) -> T) -> (Duration, T) {
        let begun = self.clock.now();
        let outcome = call(self);
        (self.clock.now().since(begun), outcome)
    }
}

#[test]
fn both_measure_what_is_there() {
    let mut bench = bench();
    let pressures: Vec<f32> = (0..20).map(|_| bench.pressure().unwrap()).collect();
    let (low, high) = pressures.iter().fold((f32::MAX, f32::MIN), |(low, high), p| (low.min(*p), high.max(*p)));
    // At rest near sea level, with weather and the chip's offset; noise of some pascals.
    assert!((99_000.0..104_000.0).contains(&low) && high - low < 20.0, "{low} to {high} Pa");
    let truth = bench.simulation.truth().battery_voltage;
    let measured = bench.voltage().unwrap();
    assert!((measured - truth).abs() < 0.05, "{measured} V, {truth} V in truth");
}

#[test]
fn a_dead_chip_is_an_error_in_time_and_nobody_elses_business() {
    let mut bench = bench();
    assert!(bench.pressure().is_ok() && bench.voltage().is_ok());
    bench.barometer.set_faults(Faults { dead: true, ..Faults::default() });
    for _ in 0..3 {
        let (time, outcome) = bench.timed(Bench::pressure);
        assert!(outcome.is_err() && time < Duration::from_millis(200), "{outcome:?} after {time:?}");
        assert!(bench.voltage().is_ok(), "the neighbour goes on");
    }
    bench.barometer.set_faults(Faults::default());
    let back = (0..5).find(|_| bench.pressure().is_ok());
    assert!(back.is_some(), "it comes back without a restart of the program");
}

#[test]
fn a_chip_that_restarts_is_set_up_again() {
    let mut bench = bench();
    assert!(bench.pressure().is_ok() && bench.voltage().is_ok());
    bench.monitor.reset();
    bench.barometer.reset();
    let after: Vec<_> = (0..6).map(|_| (bench.pressure(), bench.voltage())).collect();
    assert!(after[3..].iter().all(|(pressure, voltage)| pressure.is_ok() && voltage.is_ok()), "{after:?}");
}

#[test]
fn another_part_is_refused() {
    let mut bench = bench();
    bench.barometer.set_id(0x55);
    assert!(bench.pressure().is_err() && bench.voltage().is_ok());
}
