//! What the schedule runs: each reads its topics, steps a component, publishes.
//!
//! What decides or computes is in [`navigation`](crate::navigation), [`autopilot`], [`protection`]
//! and [`stampfly_fixed_wing`]; change it there.

use crate::autopilot;
use crate::behaviour;
use crate::navigation::{Navigation, Samples};
use crate::parameters::Parameters;
use crate::protection;
use crate::topics::*;
use heapless::Vec;
use serde::{Deserialize, Serialize};
use stampfly_bus::{Activation, Runnable};
use stampfly_control::fixed_wing::{Autopilot, AutopilotConfig, Flown};
use stampfly_control::timing::StepTimer;
use stampfly_fixed_wing::messages::{Home, MeasuredHeights};
use stampfly_fixed_wing::{Config, PathManager, Sensed, Watch, Watched};
use stampfly_mode::FailsafeInput;
use stampfly_param::ParameterSet;
use stampfly_types::messages::{ControlOutput, SelfTestVerdict, SensorFindings};
use stampfly_types::{Duration, Instant, Stamped};

/// An estimate that is older is none: ten samples were missed.
const OLD: Duration = Duration::from_millis(25);
/// A battery that is not measured any more.
const UNMEASURED: Duration = Duration::from_secs(2);

/// Sensors to state.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Estimation {
    navigation: Navigation,
    home: Home,
    heights: MeasuredHeights,
}

impl Estimation {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let (home, heights) = (Home::default(), MeasuredHeights::default());
        Self { navigation: Navigation::new(parameters), home, heights }
    }
}

impl Runnable for Estimation {
    type Ends<'b> = EstimationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut EstimationEnds<'_>) {
        let now = activation.now();
        let samples = Samples {
            imu: &ends.sensor_imu,
            mag: &ends.sensor_mag,
            baro: &ends.sensor_baro,
            gnss: &ends.sensor_gnss,
            airspeed: &ends.sensor_airspeed,
        };
        self.navigation.step(now, &samples, !ends.flight_status.get().armed);
        ends.estimate_state.publish(now, &self.navigation.estimate());
        ends.estimate_status.publish(now, &self.navigation.status());
        ends.air.publish(now, &self.navigation.air());
        if *self.navigation.home() != self.home {
            self.home = *self.navigation.home();
            ends.home.publish(now, &self.home);
        }
        if *self.navigation.heights() != self.heights {
            self.heights = *self.navigation.heights();
            ends.measured_heights.publish(now, &self.heights);
        }
    }
}

/// Inertial samples to what is wrong.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Failsafe(stampfly_mode::Failsafe);

impl Failsafe {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        Self(stampfly_mode::Failsafe::new(protection::config(parameters)))
    }
}

impl Runnable for Failsafe {
    type Ends<'b> = FailsafeEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut FailsafeEnds<'_>) {
        let now = activation.now();
        // They change on the ground, and with a sample: before it the sensor would count as silent.
        if ends.parameters.is_new() && !ends.sensor_imu.is_empty() {
            self.0 = stampfly_mode::Failsafe::new(protection::config(ends.parameters.get()));
        }
        let heard = ends.path_status.get().heard;
        let alert = self.0.step(
            now,
            &FailsafeInput {
                imu: &ends.sensor_imu,
                estimate: &protection::above_any_ground(ends.estimate_state.get()),
                status: ends.estimate_status.get(),
                findings: &SensorFindings::default(),
                power: ends.sensor_power.sample().map(|sample| (sample.at, &sample.data)),
                command: (heard > Instant::ZERO).then_some(heard),
                // It has neither; that the barometer is silent, the watch need not know.
                tof: Some(now),
                flow: Some(now),
                baro: Some(now),
                output: &ControlOutput::default(),
                unmet: [0.0; 4],
                thrust: None,
                self_test: SelfTestVerdict::NotRun,
                flight_status: ends.flight_status.get(),
            },
        );
        ends.system_alert.publish(now, &alert);
    }
}

/// Demand and state to surfaces and throttle.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Control {
    autopilot: Autopilot,
    config: AutopilotConfig,
    timer: StepTimer,
}

impl Control {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let config = autopilot::config(parameters);
        Self { autopilot: Autopilot::default(), config, timer: StepTimer::default() }
    }
}

