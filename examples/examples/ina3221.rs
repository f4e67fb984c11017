//! The driver of the battery monitor, on an emulated chip: the vehicle stands, flies and drops.

mod emulated;

use emulated::{Hand, Terminal};
use examples::drivers::{Failure, ina3221};
use stampfly_drivers::chip::ChipError;
use stampfly_sim::chips::BusError;
use stampfly_sim::time::block_on;

fn main() -> Result<(), Failure<ChipError<BusError>>> {
    let (simulation, mut board, _) = emulated::vehicle(None);
    let before = simulation.truth();
    let script = |time: f64| match time {
        0.0..1.5 => None,
        ..2.5 => Some(Hand { climb: 0.4, ..Hand::default() }),
        ..3.3 => Some(Hand { climb: -0.2, ..Hand::default() }),
        _ => None,
    };
    let clock = simulation.clock.clone();
    block_on(&clock, ina3221::self_test(&mut board.i2c, clock.clone(), &mut Terminal))?;
    let found = emulated::run(&simulation, script, ina3221::run(board.i2c, clock, &mut Terminal))?;

    let after = simulation.truth();
    println!("in truth it was {:.2} V before and is {:.2} V now", before.battery_voltage, after.battery_voltage);
    let [low, high] = found.voltage;
    assert!((high - before.battery_voltage).abs() < 0.05, "the battery's voltage at rest is another: {found:?}");
    assert!(low < high - 0.1, "the battery does not give way under load: {found:?}");
    let [least, most] = found.current;
    assert!(least < 0.3 && (1.5..8.0).contains(&most), "these are not the motors' currents: {found:?}");
    assert!((1.0..20.0).contains(&found.charge), "this is not a flight of two seconds: {found:?}");
    Ok(())
}
