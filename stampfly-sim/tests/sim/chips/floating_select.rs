//! A flow sensor with an undriven chip select corrupts reads of the inertial sensor.

use super::wait;
use crate::standing;
use embedded_hal::spi::SpiDevice;
use stampfly_sim::Simulation;
use stampfly_sim::chips::{Bmi270, Pmw3901, SpiBus, SpiPort};

fn board() -> (Simulation, SpiPort<Bmi270>, SpiPort<Pmw3901>) {
    let simulation = standing();
    let (world, clock) = (&simulation.world, &simulation.clock);
    let bus = SpiBus::new(clock, 1);
    let (imu, _) = bus.attach(8_000_000, Bmi270::new(world, clock, 1, 1.0, &[0x5A; 8_192]));
    let (flow, _) = bus.attach_floating(2_000_000, Pmw3901::new(world, clock, 1));
    wait(&simulation, 50_000);
    (simulation, imu, flow)
}

/// Number of correct identity reads of a hundred.
fn right(simulation: &Simulation, imu: &mut SpiPort<Bmi270>) -> usize {
    let mut read = || {
        wait(simulation, 100);
        let mut bytes = [0x80, 0, 0];
        imu.transfer_in_place(&mut bytes).unwrap();
        bytes[2] == 0x24
    };
    read();
    (0..100).filter(|_| read()).count()
}

#[test]
fn it_disturbs_until_it_is_driven_high() {
    let (simulation, mut imu, flow) = board();
    let disturbed = right(&simulation, &mut imu);
    assert!((20..90).contains(&disturbed), "{disturbed} of 100 right");
    flow.park();
    assert_eq!(right(&simulation, &mut imu), 100);
    flow.park();
    assert_eq!(right(&simulation, &mut imu), 100, "once is enough, twice does no harm");
}

#[test]
fn a_first_transfer_of_its_own_drives_it_too() {
    let (simulation, mut imu, mut flow) = board();
    flow.write(&[0x00]).unwrap();
    assert_eq!(right(&simulation, &mut imu), 100);
}