impl Runnable for Control {
    type Ends<'b> = ControlEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut ControlEnds<'_>) {
        let now = activation.now();
        let dt = self.timer.step(now);
        if ends.parameters.is_new() {
            self.config = autopilot::config(ends.parameters.get());
        }
        let demand = ends.demand.get();
        let faulty = ends.system_alert.get().active.intersects(protection::BLIND);
        let (motor, servos) = match ends.estimate_state.fresh(now, OLD).filter(|_| !faulty) {
            Some(state) => {
                let flown = self.autopilot.step(dt, demand, state, ends.air.get(), &self.config);
                autopilot::outputs(&flown, demand.brake, ends.flight_status.get().armed)
            }
            // Without a state to fly by: a loop on a state that stands still would wind up.
            None => autopilot::outputs(&Flown::default(), false, false),
        };
        ends.actuator_motor.publish(now, &motor);
        ends.actuator_servo.publish(now, &servos);
    }
}

/// What is wrong.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Watching {
    watch: Watch,
    config: Config,
}

impl Watching {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        Self { watch: Watch::default(), config: behaviour::config(parameters) }
    }
}

impl Runnable for Watching {
    type Ends<'b> = WatchEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut WatchEnds<'_>) {
        let now = activation.now();
        if ends.parameters.is_new() {
            self.config = behaviour::config(ends.parameters.get());
        }
        let status = ends.path_status.get();
        let alerts = ends.system_alert.get().active;
        let faulty = alerts.intersects(protection::BLIND);
        let watched = Watched {
            // What does not measure shows no attitude.
            estimate: ends.estimate_state.fresh(now, OLD).filter(|_| !faulty),
            air: ends.air.get(),
            power: ends.sensor_power.fresh(now, UNMEASURED),
            heard: (status.heard > Instant::ZERO).then_some(status.heard),
            heights: ends.measured_heights.get().both(),
            place: status.place,
            armed: ends.flight_status.get().armed,
            blow: alerts.intersects(protection::BLOW),
            config: &self.config,
        };
        ends.safety.publish(now, &self.watch.step(now, &watched));
    }
}

/// The path manager.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Path {
    manager: PathManager,
    config: Config,
    heard: Instant,
}

impl Path {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        Self { manager: PathManager::default(), config: behaviour::config(parameters), heard: Instant::ZERO }
    }
}

impl Runnable for Path {
    type Ends<'b> = PathEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut PathEnds<'_>) {
        let now = activation.now();
        let commands: Vec<_, 32> = data(&ends.command_guided);
        let edits: Vec<_, 16> = data(&ends.way_point_edit);
        if !commands.is_empty() || !edits.is_empty() {
            self.heard = now;
        }
        if ends.parameters.is_new() {
            self.config = behaviour::config(ends.parameters.get());
        }
        let sensed = Sensed {
            estimate: ends.estimate_state.get(),
            air: ends.air.get(),
            home: ends.home.get(),
            safety: ends.safety.get(),
            config: &self.config,
            commands: &commands,
            edits: &edits,
        };
        let demand = self.manager.cycle(now, &sensed);
        ends.demand.publish(now, &demand);
        let mut status = *self.manager.status();
        status.heard = self.heard;
        ends.path_status.publish(now, &status);
        ends.flight_status.publish(now, &stampfly_fixed_wing::status(&self.manager, &sensed));
    }
}

/// What came without its stamps. The room is the queue's, so all of it fits; `collect` would panic if not.
fn data<M: Copy, const N: usize>(samples: &[Stamped<M>]) -> Vec<M, N> {
    let mut all = Vec::new();
    for sample in samples {
        let _ = all.push(sample.data);
    }
    all
}

/// Requests to the parameters in use.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Storage(ParameterSet<Parameters>);

impl Storage {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        // A vehicle that is given values it would refuse starts with the table's.
        Self(ParameterSet::new(*parameters, Duration::ZERO).unwrap_or_default())
    }
}

impl Runnable for Storage {
    type Ends<'b> = StorageEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut StorageEnds<'_>) {
        let now = activation.now();
        // In the air nothing but what the ground has tried: changes wait for the ground.
        let on_ground = !ends.flight_status.get().armed;
        let requests = ends.parameter_request.iter().map(|request| request.data);
        if let Some((parameters, status)) = self.0.period(now, on_ground, requests) {
            ends.parameters.publish(now, &parameters);
            ends.parameter_status.publish(now, &status);
        }
    }
}
