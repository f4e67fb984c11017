//! The driver of the magnetometer, on an emulated chip: the vehicle hovers, turns around once and looks to the east.

mod emulated;

use core::f32::consts::{PI, TAU};
use emulated::{Hand, Terminal};
use examples::drivers::{Failure, bmm150};
use stampfly_drivers::chip::ChipError;
use stampfly_sim::chips::BusError;
use stampfly_sim::plant::Pose;
use stampfly_sim::time::block_on;
use stampfly_types::frame;

/// Where the simulated field's horizontal part points to: 8° west of north, with 31 µT.
const DECLINATION: f32 = -0.139;
const HORIZONTAL: f32 = 31.1;

fn main() -> Result<(), Failure<ChipError<BusError>>> {
    let (simulation, mut board, _) = emulated::vehicle(Some(Pose::hovering(1.0)));
    let script = |time: f64| {
        let turn = if time < 5.5 { 1.43 } else { 0.0 };
        Some(Hand { turn, ..Hand::default() })
    };
    let clock = simulation.clock.clone();
    block_on(&clock, bmm150::self_test(&mut board.i2c, clock.clone(), &mut Terminal))?;
    let found = emulated::run(&simulation, script, bmm150::run(board.i2c, clock, &mut Terminal))?;

    let truth = frame::yaw(&simulation.truth().attitude) - DECLINATION;
    println!("in truth its nose is at {:.0}° from magnetic north", truth.to_degrees());
    let off = (found.heading - truth + PI).rem_euclid(TAU) - PI;
    // The motors' field flickers with their current.
    assert!(off.abs() < 0.35, "the heading is off by {off} rad: {found:?}");
    assert!((found.horizontal - HORIZONTAL).abs() < 4.0, "this is not the simulated field: {found:?}");
    assert!((found.rate - 25.0).abs() < 1.5, "the chip's clock is within a few per cent: {found:?}");
    Ok(())
}
