//! The gyro's zero has shifted in flight, or a burst has rotated the attitude, seen in the course
//! of the camera velocity.
//!
//! The camera residual exceeds its gate with the course that a shift produces, and no camera fault
//! explains it as well ([`course`](crate::course)). The camera is then the correct sensor.
//!
//! Not for a jump that is visible in a single sample: [`gyro_jumped`](super::gyro_jumped) needs
//! only 50 ms.

use crate::config::MonitorConfig;
use crate::course::Explanation;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::messages::{EstimateCorrection, Finding};
use stampfly_types::{Duration, Instant, Vec3, math};

/// Smallest time between two shifts: two lifetimes of a reckoner.
const LATELY: Duration = Duration::from_secs(6);
/// Uncertain share of a shift after the fit.
const UNCERTAIN: f32 = 0.1;

/// Tests whether the camera velocity deviates from dead reckoning as a shifted gyro zero predicts.
/// Details are at the head of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GyroShifted {
    /// Time for which the residual has exceeded the gate, s.
    exceeds: f32,
    /// Time of the last shift.
    last: Option<Instant>,
}

impl GyroShifted {
    /// Whether a shift was found so recently that another one has a different cause: a zero shifts
    /// once, while a floor that moves back and forth produces one course after the other.
    pub(crate) fn was_lately(&self, now: Instant) -> bool {
        self.last.is_some_and(|last| now.since(last) < LATELY)
    }
}

impl Hypothesis for GyroShifted {
    const SENSOR: Sensor = Sensor::Gyro;
    const FINDING: Finding = Finding::Shifted;

    fn step(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        let Some(flow) = &seen.flow else { return Opinion::Unknown };
        if seen.stands || !flow.comparable || !seen.settled {
            self.exceeds = 0.0;
            return Opinion::Unknown;
        }
        self.exceeds = if flow.ratio > 1.0 { self.exceeds + flow.interval } else { 0.0 };
        if self.exceeds < config.lasts_s {
            return Opinion::Unknown;
        }
        let older = seen.reckoners.older();
        let limits = seen.limits(config, older, flow.distance);
        let Explanation::Gyro(shift) = seen.course(older).explanation(&limits) else {
            return Opinion::Unknown;
        };
        self.exceeds = 0.0;
        if seen.shifted_lately {
            return Opinion::Unknown;
        }
        self.last = Some(seen.now);
        let reckoner = seen.reckoners.get(older);
        let [north, east] = shift.rate;
        // Continue the rotation from the last point to the present.
        let since = reckoner.age - shift.at;
        let turn = Vec3::new(shift.turn[0] - north * since, shift.turn[1] - east * since, 0.0);
        // The camera is correct except for its rotation compensation.
        let [x, y] = flow.smooth.get(older).copied().unwrap_or_default();
        let velocity = Vec3::new(x + flow.distance * east, y - flow.distance * north, 0.0);
        let rate = reckoner.attitude.inverse_transform_vector(&Vec3::new(north, east, 0.0));
        let reckoned = seen.back_to(older);
        Opinion::Holds(Some(EstimateCorrection {
            turn: reckoned.turn + turn,
            velocity: reckoned.velocity + velocity,
            gyro_bias: reckoned.gyro_bias + rate,
            tilt_sigma: math::larger(reckoned.tilt_sigma, UNCERTAIN * turn.norm()),
            gyro_bias_sigma: UNCERTAIN * rate.norm(),
            velocity_sigma: config.velocity_sigma_m_s,
            ..reckoned
        }))
    }
}
