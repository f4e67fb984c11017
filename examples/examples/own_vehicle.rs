//! A delivery robot from the crates alone: two wheels, a gyroscope, a satellite receiver. For `docs/guide/own-vehicle.md`.
//!
//! It stands facing north until the receiver has a fix, drives round two corners and stops. The drive is computed again from its log,
//! bit for bit.

// ANCHOR: tables
use serde::{Deserialize, Serialize};
use stampfly_bus::{Activation, Instant, Runnable, message};
use stampfly_control::drive::Differential;
use stampfly_drivers::{Gnss, Imu};
use stampfly_eskf::{Eskf, EskfConfig, Estimator, StartHeading, aid::velocity, calibration::StillCalibration};
use stampfly_flight::{Assembled, Recorder, ReplayOptions, replay::Memory, replay::replay};
use stampfly_sim::plant::{Body, Motion, STEP};
use stampfly_sim::sensors::{GnssConfig, GnssModel};
use stampfly_sim::{Simulation, time::Tasks};
use stampfly_types::{Origin, Vec3, frame, math, messages::*};

/// Track 0.5 m, 2 m/s at full power.
const CHASSIS: Differential = Differential { track: 0.5, speed_max: 2.0 };
/// The start.
const DEPOT: Origin = Origin { latitude: 365_440_000, longitude: 1_367_050_000, altitude: 30_000 };
/// The corners of its route, metres north and east of the depot.
const ROUTE: [Vec3; 3] = [Vec3::new(20.0, 0.0, 0.0), Vec3::new(20.0, 15.0, 0.0), Vec3::new(5.0, 15.0, 0.0)];

message! {
    /// Speeds of the wheels, measured or commanded.
    pub struct Wheels {
        /// Left and right.
        speed: [f32; 2] ["m/s"],
    }
}

mod topics {
    use super::*;

    stampfly_bus::topics! {
        outside imu, receiver, encoders, motors;

        /// Turn rate and acceleration, every sample.
        sensor_imu: ImuData = ring(16) @ 400 Hz from imu => [localisation];
        /// Position and velocity from satellites.
        sensor_gnss: GnssData = ring(4) @ 5 Hz from receiver => [localisation];
        /// Measured wheel speeds.
        sensor_wheels: Wheels = ring(4) @ 50 Hz from encoders => [localisation];
        /// Estimated state, the newest.
        estimate_state: StateEstimate = latest @ 400 Hz from localisation => [pilot];
        /// Commanded wheel speeds, the newest.
        actuator_wheels: Wheels = latest @ 50 Hz from pilot => [motors];
    }
}

stampfly_bus::schedule! {
    /// The robot.
    #[derive(Clone, Serialize, Deserialize)]
    struct Robot on topics from EskfConfig;

    /// State estimation.
    localisation = Localisation: on sensor_imu, flight, 300 us;
    /// Guidance and control.
    pilot = Pilot: every 20 ms, background, 50 us;
}
// ANCHOR_END: tables

// ANCHOR: localisation
/// Calibrates the gyroscope while the robot stands still, then fuses three sensors.
#[derive(Clone, Serialize, Deserialize)]
struct Localisation {
    calibration: StillCalibration,
    estimator: Eskf,
}

impl Localisation {
    fn new(config: &EskfConfig) -> Self {
        Self { calibration: StillCalibration::default(), estimator: Eskf::new(*config) }
    }
}

impl Runnable for Localisation {
    type Ends<'b> = topics::LocalisationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        for sample in ends.sensor_imu.iter() {
            if self.calibration.result().complete {
                self.estimator.predict(sample.at, &sample.data);
            } else if self.calibration.step(sample.at, &sample.data).is_ok() && self.calibration.result().complete {
                self.estimator.initialize(sample.at, &self.calibration.result());
            }
        }
        for sample in ends.sensor_wheels.iter() {
            // The body moves as the wheels roll, not sideways and not up; sigma 5 cm/s, gate 5 sigma.
            let [left, right] = sample.data.speed;
            _ = self.estimator.fuse(sample.at, velocity::body, [0.5 * (left + right), 0.0, 0.0], [0.0025; 3], 5.0);
        }
        for sample in ends.sensor_gnss.iter() {
            _ = self.estimator.fuse_gnss(sample.at, &sample.data, &DEPOT);
        }
        ends.estimate_state.publish(activation.now(), &self.estimator.estimate());
    }
}
// ANCHOR_END: localisation

