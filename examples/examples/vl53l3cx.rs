//! The driver of the range finders, on two emulated chips of one bus: the vehicle climbs, and in between its nose goes
//! down, so that the one that looks ahead sees the floor.

mod emulated;

use emulated::{Hand, Terminal};
use examples::drivers::{Failure, vl53l3cx};
use stampfly_drivers::chip::ChipError;
use stampfly_sim::chips::BusError;
use stampfly_sim::plant::Pose;

fn main() -> Result<(), Failure<ChipError<BusError>>> {
    let (simulation, board, _) = emulated::vehicle(Some(Pose::hovering(0.3)));
    let script = |time: f64| {
        let pitch = if (2.0..2.7).contains(&time) { -0.7 } else { 0.0 };
        Some(Hand { climb: if time < 2.0 { 0.1 } else { 0.3 }, pitch, ..Hand::default() })
    };
    let (mut buses, mut pins) = ([board.i2c.clone(), board.i2c], [board.shutdown_bottom, board.shutdown_front]);
    let clock = simulation.clock.clone();
    // The self test in flight, too: meanwhile nobody else would hold the vehicle.
    let example = async {
        vl53l3cx::self_test(buses.each_mut(), pins.each_mut(), clock.clone(), &mut Terminal).await?;
        vl53l3cx::run(buses, pins, clock, &mut Terminal).await
    };
    let found = emulated::run(&simulation, script, example)?;

    let truth = -simulation.truth().position.z;
    println!("in truth it is {truth:.2} m above the floor");
    let [below, before] = found.distance;
    assert!(below.is_some_and(|below| (below - truth).abs() < 0.06), "the height is another: {found:?}");
    assert!(before.is_none(), "there is nothing ahead: {found:?}");
    let [below, before] = found.seen;
    assert!(below > 140 && (5..80).contains(&before), "one saw too little or the other too much: {found:?}");
    assert!((found.rate - 30.0).abs() < 1.5, "the chip's clock is within a few per cent: {found:?}");
    Ok(())
}
