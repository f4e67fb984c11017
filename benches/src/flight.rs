//! A simulated flight, recorded once and flown again and again: what the 400 Hz chain is measured with.
//!
//! The recording holds every sample in order of arrival, and what the motors were told. Replaying it into a fresh
//! vehicle repeats the flight without the simulator, so that only the flight stack is measured; that the motors are
//! told the same bits again shows that the replay is the flight.

use stampfly_board::schedule::Runnables;
use stampfly_board::{VehicleConfig, topics};
use stampfly_bus::Band;
use stampfly_drivers::{Barometer, Imu, Magnetometer, MotorOutputs, OpticalFlow, PowerMonitor, RangeFinder, Sample};
use stampfly_flight::{Assembled, FlightLoop, Observer};
use stampfly_sim::sensors::Sensors;
use stampfly_sim::time::Tasks;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::messages::*;
use stampfly_types::{Instant, Vec3};
use std::cell::RefCell;

/// Steps of the recording: twenty seconds.
pub const STEPS: usize = 8_000;
/// From here on the vehicle flies.
pub const FLYING_FROM: usize = 4_800;

/// Something that comes in from outside.
#[derive(Clone, Copy, Debug)]
enum Input {
    Imu(ImuData),
    Tof(TofData),
    Flow(FlowData),
    Mag(MagData),
    Baro(BaroData),
    Power(PowerData),
    Guided(GuidedCommand),
}

#[derive(Clone, Copy, Debug)]
struct Arrival {
    /// When it came in.
    clock: Instant,
    /// When it was true.
    at: Instant,
    input: Input,
}

/// A vehicle at the moment before its next step.
struct Vehicle<'b> {
    flight: FlightLoop<'b, Runnables>,
    outside: topics::Outside<'b>,
}

impl<'b> Vehicle<'b> {
    fn new(bus: &'b mut topics::Bus) -> Self {
        let Assembled { flight_loop: flight, outside, .. } =
            Assembled::new(bus, None, &VehicleConfig::default(), Instant::ZERO);
        Self { flight, outside }
    }

    /// Publishes a sample. One from the inertial sensor completes a step: everything due runs.
    fn take(&mut self, arrival: &Arrival, observer: &mut impl Observer) {
        let (at, outside) = (arrival.at, &mut self.outside);
        match arrival.input {
            Input::Imu(data) => outside.imu.sensor_imu.publish(at, &data),
            Input::Tof(data) => outside.tof.sensor_tof.publish(at, &data),
            Input::Flow(data) => outside.flow.sensor_flow.publish(at, &data),
            Input::Mag(data) => outside.mag.sensor_mag.publish(at, &data),
            Input::Baro(data) => outside.baro.sensor_baro.publish(at, &data),
            Input::Power(data) => outside.power.sensor_power.publish(at, &data),
            Input::Guided(data) => outside.link.command_guided.publish(at, data).expect("a few commands a second"),
        };
        if matches!(arrival.input, Input::Imu(_)) {
            for band in [Band::Flight, Band::Background] {
                self.flight.run_band(band, arrival.clock, observer);
            }
        }
    }

    fn motors(&mut self) -> MotorOutput {
        self.outside.motors.actuator_motor.latest().map(|sample| sample.data).unwrap_or_default()
    }
}

/// A recorded flight: still-calibration, take-off, two way-points, hover.
#[derive(Clone, Debug)]
pub struct Recording {
    arrivals: Vec<Arrival>,
    motors: Vec<MotorOutput>,
}

