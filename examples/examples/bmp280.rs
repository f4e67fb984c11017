//! The driver of the barometer, on an emulated chip: the vehicle stands, then climbs by two metres.

mod emulated;

use emulated::{Hand, Terminal};
use examples::drivers::{Failure, bmp280};
use stampfly_drivers::chip::ChipError;
use stampfly_sim::chips::BusError;
use stampfly_sim::time::block_on;

fn main() -> Result<(), Failure<ChipError<BusError>>> {
    let (simulation, mut board, _) = emulated::vehicle(None);
    let script = |time: f64| {
        let climb = if time < 4.0 { 0.8 } else { 0.0 };
        (time > 1.5).then_some(Hand { climb, ..Hand::default() })
    };
    let clock = simulation.clock.clone();
    block_on(&clock, bmp280::self_test(&mut board.i2c, clock.clone(), &mut Terminal))?;
    let found = emulated::run(&simulation, script, bmp280::run(board.i2c, clock, &mut Terminal))?;

    let truth = -simulation.truth().position.z;
    println!("in truth it is {truth:.2} m above the floor");
    assert!(truth > 1.5 && (found.height - truth).abs() < 0.5, "the height is off by more than 0.5 m: {found:?}");
    assert!((found.rate - 25.0).abs() < 1.0, "not the rate the driver was told: {found:?}");
    assert!((0.001..0.3).contains(&found.noise), "an impossible noise: {found:?}");
    assert!((95_000.0..105_000.0).contains(&found.pressure), "an impossible pressure: {found:?}");
    Ok(())
}
