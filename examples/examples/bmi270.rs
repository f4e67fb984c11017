//! The driver of the inertial sensor, on an emulated chip: it stands, takes off, rolls, nods and turns.

mod emulated;

use emulated::{Hand, Terminal};
use examples::drivers::{Failure, bmi270};
use stampfly_drivers::chip::ChipError;
use stampfly_sim::chips::BusError;
use stampfly_sim::time::block_on;
use stampfly_types::frame;

fn main() -> Result<(), Failure<ChipError<BusError>>> {
    let (simulation, mut board, image) = emulated::vehicle(None);
    let script = |time: f64| {
        let level = Hand::default();
        match time {
            0.0..1.5 => None,
            ..2.2 => Some(Hand { climb: 0.5, ..level }),
            ..3.2 => Some(Hand { roll: 0.35, ..level }),
            ..4.0 => Some(Hand { pitch: -0.35, ..level }),
            ..4.8 => Some(Hand { turn: 1.5, ..level }),
            _ => Some(level),
        }
    };
    let clock = simulation.clock.clone();
    let sound = block_on(&clock, bmi270::self_test(&mut board.imu, clock.clone(), &image, &mut Terminal))?;
    assert!(sound, "the emulated gyroscope did not pass");
    let found = emulated::run(&simulation, script, bmi270::run(board.imu, clock, &image, &mut Terminal))?;

    let truth = frame::roll_pitch_yaw(&simulation.truth().attitude);
    println!(
        "in truth it is at {:.1}° {:.1}° {:.1}°",
        truth[0].to_degrees(),
        truth[1].to_degrees(),
        truth[2].to_degrees()
    );
    for (angle, truth) in found.attitude.into_iter().zip(truth) {
        assert!((angle - truth).abs() < 0.1, "the attitude is off by more than 0.1 rad: {found:?}");
    }
    assert!((found.rate - 400.0).abs() < 12.0, "the chip's clock is within 3 %: {found:?}");
    assert!((0.005..0.2).contains(&found.least_shaking), "an impossible noise: {found:?}");
    assert!(found.most_shaking > 2.0 * found.least_shaking, "the motors are not felt: {found:?}");
    Ok(())
}
