//! A vehicle on a table, with its end of the radio and stations in the air, as the firmware joins them.

use stampfly_board::console::Newest;
use stampfly_board::link::{self, Link, Outgoing};
use stampfly_board::messages::ButtonContact;
use stampfly_board::schedule::Runnables;
use stampfly_board::topics::{self, Id};
use stampfly_board::{VehicleConfig, console::Command};
use stampfly_bus::{Band, Taps};
use stampfly_flight::{Assembled, FlightLoop};
use stampfly_link::secure::{Guarded, MAX_FRAME, NotTaken, Policy, Vehicle};
use stampfly_link::{Address, ControlPacket, Session};
use stampfly_services::CommandArbiter;
use stampfly_types::messages::{
    ArmBlocks, BaroData, FlightStatus, FlowData, GuidedCommand, GuidedKind, ImuData, MotorOutput, PilotInput,
    PowerData, TofData,
};
use stampfly_types::{Duration, GRAVITY, Instant, Message, Vec3};

pub const VEHICLE: Address = Address([0x34, 0x85, 0x18, 1, 2, 3]);
pub const OLD: Address = Address([2, 0, 0, 0, 0, 1]);
pub const NEW: Address = Address([2, 0, 0, 0, 0, 2]);

/// The ends that a test uses itself.
pub struct Ends<'b> {
    imu: topics::ImuEnds<'b>,
    tof: topics::TofEnds<'b>,
    flow: topics::FlowEnds<'b>,
    baro: topics::BaroEnds<'b>,
    power: topics::PowerEnds<'b>,
    button: topics::ButtonPinEnds<'b>,
    pub console: topics::ConsoleEnds<'b>,
    pub storage: topics::StorageEnds<'b>,
    pub cutoff: topics::CutoffEnds<'b>,
    pub supervisor: topics::SupervisorEnds<'b>,
}

/// A vehicle on a table.
pub struct Bench<'b> {
    flight: FlightLoop<'b, Runnables>,
    pub ends: Ends<'b>,
    pub link: Link<'b>,
    /// Who commands, as the firmware has it.
    pub arbiter: CommandArbiter,
    randoms: u64,
    /// What the vehicle has sent.
    pub said: Vec<Vec<u8>>,
    taps: topics::Taps<'b>,
    newest: Newest,
    /// Does the battery monitor answer?
    pub monitor: bool,
    /// Do range finder, flow sensor and barometer answer?
    pub aiding: bool,
    /// Does the background band get the processor?
    pub background: bool,
    /// Does a program say that it is there?
    pub program: bool,
    pub now: Instant,
}

impl<'b> Bench<'b> {
    pub fn new(bus: &'b mut topics::Bus, peer: Option<Address>) -> Self {
        Self::with_key(bus, peer, None)
    }

    /// One that has a key, if it has.
    pub fn with_key(bus: &'b mut topics::Bus, peer: Option<Address>, vehicle: Option<Vehicle>) -> Self {
        let Assembled { flight_loop: flight, outside, taps } =
            Assembled::new(bus, None, &VehicleConfig::default(), Instant::ZERO);
        let topics::Outside {
            imu, tof, flow, baro, power, link, button_pin, console, storage, cutoff, supervisor, ..
        } = outside;
        let policy = Policy { accept_unauthenticated: VehicleConfig::default().accept_unauthenticated };
        let link = Link::new(Guarded::new(vehicle, Session::new(VEHICLE, 1, peer), policy), link);
        let ends = Ends { imu, tof, flow, baro, power, button: button_pin, console, storage, cutoff, supervisor };
        let newest = Newest::new();
        Self {
            flight,
            ends,
            link,
            arbiter: CommandArbiter::new(),
            randoms: 0,
            said: Vec::new(),
            taps,
            newest,
            monitor: true,
            aiding: true,
            background: true,
            program: false,
            now: Instant::ZERO,
        }
    }

    /// The newest sample of a topic.
    pub fn newest<M: Message + Default>(&self, topic: Id) -> M {
        self.newest.get(topic as usize).map(|(_, data)| data).unwrap_or_default()
    }

    pub fn blocks(&self) -> ArmBlocks {
        self.newest::<FlightStatus>(Id::flight_status).blocks
    }

    pub fn armed(&self) -> bool {
        self.newest::<FlightStatus>(Id::flight_status).armed
    }

    pub fn motors(&self) -> MotorOutput {
        self.newest(Id::actuator_motor)
    }

    pub fn command(&mut self, kind: GuidedKind) {
        assert!(self.link.command(self.now, GuidedCommand { kind, ..Default::default() }), "room in the queue");
    }

    /// What the vehicle sends now, and where.
    pub fn say(&mut self, now: Instant, what: Outgoing) -> Option<(Address, Vec<u8>)> {
        self.randoms += 1;
        let random = self.randoms.wrapping_mul(0x9E37_79B9_7F4A_7C15).to_le_bytes();
        self.link.transmit(now, what, random, &mut [0; MAX_FRAME]).map(|(to, bytes)| (to, bytes.to_vec()))
    }

    /// At the console.
    pub fn console(&mut self, command: Command) {
        command.publish(self.now, &mut self.ends.console);
    }

    /// Lets time pass. Every transmitter sends its packet every 20 ms; returns what became of the last one's.
    pub fn pass(&mut self, millis: u64, pressed: bool, air: &[(Address, bool)]) -> Option<Result<(), NotTaken>> {
        let mut last = None;
        let end = self.now + Duration::from_millis(millis);
        while self.now < end {
            self.now += Duration::from_micros(2_500);
            let now = self.now;
            // A sensor has noise: one that repeats itself does not measure.
            let noise = Vec3::repeat(1e-3 * (now.as_micros() / 2_500 % 7) as f32);
            let accel = Vec3::new(0.0, 0.0, -GRAVITY) + noise;
            let still = ImuData { accel, gyro: noise, ..Default::default() };
            self.ends.imu.sensor_imu.publish(now, &still);
            if now.as_micros().is_multiple_of(link::PERIOD.as_micros()) {
                self.ends.button.button_contact.publish(now, &ButtonContact { pressed });
                if self.aiding {
                    let range = TofData { distance: 0.03, valid: true, ..Default::default() };
                    self.ends.tof.sensor_tof.publish(now, &range);
                    let flow = FlowData { interval: 0.02, quality: 80, valid: true, ..Default::default() };
                    self.ends.flow.sensor_flow.publish(now, &flow);
                    self.ends.baro.sensor_baro.publish(now, &BaroData { pressure: 101_325.0, ..Default::default() });
                }
                if self.monitor {
                    self.ends.power.sensor_power.publish(now, &PowerData { voltage: 4.1, current: 0.1, power: 0.4 });
                }
                if self.program {
                    self.command(GuidedKind::None);
                }
                for (source, arm) in air {
                    let sticks = PilotInput { arm: *arm, ..Default::default() };
                    let mut bytes = ControlPacket::from_pilot(VEHICLE, &sticks).to_bytes();
                    last = Some(self.link.receive(&mut self.arbiter, now, *source, &mut bytes).map(drop));
                }
                for what in Outgoing::ALL {
                    let said = self.say(now, what);
                    self.said.extend(said.map(|(_, bytes)| bytes));
                }
            }
            for band in [Band::Flight, Band::Background].into_iter().take(1 + usize::from(self.background)) {
                self.flight.run_band(band, now, &mut ());
            }
            self.taps.drain(&mut |topic, at, _, words| self.newest.note(topic, at, words));
        }
        last
    }
}
