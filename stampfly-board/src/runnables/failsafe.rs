//! Failsafe: everything that can go wrong in, alerts out. Runs on a deadline when the inertial sensor is silent.

use crate::wiring;
use heapless::Vec;
use stampfly_bus::{Activation, Runnable, Stamped};
use stampfly_mode::{Failsafe, FailsafeInput};
use stampfly_types::Instant;
use stampfly_types::messages::*;

/// Failsafe: everything that can go wrong in, alerts out.
pub struct FailsafeMonitor<'b> {
    ports: FailsafePorts<'b>,
    failsafe: Failsafe,
    imu_samples: Vec<Stamped<ImuData>, 16>,
    tof_samples: Vec<Stamped<TofData>, 8>,
    flow_samples: Vec<Stamped<FlowData>, 16>,
    pilot_frames: Vec<Stamped<PilotInput>, 8>,
    guided_commands: Vec<Stamped<GuidedCommand>, 16>,
    power: Option<Stamped<PowerData>>,
    estimate: StateEstimate,
    status: EstimatorStatus,
    self_test: SelfTest,
    mode: SystemMode,
    last_command: Option<Instant>,
    last_tof: Option<Instant>,
    last_flow: Option<Instant>,
}

/// The ends it owns.
pub struct FailsafePorts<'b> {
    /// Inertial samples.
    pub imu: wiring::sensor_imu::Rx<'b>,
    /// Ranges.
    pub tof: wiring::sensor_tof::Rx<'b>,
    /// Flow.
    pub flow: wiring::sensor_flow::Rx<'b>,
    /// Battery.
    pub power: wiring::sensor_power::Rx<'b>,
    /// The pilot's frames.
    pub pilot: wiring::command_pilot::Rx<'b>,
    /// Commands from programs.
    pub guided: wiring::command_guided::Rx<'b>,
    /// The state.
    pub estimate: wiring::estimate_state::Rx<'b>,
    /// The estimator's opinion of itself.
    pub status: wiring::estimate_status::Rx<'b>,
    /// The self test at power-on.
    pub self_test: wiring::self_test::Rx<'b>,
    /// State and mode one step ago.
    pub mode: wiring::system_mode::Rx<'b>,
    /// What was found.
    pub alert: wiring::system_alert::Tx<'b>,
}

impl<'b> FailsafeMonitor<'b> {
    /// Nothing wrong yet.
    #[must_use]
    pub fn new(ports: FailsafePorts<'b>) -> Self {
        Self {
            ports,
            failsafe: Failsafe::default(),
            imu_samples: Vec::new(),
            tof_samples: Vec::new(),
            flow_samples: Vec::new(),
            pilot_frames: Vec::new(),
            guided_commands: Vec::new(),
            power: None,
            estimate: StateEstimate::default(),
            status: EstimatorStatus::default(),
            self_test: SelfTest::default(),
            mode: SystemMode::default(),
            last_command: None,
            last_tof: None,
            last_flow: None,
        }
    }
}

impl Runnable for FailsafeMonitor<'_> {
    fn read(&mut self, activation: &mut Activation) {
        activation.drain(&mut self.ports.imu, &mut self.imu_samples);
        activation.drain(&mut self.ports.tof, &mut self.tof_samples);
        activation.drain(&mut self.ports.flow, &mut self.flow_samples);
        activation.drain(&mut self.ports.pilot, &mut self.pilot_frames);
        activation.drain(&mut self.ports.guided, &mut self.guided_commands);
        self.power = activation.latest(&mut self.ports.power);
        activation.update(&mut self.ports.estimate, &mut self.estimate);
        activation.update(&mut self.ports.status, &mut self.status);
        activation.update(&mut self.ports.self_test, &mut self.self_test);
        activation.update(&mut self.ports.mode, &mut self.mode);
    }

    fn run(&mut self, activation: &mut Activation) {
        let newest = |a: Option<Instant>, b: Option<Instant>| a.max(b);
        let usable = |samples: &[Stamped<TofData>]| samples.iter().filter(|s| s.data.valid).map(|s| s.at).max();
        self.last_tof = newest(self.last_tof, usable(&self.tof_samples));
        let flow = self.flow_samples.iter().filter(|s| s.data.valid).map(|s| s.at).max();
        self.last_flow = newest(self.last_flow, flow);
        let pilot = self.pilot_frames.last().map(|s| s.at);
        let guided = self.guided_commands.last().map(|s| s.at);
        self.last_command = newest(self.last_command, newest(pilot, guided));

        let input = |imu| FailsafeInput {
            imu,
            estimate: &self.estimate,
            status: &self.status,
            power: self.power.as_ref().map(|s| (s.at, &s.data)),
            command: self.last_command,
            tof: self.last_tof,
            flow: self.last_flow,
            self_test: self.self_test.verdict,
            mode: &self.mode,
        };
        // Every sample counts for the impact detector, also those that came while something else ran.
        let mut alert = None;
        for sample in &self.imu_samples {
            alert = Some(self.failsafe.step(activation.now(), &input(Some((sample.at, &sample.data)))));
        }
        let alert = alert.unwrap_or_else(|| self.failsafe.step(activation.now(), &input(None)));
        self.ports.alert.publish(activation.now(), &alert);
    }
}
