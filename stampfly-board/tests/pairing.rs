//! Button, mode machine, radio and arm switch together, as the firmware joins them: a vehicle changes its transmitter.

use stampfly_board::messages::ButtonContact;
use stampfly_board::schedule::Runnables;
use stampfly_board::{VehicleConfig, topics};
use stampfly_bus::Band;
use stampfly_flight::{Assembled, FlightLoop};
use stampfly_link::{Address, ControlPacket, Rejected, Session};
use stampfly_types::messages::{Alerts, ArmBlocks, GuidedCommand, GuidedKind, ImuData, PilotInput, PowerData, TofData};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

const VEHICLE: Address = Address([0x34, 0x85, 0x18, 1, 2, 3]);
const OLD: Address = Address([2, 0, 0, 0, 0, 1]);
const NEW: Address = Address([2, 0, 0, 0, 0, 2]);

/// A vehicle on a table, with its end of the radio.
struct Bench<'b> {
    flight: FlightLoop<'b, Runnables>,
    outside: topics::Outside<'b>,
    session: Session,
    wanted: bool,
    /// Does the battery monitor answer?
    monitor: bool,
    /// Does a program say that it is there?
    program: bool,
    now: Instant,
}

impl<'b> Bench<'b> {
    fn new(bus: &'b mut topics::Bus, peer: Option<Address>) -> Self {
        let Assembled { flight_loop: flight, outside, .. } =
            Assembled::new(bus.split(None), &VehicleConfig::default(), Instant::ZERO);
        let session = Session::new(VEHICLE, 1, peer);
        Self { flight, outside, session, wanted: false, monitor: true, program: false, now: Instant::ZERO }
    }

    fn blocks(&mut self) -> ArmBlocks {
        self.outside.link.telemetry.latest().map(|frame| frame.data.blocks).unwrap_or_default()
    }

    fn armed(&mut self) -> bool {
        self.outside.link.telemetry.latest().is_some_and(|frame| frame.data.armed)
    }

    fn command(&mut self, kind: GuidedKind) {
        let command = GuidedCommand { kind, ..Default::default() };
        self.outside.link.command_guided.publish(self.now, command).expect("room in the queue");
    }

    /// Lets time pass. Every transmitter sends its packet every 20 ms; returns what became of the last one's.
    fn pass(&mut self, millis: u64, pressed: bool, air: &[(Address, bool)]) -> Option<Result<(), Rejected>> {
        let mut last = None;
        let end = self.now + Duration::from_millis(millis);
        while self.now < end {
            self.now += Duration::from_micros(2_500);
            let now = self.now;
            let still = ImuData { accel: Vec3::new(0.0, 0.0, -GRAVITY), ..Default::default() };
            self.outside.imu.sensor_imu.publish(now, &still);
            if now.as_micros().is_multiple_of(20_000) {
                self.outside.button_pin.button_contact.publish(now, &ButtonContact { pressed });
                self.outside
                    .tof
                    .sensor_tof
                    .publish(now, &TofData { distance: 0.03, valid: true, ..Default::default() });
                if self.monitor {
                    self.outside.power.sensor_power.publish(now, &PowerData { voltage: 4.1, current: 0.1, power: 0.4 });
                }
                if self.program {
                    self.command(GuidedKind::None);
                }
                for (source, arm) in air {
                    let sticks = PilotInput { arm: *arm, ..Default::default() };
                    let bytes = ControlPacket::from_pilot(VEHICLE, &sticks).to_bytes();
                    let heard = self.session.receive(now, *source, &bytes);
                    if let Ok(input) = &heard {
                        self.outside.link.command_pilot.publish(now, input);
                    }
                    last = Some(heard.map(|_| ()));
                }
                // As the firmware's radio does it.
                let wants = self.blocks().contains(ArmBlocks::PAIRING);
                let armed = self.armed();
                self.session.set_armed(armed);
                match (self.wanted, wants) {
                    (false, true) => _ = self.session.start_pairing(now),
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
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, Some(OLD));
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

    // A hand on the button stops the motors within a moment, and this touch does nothing else, however long it is.
    bench.pass(100, true, &[(NEW, true)]);
    assert!(!bench.armed());
    bench.pass(3_500, true, &[(NEW, true)]);
    assert!(!bench.session.is_pairing() && bench.session.peer() == Some(NEW));
    bench.pass(1_000, false, &[(NEW, true)]);
    assert!(!bench.armed());
}

#[test]
fn a_vehicle_that_never_had_a_transmitter_takes_none_while_a_program_flies_it() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, None);
    bench.program = true;
    bench.pass(6_000, false, &[]);
    assert_eq!(bench.blocks(), ArmBlocks::NONE);
    bench.command(GuidedKind::Arm);
    bench.pass(100, false, &[]);
    assert!(bench.armed());
    assert_eq!(bench.pass(2_000, false, &[(NEW, false)]), Some(Err(Rejected::Stranger)));
    assert!(bench.armed() && bench.session.peer().is_none());
    bench.command(GuidedKind::Disarm);
    bench.pass(100, false, &[(NEW, false)]);
    assert_eq!((bench.armed(), bench.session.peer()), (false, Some(NEW)), "on the ground it does");
}

#[test]
fn a_vehicle_armed_while_it_looks_goes_back_to_its_transmitter() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, Some(OLD));
    bench.program = true;
    bench.pass(6_000, false, &[(OLD, false)]);
    // At the console, which the mode machine knows nothing of.
    assert_eq!(bench.session.start_pairing(bench.now), Ok(()));
    bench.command(GuidedKind::Arm);
    bench.pass(100, false, &[]);
    assert!(bench.armed() && !bench.session.is_pairing());
    assert_eq!(bench.pass(2_000, false, &[(NEW, false)]), Some(Err(Rejected::Stranger)));
    assert_eq!(bench.pass(500, false, &[(OLD, false)]), Some(Ok(())));
    assert!(bench.armed() && bench.session.peer() == Some(OLD));
}

