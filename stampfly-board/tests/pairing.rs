//! Button, mode machine, radio and arm switch together, as the firmware joins them: a vehicle changes its transmitter.

use stampfly_board::messages::ButtonContact;
use stampfly_board::vehicle::{Assembled, Outside, assemble};
use stampfly_board::{FlightLoop, VehicleConfig, wiring};
use stampfly_bus::Band;
use stampfly_link::{Address, ControlPacket, Rejected, Session};
use stampfly_types::messages::{ArmBlocks, ImuData, PilotInput, PowerData, TofData};
use stampfly_types::{GRAVITY, Micros, Vec3};

const VEHICLE: Address = Address([0x34, 0x85, 0x18, 1, 2, 3]);
const OLD: Address = Address([2, 0, 0, 0, 0, 1]);
const NEW: Address = Address([2, 0, 0, 0, 0, 2]);

/// A vehicle on a table, with its end of the radio.
struct Bench<'b> {
    flight: FlightLoop<'b>,
    outside: Outside<'b>,
    session: Session,
    wanted: bool,
    now: Micros,
}

impl<'b> Bench<'b> {
    fn new(bus: &'b mut wiring::Bus) -> Self {
        let wiring::Split { ports, heads, .. } = bus.split(None);
        let Assembled { flight_loop: flight, outside } =
            assemble(ports, heads, &VehicleConfig::default(), Micros::ZERO);
        Self { flight, outside, session: Session::new(VEHICLE, 1, Some(OLD)), wanted: false, now: Micros::ZERO }
    }

    fn blocks(&mut self) -> ArmBlocks {
        self.outside.telemetry.latest().map(|frame| frame.data.blocks).unwrap_or_default()
    }

    fn armed(&mut self) -> bool {
        self.outside.telemetry.latest().is_some_and(|frame| frame.data.armed)
    }

    /// Lets time pass. Every transmitter sends its packet every 20 ms; returns what became of the last one's.
    fn pass(&mut self, millis: u64, pressed: bool, air: &[(Address, bool)]) -> Option<Result<(), Rejected>> {
        let mut last = None;
        let end = self.now + Micros::from_millis(millis);
        while self.now < end {
            self.now += Micros(2_500);
            let now = self.now;
            let still = ImuData { accel: Vec3::new(0.0, 0.0, -GRAVITY), ..Default::default() };
            self.outside.imu.publish(now, &still);
            if now.0.is_multiple_of(20_000) {
                self.outside.button.publish(now, &ButtonContact { pressed });
                self.outside.tof.publish(now, &TofData { distance: 0.03, valid: true, ..Default::default() });
                self.outside.power.publish(now, &PowerData { voltage: 4.1, current: 0.1, power: 0.4 });
                for (source, arm) in air {
                    let sticks = PilotInput { arm: *arm, ..Default::default() };
                    let bytes = ControlPacket::from_pilot(VEHICLE, &sticks).to_bytes();
                    let heard = self.session.receive(now, *source, &bytes);
                    if let Ok(input) = &heard {
                        self.outside.pilot.publish(now, input);
                    }
                    last = Some(heard.map(|_| ()));
                }
                // As the firmware's radio does it.
                let wants = self.blocks().contains(ArmBlocks::PAIRING);
                let armed = self.armed();
                match (self.wanted, wants) {
                    (false, true) => _ = self.session.start_pairing(now, armed),
                    (true, false) => self.session.stop_pairing(),
                    _ => {}
                }
                self.wanted = wants;
            }
            for band in [Band::Flight, Band::Background] {
                self.flight.run_band(band, now, &mut ());
            }
        }
        last
    }
}

#[test]
fn a_vehicle_changes_its_transmitter() {
    let mut bus = wiring::Bus::new();
    let mut bench = Bench::new(&mut bus);
    assert_eq!(bench.pass(6_000, false, &[(OLD, false)]), Some(Ok(())));
    assert_eq!(bench.blocks(), ArmBlocks::NONE, "calibrated and ready");

    // Three seconds on the button, with the old transmitter still on.
    bench.pass(3_500, true, &[(OLD, false)]);
    assert!(bench.session.is_pairing() && bench.blocks().contains(ArmBlocks::PAIRING));
    assert_eq!(bench.pass(1_000, false, &[(OLD, true)]), Some(Err(Rejected::Stranger)), "not heard any more");
    assert!(!bench.armed(), "nor obeyed");

    // The new one comes with its arm switch on, and has to switch it off first.
    assert_eq!(bench.pass(500, false, &[(OLD, false), (NEW, true)]), Some(Err(Rejected::ArmSwitch)));
    assert_eq!(bench.pass(500, false, &[(OLD, false), (NEW, false)]), Some(Ok(())));
    assert_eq!(bench.session.peer(), Some(NEW));
    assert!(!bench.session.is_pairing());
    assert_eq!(bench.blocks(), ArmBlocks::NONE, "pairing is over, without another touch of the button");

    bench.pass(200, false, &[(OLD, true), (NEW, false)]);
    assert!(!bench.armed(), "the old transmitter's switch does nothing");
    bench.pass(200, false, &[(OLD, false), (NEW, true)]);
    assert!(bench.armed(), "the new one's does");

    // With motors armed nobody looks for a transmitter.
    bench.pass(3_500, true, &[(NEW, true)]);
    assert!(!bench.session.is_pairing() && bench.session.peer() == Some(NEW));
}

#[test]
fn who_changes_his_mind_keeps_his_transmitter() {
    let mut bus = wiring::Bus::new();
    let mut bench = Bench::new(&mut bus);
    bench.pass(6_000, false, &[(OLD, false)]);
    bench.pass(3_500, true, &[(OLD, false)]);
    assert!(bench.session.is_pairing());
    bench.pass(300, false, &[(OLD, false)]);
    bench.pass(3_500, true, &[(OLD, false)]);
    assert!(!bench.session.is_pairing());
    assert_eq!(bench.pass(500, false, &[(OLD, false)]), Some(Ok(())));
    assert_eq!(bench.blocks(), ArmBlocks::NONE);
}
