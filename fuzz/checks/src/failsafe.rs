//! The failsafe under any stream of inertial samples.

use crate::Input;
use stampfly_mode::decision::CUT;
use stampfly_mode::{Failsafe, FailsafeConfig, FailsafeInput};
use stampfly_types::messages::{
    ControlOutput, EstimatorStatus, FlightPhase, FlightStatus, ImuData, SelfTestVerdict, SensorFindings, StateEstimate,
    Validity,
};
use stampfly_types::{Duration, Instant, Stamped};

/// Full scale of what a byte gives: a little more than the sensor's.
const FORCE: f32 = 90.0;
const RATE: f32 = 40.0;

/// Steps of an armed vehicle, each with a time and, mostly, a sample. The first byte says in which phase it is.
pub fn failsafe_stream(data: &[u8]) {
    let mut input = Input(data);
    let config = FailsafeConfig::default();
    let mut failsafe = Failsafe::new(config);
    let phases =
        [FlightPhase::Armed, FlightPhase::TakeOff, FlightPhase::Flying, FlightPhase::Landing, FlightPhase::Flip];
    let phase = phases[usize::from(input.byte()) % phases.len()];
    let flight_status = FlightStatus { phase, armed: true, ..Default::default() };
    let estimate = StateEstimate { height: 1.0, valid: Validity::ALL, ..Default::default() };
    let (mut now, mut measured, mut cut) = (Instant::ZERO, Instant::ZERO, false);
    while !input.is_empty() {
        let (kind, step) = (input.byte(), input.byte());
        now += Duration::from_micros(100 * u64::from(step));
        let sample = (kind % 4 != 1).then(|| {
            let data = ImuData { accel: input.vector(FORCE), gyro: input.vector(RATE), ..Default::default() };
            let at = match kind % 4 {
                // From the future, and the past.
                2 => now + Duration::from_millis(u64::from(kind)),
                3 => Instant::from_micros(now.as_micros().saturating_sub(1_000 * u64::from(kind))),
                _ => now,
            };
            Stamped { at, generation: 0, data }
        });
        let imu: Vec<_> = sample.into_iter().collect();
        let usable = |sample: &Stamped<ImuData>| {
            (sample.data.accel.norm_squared() + sample.data.gyro.norm_squared()).is_finite()
        };
        if let Some(newest) = imu.iter().find(|sample| usable(sample)) {
            measured = measured.max(newest.at.min(now));
        }
        let alerts = failsafe.step(
            now,
            &FailsafeInput {
                imu: &imu,
                estimate: &estimate,
                status: &EstimatorStatus::default(),
                findings: &SensorFindings::default(),
                power: None,
                command: Some(now),
                tof: None,
                flow: None,
                baro: None,
                output: &ControlOutput::default(),
                unmet: [0.0; 4],
                thrust: None,
                self_test: SelfTestVerdict::NotRun,
                flight_status: &flight_status,
            },
        );
        let cuts = alerts.active.intersects(CUT);
        assert!(cuts || now.since(measured) < config.imu_lost, "nothing measured for {:?}", now.since(measured));
        assert!(cuts || !cut, "an alert that stops the motors is gone while armed");
        assert!(alerts.seen.contains(alerts.active));
        cut = cuts;
    }
}
