//! What programs may ask of the vehicle, and its serial line: MSP for MultiWiiConf and other configurators.
//!
//! Parameters travel to the vehicle as requests on its topics, so a flight that somebody configures replays without the line. An armed vehicle answers, and changes nothing.

use crate::messages::SensorOffsets;
use crate::parameters::Parameters;
use crate::topics::{COUNT, LinkEnds, TOPICS};
use stampfly_flight::newest::{NewestSamples, longest_message};
use stampfly_param::{Parameters as ByNumber, RequestedParameters};
use stampfly_services::msp::{Card, Misc, Msp, PidRow, PidTerm, Scale};
use stampfly_services::{ArbitratedAccess, CommandArbiter, Places, Refusal, Request, VehicleActions, View};
use stampfly_types::Instant;
use stampfly_types::messages::{GuidedCommand, PilotInput};

const fn times(parameter: &'static str, factor: f32) -> PidTerm {
    PidTerm { parameter, scale: Scale::Times(factor) }
}

const fn row(name: &'static str, terms: [Option<PidTerm>; 3]) -> PidRow {
    PidRow { name, terms }
}

const NOTHING: [Option<PidTerm>; 3] = [None; 3];
/// Tens of degrees.
const TENS: f32 = 18.0 / core::f32::consts::PI;

/// The original's use of MultiWii's table: three rows are gains, three more are whatever needed a place.
pub static CARD: Card = Card {
    variant: *b"MWII",
    board: *b"F303",
    version: [2, 40, 0],
    name: "stm32-quad",
    kind: 3,
    motors: 4,
    cycle: 250,
    // Two bytes behind the original's seven, which MultiWiiConf does not read and others need.
    long_analog: true,
    rows: &[
        row("ROLL", [Some(times("roll.p", 100.0)), Some(times("roll.i", 1e3)), Some(times("roll.d", 1e4))]),
        row("PITCH", [Some(times("pitch.p", 100.0)), Some(times("pitch.i", 1e3)), Some(times("pitch.d", 1e4))]),
        row("YAW", [Some(times("yaw.p", 100.0)), Some(times("yaw.i", 1e3)), Some(times("yaw.d", 1e4))]),
        row("ALT", NOTHING),
        row("Pos", NOTHING),
        row(
            "PosR",
            [
                Some(times("filter.accel", 1.0)),
                Some(times("stick.angle_max", TENS)),
                Some(times("gain.rotation", 10.0)),
            ],
        ),
        row(
            "NavR",
            [
                Some(times("filter.gyro", 1.0)),
                Some(times("stick.rotation_max", TENS)),
                Some(times("gain.throttle", 10.0)),
            ],
        ),
        row("LEVEL", [Some(times("filter.derivative", 1.0)), None, None]),
        row("MAG", NOTHING),
        row("VEL", NOTHING),
    ],
    misc: Some(Misc {
        least_command: times("stick.threshold", 1e3),
        battery_scale: times("battery.scale", 70.0),
        battery_warning: times("battery.warning", 10.0),
        battery_critical: times("battery.critical", 10.0),
    }),
};

/// The newest sample of every topic.
pub type Newest = NewestSamples<COUNT, { longest_message(&TOPICS) }>;

/// What programs may ask of it: parameters, and what the board is asked for. It is armed and flown by its transmitter's sticks alone.
pub struct Board<'b> {
    parameters: RequestedParameters<Parameters, 64>,
    /// As a new vehicle has them.
    defaults: Parameters,
    ends: LinkEnds<'b>,
    /// For the board: keep the parameters, or bind.
    asked: Option<Request>,
}

impl<'b> Board<'b> {
    /// With the parameters at power-on, and those of a new vehicle.
    #[must_use]
    pub const fn new(parameters: &Parameters, defaults: &Parameters, ends: LinkEnds<'b>) -> Self {
        Self { parameters: RequestedParameters::new(*parameters), defaults: *defaults, ends, asked: None }
    }
}

impl VehicleActions for Board<'_> {
    fn command(&mut self, _: Instant, _: GuidedCommand) -> Result<(), Refusal> {
        Err(Refusal::Unsupported)
    }

    fn sticks(&mut self, _: Instant, _: &PilotInput) -> Result<(), Refusal> {
        Err(Refusal::Unsupported)
    }

    fn parameters(&mut self) -> &mut dyn ByNumber {
        &mut self.parameters
    }

    fn request(&mut self, _: Instant, request: Request) -> Result<(), Refusal> {
        match request {
            Request::ResetParameters => Ok(self.parameters.set_all(&self.defaults)?),
            Request::SaveParameters | Request::Bind => {
                self.asked = Some(request);
                Ok(())
            }
            _ => Err(Refusal::Unsupported),
        }
    }

    /// Changes of an armed vehicle wait until it is disarmed.
    fn poll(&mut self, now: Instant, armed: bool) {
        if !armed {
            self.parameters.send(|request| self.ends.parameter_request.publish(now, request).is_ok());
        }
        if let Some(parameters) = self.ends.parameters.has_new().then(|| self.ends.parameters.latest()).flatten() {
            self.parameters.adopt(parameters.data);
        }
    }
}

/// The vehicle's end of the line.
pub struct Serial<'b> {
    arbiter: CommandArbiter,
    board: Board<'b>,
    places: Places,
}

impl<'b> Serial<'b> {
    /// With these parameters and requests.
    #[must_use]
    pub fn new(board: Board<'b>) -> Self {
        Self { arbiter: CommandArbiter::new(), board, places: Places::of(&TOPICS) }
    }

    /// Bytes came in: answers them. Returns what the board has to do: keep the parameters, or bind.
    pub fn hear(
        &mut self,
        now: Instant,
        msp: &mut Msp,
        bytes: &[u8],
        newest: &Newest,
        put: &mut dyn FnMut(&[u8]),
    ) -> Option<Request> {
        let Self { arbiter, board, places } = self;
        msp.hear(now, bytes, &mut ArbitratedAccess { arbiter, actions: board, view: View::new(newest, places) }, put);
        self.poll(now, newest);
        self.board.asked.take()
    }

    /// What a calibration has found, once.
    pub fn found(&mut self) -> Option<SensorOffsets> {
        let offsets = &mut self.board.ends.sensor_offsets;
        offsets.has_new().then(|| offsets.latest()).flatten().map(|found| found.data)
    }

    /// The parameters in use, whoever has changed them. Call it now and then.
    pub fn poll(&mut self, now: Instant, newest: &Newest) -> Parameters {
        let Self { arbiter, board, places } = self;
        arbiter.poll(now, View::new(newest, places).state().armed, board);
        *board.parameters.values()
    }
}
