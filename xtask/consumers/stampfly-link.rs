//! A stranger's program: a transmitter and a vehicle.

use stampfly_link::{Address, ControlPacket, Session};
use stampfly_types::{Instant, messages::PilotInput};

fn main() {
    let (vehicle, transmitter) = (Address([1; 6]), Address([2; 6]));
    let mut session = Session::new(vehicle, 1, Some(transmitter));
    let bytes = ControlPacket::from_pilot(vehicle, &PilotInput { roll: 1.0, ..Default::default() }).to_bytes();
    assert_eq!(session.receive(Instant::ZERO, transmitter, &bytes).expect("from the pilot").roll, 1.0);
}
