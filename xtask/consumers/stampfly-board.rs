//! A stranger's program: the vehicle, assembled.

use stampfly_board::schedule::Runnables;
use stampfly_board::{VehicleConfig, topics};
use stampfly_bus::Taps;
use stampfly_flight::Assembled;
use stampfly_types::{Instant, messages::ImuData};

fn main() {
    let mut bus = topics::Bus::new();
    let assembled = Assembled::<Runnables>::new(&mut bus, None, &VehicleConfig::default(), Instant::ZERO);
    let Assembled { flight_loop, mut outside, mut taps } = assembled;
    assert_eq!(flight_loop.next_tick(), Some(Instant::from_millis(5)), "the failsafe runs even when no sensor does");

    outside.imu.sensor_imu.publish(Instant::from_micros(2_500), &ImuData::default());
    let mut logged = Vec::new();
    taps.drain(&mut |topic, at, _, _| logged.push((topic, at)));
    assert_eq!(logged, [(topics::Id::sensor_imu as usize, Instant::from_micros(2_500))]);
}