#[test]
fn a_click_without_a_transmitter_does_nothing() {
    for peer in [None, Some(OLD)] {
        let mut bus = topics::Bus::new();
        let mut bench = Bench::new(&mut bus, peer);
        bench.pass(6_000, false, &[]);
        assert_eq!(bench.blocks(), ArmBlocks::NO_LINK);
        bench.pass(200, true, &[]);
        bench.pass(1_000, false, &[]);
        assert!(!bench.armed(), "never heard");
        bench.pass(1_000, false, &[(OLD, false)]);
        assert_eq!(bench.blocks(), ArmBlocks::NONE);
        bench.pass(1_000, false, &[]);
        bench.pass(200, true, &[]);
        bench.pass(1_000, false, &[]);
        assert_eq!((bench.armed(), bench.blocks()), (false, ArmBlocks::NO_LINK), "switched off again");
        bench.pass(200, true, &[(OLD, false)]);
        bench.pass(600, false, &[(OLD, false)]);
        assert!(bench.armed(), "heard");
    }
}

#[test]
fn a_silent_battery_monitor_refuses_arming() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, Some(OLD));
    bench.monitor = false;
    bench.pass(6_000, false, &[(OLD, false)]);
    bench.pass(200, false, &[(OLD, true)]);
    assert_eq!((bench.armed(), bench.blocks()), (false, ArmBlocks::SENSOR));
    assert!(bench.outside.link.telemetry.latest().is_some_and(|frame| frame.data.alerts == Alerts::POWER_LOST));
    bench.monitor = true;
    bench.pass(200, false, &[(OLD, false)]);
    bench.pass(200, false, &[(OLD, true)]);
    assert!(bench.armed());
    bench.monitor = false;
    bench.pass(2_000, false, &[(OLD, true)]);
    assert!(bench.armed(), "it is no reason to stop");
}

#[test]
fn who_changes_his_mind_keeps_his_transmitter() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, Some(OLD));
    bench.pass(6_000, false, &[(OLD, false)]);
    bench.pass(3_500, true, &[(OLD, false)]);
    assert!(bench.session.is_pairing());
    bench.pass(300, false, &[(OLD, false)]);
    bench.pass(3_500, true, &[(OLD, false)]);
    assert!(!bench.session.is_pairing());
    assert_eq!(bench.pass(500, false, &[(OLD, false)]), Some(Ok(())));
    assert_eq!(bench.blocks(), ArmBlocks::NONE);
}
