//! A stranger's program: the vehicle, assembled.

use stampfly_board::vehicle::{Assembled, assemble};
use stampfly_board::{VehicleConfig, wiring};
use stampfly_types::{Instant, messages::ImuData};

fn main() {
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports, heads, mut taps } = bus.split(None);
    let Assembled { flight_loop, mut outside } = assemble(ports, heads, &VehicleConfig::default(), Instant::ZERO);
    assert_eq!(flight_loop.next_tick(), Some(Instant::from_millis(5)), "the failsafe runs even when no sensor does");

    outside.imu.publish(Instant::from_micros(2_500), &ImuData::default());
    let mut logged = Vec::new();
    taps.drain(&mut |topic, at, _, _| logged.push((topic, at)));
    assert_eq!(logged, [(wiring::Id::sensor_imu, Instant::from_micros(2_500))]);
}
