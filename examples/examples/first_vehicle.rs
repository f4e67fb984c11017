//! The program of the tutorial `docs/guide/tutorial.md`: a quadcopter from its mass to a hover a metre above the floor.
//!
//! It stands still until its sensors are calibrated, climbs, flies half a metre north and hovers. The flight is logged and computed
//! again from the log, bit for bit.

use serde::{Deserialize, Serialize};
use stampfly_bus::{Activation, Duration, Instant, Runnable};
use stampfly_control::{
    Airframe, CascadeConfig, CascadeController, ControlInput, Controller, Mixer, MotorConfig, MotorCurve, MotorStage,
    MultirotorMixer, Rotor,
};
use stampfly_drivers::{Imu, MotorOutputs, OpticalFlow, RangeFinder};
use stampfly_eskf::calibration::StillCalibration;
use stampfly_eskf::{Eskf, EskfConfig, Estimator, Measurements, feed};
use stampfly_flight::{Assembled, Recorder, ReplayOptions, key_frame, replay::Memory, replay::replay};
use stampfly_sim::{Simulation, SimulationConfig, time::Tasks};
use stampfly_types::Vec3;
use stampfly_types::messages::*;

// ANCHOR: airframe
/// The airframe, from which gains and limits are derived.
const AIRFRAME: Airframe = Airframe {
    mass: 0.05,
    inertia: Vec3::new(2.0e-5, 2.5e-5, 4.0e-5),
    // Four rotors in an X, 3 cm ahead or behind and 3 cm to the side; drag torque is 5 mm times thrust.
    rotors: &Rotor::quadrotor_x(0.03, 0.005),
    // Voltage that holds a rotor speed, and thrust at that speed.
    motor: MotorCurve { ct: 1.5e-8, am: 7.0e-8, bm: 6.0e-4, cm: 0.02 },
    motor_lag: 0.02,
    motor_thrust_max: 0.2,
    cells: 1,
};
// ANCHOR_END: airframe

// ANCHOR: topics
mod topics {
    use stampfly_types::messages::*;

    stampfly_bus::topics! {
        outside imu, range_finder, flow_sensor, motors;

        /// Inertial samples, every one.
        sensor_imu: ImuData = ring(16) @ 400 Hz from imu => [estimation];
        /// Distance to the floor.
        sensor_tof: TofData = ring(4) @ 30 Hz from range_finder => [estimation];
        /// Optical flow.
        sensor_flow: FlowData = ring(4) @ 100 Hz from flow_sensor => [estimation];
        /// Estimated state, the newest.
        estimate_state: StateEstimate = latest @ 400 Hz from estimation => [plan, control];
        /// Position to fly to, the newest.
        setpoint: Setpoint = latest @ 400 Hz from plan => [control];
        /// Motor duties, the newest.
        actuator_motor: MotorOutput = latest @ 400 Hz from control => [motors];
    }
}
// ANCHOR_END: topics

// ANCHOR: schedule
stampfly_bus::schedule! {
    /// The vehicle.
    #[derive(Clone, Serialize, Deserialize)]
    struct Vehicle on topics from Airframe;

    /// State estimation.
    estimation = Estimation: on sensor_imu, flight, 300 us;
    /// Set-point.
    plan = Plan: after estimation, flight, 20 us;
    /// Control and mixing.
    control = Control: after plan, flight, 100 us;
}
// ANCHOR_END: schedule

// ANCHOR: estimation
/// Calibrates while the vehicle stands still, then estimates.
#[derive(Clone, Serialize, Deserialize)]
struct Estimation {
    calibration: StillCalibration,
    estimator: Eskf,
}

impl Estimation {
    fn new(_: &Airframe) -> Self {
        Self { calibration: StillCalibration::default(), estimator: Eskf::new(EskfConfig::default()) }
    }
}

impl Runnable for Estimation {
    type Ends<'b> = topics::EstimationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        if !self.calibration.result().complete {
            for sample in ends.sensor_imu.iter() {
                // A sample in motion restarts the calibration.
                _ = self.calibration.step(sample.at, &sample.data);
            }
            if self.calibration.result().complete {
                self.estimator.initialize(activation.now(), &self.calibration.result());
            }
        }
        let measurements = Measurements {
            imu: &ends.sensor_imu,
            tof: &ends.sensor_tof,
            flow: &ends.sensor_flow,
            ..Measurements::default()
        };
        feed(&mut self.estimator, &measurements, |_, _, _| {});
        ends.estimate_state.publish(activation.now(), &self.estimator.estimate());
    }
}
// ANCHOR_END: estimation

// ANCHOR: plan
/// Climbs to a metre once the estimate is valid, and flies half a metre north five seconds later.
#[derive(Clone, Serialize, Deserialize)]
struct Plan {
    begun: Option<Instant>,
}

impl Plan {
    fn new(_: &Airframe) -> Self {
        Self { begun: None }
    }
}

impl Runnable for Plan {
    type Ends<'b> = topics::PlanEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        let now = activation.now();
        if self.begun.is_none() && ends.estimate_state.get().valid.contains(Validity::TILT | Validity::HEIGHT) {
            self.begun = Some(now);
        }
        // Down is positive: a metre up is −1. Half a metre a second.
        let setpoint = self.begun.map_or(Setpoint::default(), |begun| {
            let seconds = now.since(begun).seconds();
            let north = ((seconds - 5.0) * 0.25).clamp(0.0, 0.5);
            Setpoint {
                position: Vec3::new(north, 0.0, -(seconds * 0.5).min(1.0)),
                axes: SetpointAxes::POSITION_XY | SetpointAxes::POSITION_Z | SetpointAxes::YAW,
                ..Setpoint::default()
            }
        });
        ends.setpoint.publish(now, &setpoint);
    }
}
// ANCHOR_END: plan