// ANCHOR: pilot
/// Drives to the next corner and stops at the last one. The field counts the corners passed.
#[derive(Clone, Serialize, Deserialize)]
struct Pilot(usize);

impl Pilot {
    fn new(_: &EskfConfig) -> Self {
        Self(0)
    }
}

impl Runnable for Pilot {
    type Ends<'b> = topics::PilotEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        let estimate = ends.estimate_state.get();
        let mut shares = [0.0; 2];
        if let (Some(corner), true) = (ROUTE.get(self.0), estimate.valid.contains(Validity::POSITION_XY)) {
            let way = (*corner - estimate.position).horizontal();
            self.0 += usize::from(way.norm() < 0.5);
            let aside = math::wrap_angle(math::atan2(way.y, way.x) - frame::yaw(&estimate.attitude));
            shares = CHASSIS.mix(math::cos(aside).max(0.0), 2.0 * aside);
        }
        let speed = shares.map(|share| share * CHASSIS.speed_max);
        ends.actuator_wheels.publish(activation.now(), &Wheels { speed });
    }
}
// ANCHOR_END: pilot

// ANCHOR: body
/// The simulated robot: wheel speeds left and right, and commanded wheel speeds.
#[derive(Debug, Default)]
struct Chassis {
    motion: Motion,
    wheels: [f64; 2],
    told: [f64; 2],
}

impl Body for Chassis {
    fn step(&mut self) {
        let dt = STEP.seconds_f64();
        for (wheel, told) in self.wheels.iter_mut().zip(self.told) {
            // Motor lag 0.1 s.
            *wheel += (told - *wheel) * dt / 0.1;
        }
        let [left, right] = self.wheels;
        self.motion.roll(dt, 0.5 * (left + right), (left - right) / f64::from(CHASSIS.track));
    }

    fn motion(&self) -> &Motion {
        &self.motion
    }
}
// ANCHOR_END: body

// ANCHOR: main
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let start_heading = StartHeading::Given { heading: 0.0, sigma: 0.05 };
    let config = EskfConfig { start_heading, ..EskfConfig::outdoors() };
    let mut bus = topics::Bus::new();
    let Assembled { mut flight_loop, outside, mut taps } =
        Assembled::<Robot>::new(&mut bus, None, &config, Instant::ZERO);
    let topics::Outside { mut imu, mut receiver, mut encoders, mut motors } = outside;

    let Simulation { clock, world, sensors } = Simulation::of(Chassis::default(), 1);
    let (mut gyroscope, mut tasks) = (sensors.imu, Tasks::new(clock.clone()));
    let mut satellites = GnssModel::new(&world, &clock, 1, &GnssConfig::m8(DEPOT));
    tasks.spawn(async move {
        loop {
            let Ok(sample) = gyroscope.next().await;
            imu.sensor_imu.publish(sample.at, &sample.data);
        }
    });
    tasks.spawn(async move {
        loop {
            let Ok(sample) = satellites.next().await;
            receiver.sensor_gnss.publish(sample.at, &sample.data);
        }
    });

    let mut recorder = Recorder::<Robot, _>::start(Memory::default(), "delivery robot", Instant::ZERO)?;
    for now in (1..=75 * 50).map(|tick| Instant::from_millis(20 * tick)) {
        tasks.run_until(now);
        let wheels = world.inspect_as(|robot: &Chassis| robot.wheels).unwrap_or_default();
        encoders.sensor_wheels.publish(now, &Wheels { speed: wheels.map(|speed| speed as f32) });
        recorder.pass(&mut flight_loop, &mut taps, now);
        if let Some(told) = motors.actuator_wheels.latest() {
            world.change(now, |robot: &mut Chassis| robot.told = told.data.speed.map(f64::from));
        }
    }
    let log = recorder.into_sink().0;
    std::fs::write(std::env::temp_dir().join("own_vehicle.ulg"), &log)?;

    let again = replay::<Robot>(&log, config, |_, _, _| true, ReplayOptions::default())?;
    let beside = (world.truth_at(clock.now()).position - ROUTE[2]).horizontal().norm();
    println!("{beside:.1} m beside the goal; {} samples again, different: {:?}", again.samples, again.difference);
    // The receiver's error is about two metres.
    if again.difference.is_none() && beside < 3.0 { Ok(()) } else { Err("not there, or not the same".into()) }
}
// ANCHOR_END: main
