//! A vehicle looks for its transmitter in a room where others fly, too.

use stampfly_link::{Address, ControlPacket, LinkState, PairingPacket, Session, TelemetryPacket};
use stampfly_types::Instant;
use stampfly_types::messages::{FlightMode, PilotInput};

/// A transmitter: where it is, and which vehicle it sends to.
struct Transmitter {
    address: Address,
    vehicle: Address,
    sticks: PilotInput,
}

impl Transmitter {
    fn packet(&self) -> [u8; ControlPacket::LENGTH] {
        ControlPacket::from_pilot(self.vehicle, &self.sticks).to_bytes()
    }
}

fn main() {
    let (ours, theirs) = (Address([0x34, 0x85, 0x18, 1, 2, 3]), Address([0x34, 0x85, 0x18, 9, 9, 9]));
    let mut vehicle = Session::new(ours, 1, None);
    let neighbour =
        Transmitter { address: Address([2, 0, 0, 0, 0, 1]), vehicle: theirs, sticks: PilotInput::default() };
    let mut pilot =
        Transmitter { address: Address([2, 0, 0, 0, 0, 2]), vehicle: theirs, sticks: PilotInput::default() };

    for step in 0..100u64 {
        let now = Instant::from_millis(20 * step);
        if let Some(call) = vehicle.beacon(now) {
            let call = PairingPacket::decode(&call).expect("a call");
            println!("{now}: {} calls on channel {}", call.vehicle, call.channel);
            // Our pilot presses the button in the second round.
            if step > 20 {
                pilot.vehicle = call.vehicle;
            }
        }
        pilot.sticks = PilotInput { mode: FlightMode::AltHold, arm: step > 60, ..pilot.sticks };
        let was = vehicle.peer();
        for transmitter in [&neighbour, &pilot] {
            // Refused packets are counted by the session; there is nothing to do about them here.
            let _ = vehicle.receive(now, transmitter.address, &transmitter.packet());
        }
        if vehicle.peer() != was {
            println!("{now}: paired with {}", vehicle.peer().expect("somebody"));
        }
    }
    println!("{:#?}", vehicle.counters());

    let told = TelemetryPacket { battery: 3.91, height: 0.52, state: LinkState::Flying, ..Default::default() };
    println!("and back: {:02x?}", told.to_bytes());
    assert_eq!(vehicle.peer(), Some(pilot.address));
}