// ANCHOR: control
/// Computes motor duties from estimate and set-point.
#[derive(Clone, Serialize, Deserialize)]
struct Control {
    controller: CascadeController,
    mixer: MultirotorMixer,
    motors: MotorStage,
    unmet: [f32; 4],
}

impl Control {
    fn new(airframe: &Airframe) -> Self {
        Self {
            controller: CascadeController::new(&CascadeConfig::for_airframe(airframe)),
            mixer: MultirotorMixer::for_airframe(airframe).expect("four rotors around the centre"),
            motors: MotorStage::new(&MotorConfig::for_airframe(airframe)),
            unmet: [0.0; 4],
        }
    }
}

impl Runnable for Control {
    type Ends<'b> = topics::ControlEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        let (now, setpoint) = (activation.now(), ends.setpoint.get());
        let armed = !setpoint.axes.is_empty();
        let demand = self.controller.step(
            now,
            &ControlInput {
                estimate: ends.estimate_state.get(),
                command: &CommandSetpoint::default(),
                setpoint,
                flight_status: &FlightStatus {
                    phase: if armed { FlightPhase::Flying } else { FlightPhase::IdleGround },
                    mode: FlightMode::PosHold,
                    armed,
                    ..FlightStatus::default()
                },
                land_detected: &LandDetected {
                    contact: GroundContact::Air,
                    thrust_ceiling: f32::MAX,
                    ..Default::default()
                },
                unmet: self.unmet,
            },
        );
        let mixed = self.mixer.mix(&demand);
        self.unmet = mixed.unmet;
        // No battery voltage: this vehicle does not measure it.
        ends.actuator_motor.publish(now, &self.motors.step(now, &mixed, None, armed));
    }
}
// ANCHOR_END: control

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // ANCHOR: assemble
    let mut bus = topics::Bus::new();
    let Assembled { mut flight_loop, outside, mut taps } =
        Assembled::<Vehicle>::new(&mut bus, None, &AIRFRAME, Instant::ZERO);
    let topics::Outside { mut imu, mut range_finder, mut flow_sensor, mut motors } = outside;
    // ANCHOR_END: assemble

    // ANCHOR: simulation
    let Simulation { clock, world, sensors } = Simulation::new(&SimulationConfig::example());
    let (mut gyros, mut range, mut camera, mut rotors) = (sensors.imu, sensors.tof, sensors.flow, sensors.motors);
    let mut tasks = Tasks::new(clock.clone());
    // One task per sensor, as on a microcontroller. Replace the three by your drivers, and the loop below by a timer.
    tasks.spawn(async move {
        loop {
            let Ok(sample) = gyros.next().await;
            imu.sensor_imu.publish(sample.at, &sample.data);
        }
    });
    tasks.spawn(async move {
        loop {
            let Ok(sample) = range.next().await;
            range_finder.sensor_tof.publish(sample.at, &sample.data);
        }
    });
    tasks.spawn(async move {
        loop {
            let Ok(sample) = camera.next().await;
            flow_sensor.sensor_flow.publish(sample.at, &sample.data);
        }
    });
    // ANCHOR_END: simulation

    // ANCHOR: fly
    let mut recorder = Recorder::<Vehicle, _>::start(Memory::default(), "first vehicle", Instant::ZERO)?;
    let mut now = Instant::ZERO;
    println!("   time    north     east   height");
    while now < Instant::from_secs(12) {
        now += Duration::from_micros(2_500);
        tasks.run_until(now);
        recorder.pass(&mut flight_loop, &mut taps, now);
        if let Some(output) = motors.actuator_motor.latest() {
            let Ok(()) = rotors.write(&output.data);
        }
        if now.as_micros().is_multiple_of(1_000_000) {
            let truth = world.truth_at(now).position;
            println!("{:5.0} s {:6.2} m {:6.2} m {:6.2} m", now.seconds_f64(), truth.x, truth.y, -truth.z);
        }
    }
    // ANCHOR_END: fly

    // ANCHOR: replay
    let mut frame = [0; 32_768];
    let length = key_frame::encode(&flight_loop, now, &mut frame)?;
    recorder.key_frame(now, &frame[..length])?;
    let log = recorder.into_sink().0;
    let again = replay::<Vehicle>(&log, AIRFRAME, |_, _, _| true, ReplayOptions::default())?;
    assert_eq!((again.difference, again.key_frames), (None, 1), "bit for bit, and the same state at the end");
    println!("{} activations flown again from {} kB of log: the same bits", again.activations, log.len() / 1000);
    // ANCHOR_END: replay

    let place = world.truth_at(now).position;
    assert!((place - Vec3::new(0.5, 0.0, -1.0)).norm() < 0.1, "it is where it should be: {place:?}");
    // ANCHOR: save
    let path = std::env::temp_dir().join("first_vehicle.ulg");
    std::fs::write(&path, &log)?;
    println!("the log is in {}", path.display());
    // ANCHOR_END: save
    Ok(())
}