impl Recording {
    /// Flies and records. Panics when the vehicle does not fly, because there would be nothing to measure.
    #[must_use]
    pub fn new() -> Self {
        let simulation = Simulation::new(&SimulationConfig::new(stampfly_board::simulation::PLANT));
        let mut bus = topics::Bus::new();
        let recorder = RefCell::new(Recorder {
            vehicle: Vehicle::new(&mut bus),
            arrivals: Vec::new(),
            motors: Vec::new(),
            flying_since: None,
        });
        let clock = simulation.clock.clone();
        let Sensors { mut imu, mut tof, mut flow, mut mag, mut baro, mut power, mut motors, .. } = simulation.sensors;

        let mut tasks = Tasks::new(clock.clone());
        macro_rules! record {
            ($($sensor:ident as $Input:ident)+) => { $(tasks.spawn({
                let (recorder, clock) = (&recorder, &clock);
                async move {
                    loop {
                        let Ok(Sample { at, data }) = $sensor.next().await;
                        recorder.borrow_mut().arrive(Arrival { clock: clock.now(), at, input: Input::$Input(data) });
                    }
                }
            });)+ };
        }
        // The inertial sensor comes last: what arrives at the same instant is there when the step begins.
        record! { tof as Tof flow as Flow mag as Mag baro as Baro power as Power }
        tasks.spawn({
            let (recorder, clock) = (&recorder, &clock);
            async move {
                loop {
                    let Ok(Sample { at, data }) = imu.next().await;
                    let duty = recorder.borrow_mut().step(Arrival { clock: clock.now(), at, input: Input::Imu(data) });
                    let Ok(()) = motors.write(&duty);
                }
            }
        });
        while recorder.borrow().motors.len() < STEPS {
            tasks.step();
        }
        drop(tasks);

        let Recorder { arrivals, motors, flying_since, .. } = recorder.into_inner();
        let since = flying_since.expect("the vehicle flies");
        assert!(since < FLYING_FROM, "it flies since step {since}");
        Self { arrivals, motors }
    }

    /// A fresh vehicle on this bus, to fly the recording again.
    #[must_use]
    pub fn replay<'b>(&self, bus: &'b mut topics::Bus) -> Replay<'_, 'b> {
        Replay { recording: self, arrivals: self.arrivals.iter(), vehicle: Vehicle::new(bus), steps: 0 }
    }
}

impl Default for Recording {
    fn default() -> Self {
        Self::new()
    }
}

/// A recorded flight being flown again.
pub struct Replay<'r, 'b> {
    recording: &'r Recording,
    arrivals: std::slice::Iter<'r, Arrival>,
    vehicle: Vehicle<'b>,
    steps: usize,
}

impl Replay<'_, '_> {
    /// One period of the flight loop: everything that came in, then everything that is due. Does nothing after the end.
    pub fn step(&mut self, observer: &mut impl Observer) {
        for arrival in self.arrivals.by_ref() {
            self.vehicle.take(arrival, observer);
            if matches!(arrival.input, Input::Imu(_)) {
                self.steps += 1;
                break;
            }
        }
    }

    /// Several steps that nobody watches.
    pub fn skip(&mut self, steps: usize) {
        (0..steps).for_each(|_| self.step(&mut ()));
    }

    /// Panics unless the motors were told just now what they were told in the recording.
    pub fn check(&mut self) {
        assert_eq!(Some(&self.vehicle.motors()), self.recording.motors.get(self.steps - 1), "the replay is the flight");
    }
}

/// The vehicle while it is being recorded.
struct Recorder<'b> {
    vehicle: Vehicle<'b>,
    arrivals: Vec<Arrival>,
    motors: Vec<MotorOutput>,
    flying_since: Option<usize>,
}

impl Recorder<'_> {
    fn arrive(&mut self, arrival: Arrival) {
        self.vehicle.take(&arrival, &mut ());
        self.arrivals.push(arrival);
    }

    /// Takes an inertial sample and returns what the motors are told.
    fn step(&mut self, imu: Arrival) -> MotorOutput {
        if let Some(command) = command_at(self.motors.len()) {
            self.arrive(Arrival { clock: imu.clock, at: imu.clock, input: Input::Guided(command) });
        }
        self.arrive(imu);
        let output = self.vehicle.motors();
        self.motors.push(output);
        let telemetry = self.vehicle.outside.link.telemetry.latest();
        if telemetry.is_some_and(|frame| frame.data.phase == FlightPhase::Flying) {
            self.flying_since.get_or_insert(self.motors.len());
        } else {
            self.flying_since = None;
        }
        output
    }
}

/// The mission, by step. Ten times a second something is said, or the link would count as lost.
fn command_at(step: usize) -> Option<GuidedCommand> {
    let go = |kind, x, y| GuidedCommand { kind, position: Vec3::new(x, y, -0.6), ..Default::default() };
    match step {
        2_000 => Some(go(GuidedKind::Arm, 0.0, 0.0)),
        2_200 => Some(go(GuidedKind::TakeOff, 0.0, 0.0)),
        4_840 => Some(go(GuidedKind::WayPoint, 0.4, 0.0)),
        4_880 => Some(go(GuidedKind::WayPoint, 0.4, 0.4)),
        _ if step.is_multiple_of(40) => Some(GuidedCommand::default()),
        _ => None,
    }
}
