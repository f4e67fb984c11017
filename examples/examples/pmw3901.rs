//! The driver of the optical flow sensor, on an emulated chip: the vehicle glides over the floor, slower and slower.

mod emulated;

use emulated::{Hand, Terminal};
use examples::drivers::{Failure, pmw3901};
use stampfly_drivers::chip::ChipError;
use stampfly_sim::chips::BusError;
use stampfly_sim::plant::Pose;

fn main() -> Result<(), Failure<ChipError<BusError>>> {
    let mut pose = Pose::hovering(1.0);
    (pose.velocity.x, pose.velocity.y) = (0.6, -0.3);
    let (simulation, mut board, _) = emulated::vehicle(Some(pose));
    let clock = simulation.clock.clone();
    let level = |_| Some(Hand::default());
    // The self test in flight, too: meanwhile nobody else would hold the vehicle.
    let example = async {
        pmw3901::self_test(&mut board.flow, clock.clone(), &mut Terminal).await?;
        pmw3901::run(board.flow, clock, &mut Terminal).await
    };
    let found = emulated::run(&simulation, level, example)?;

    let truth = simulation.truth().position;
    println!("in truth it is {:.2} m to the north and {:.2} m to the east of its start", truth.x, truth.y);
    for (swept, truth) in found.swept.into_iter().zip([truth.x, truth.y]) {
        assert!((swept - truth).abs() < 0.1 + 0.2 * truth.abs(), "this is not the way that it moved: {found:?}");
    }
    assert!(found.good > 0.9, "the chip is blind: {found:?}");
    assert!((found.rate - 100.0).abs() < 3.0, "not the rate the driver was told: {found:?}");
    Ok(())
}
