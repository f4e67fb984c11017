//! One flight's consistency: its errors and innovations against what the estimator claimed for them.

use super::shadow::{Sensor, Shadow};
use super::{BLOCKS, SENSORS};
use nalgebra::{SMatrix, SVector};
use stampfly_board::schedule::Runnables;
use stampfly_board::topics::Id;
use stampfly_bus::Activation;
use stampfly_eskf::filter::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, N, POSITION, VELOCITY};
use stampfly_eskf::{EskfConfig, Estimator, Fusion};
use stampfly_flight::Observer;
use stampfly_sim::vehicle::Witness;
use stampfly_sim::{Noise, Truth};
use stampfly_types::messages::{FlightPhase, FlightStatus, Validity};
use stampfly_types::{Duration, Instant, Message, Quat, Vec3};

/// Errors are looked at this often.
const PERIOD: Duration = Duration::from_millis(100);
/// A sensor that is kept out for this long must be back in, or the estimate must say that it is lost.
const PATIENCE: Duration = Duration::from_secs(1);
/// The random number stream that chooses the instant looked at.
const STREAM: u64 = 2_000;
/// Errors beyond these are a lost estimate: horizontal and vertical velocity m/s, tilt rad, height m.
const LOST: [f64; 3] = [1.0, 0.26, 0.3];

/// A quantity that should be χ²-distributed, over one flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Squares {
    /// Mean over the flight.
    pub mean: f64,
    /// At one instant, chosen at random.
    pub once: f64,
}

/// What one flight showed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlightConsistency {
    /// Normalised estimation error squared of each of [`BLOCKS`].
    pub errors: [Option<Squares>; BLOCKS.len()],
    /// Normalised innovation squared of each of [`SENSORS`].
    pub innovations: [Option<Squares>; SENSORS.len()],
    /// Times a sensor was refused until the estimate was moved to it.
    pub resets: u32,
    /// Of them or others, those that neither ended within a second nor raised `diverged`; and stretches of more than
    /// a second in which the error was beyond any use while the estimate called itself valid.
    pub unresolved: u32,
    /// Did the estimate say that it is lost?
    pub diverged: bool,
    /// Was the second estimator's estimate the flight's, bit for bit, throughout?
    pub identical: bool,
}

/// Error and covariance at one instant, attitude in world axes: north, east, down.
#[derive(Debug)]
struct Snapshot {
    error: SVector<f64, N>,
    covariance: SMatrix<f64, N, N>,
}

/// A running mean.
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    sum: SVector<f64, 3>,
    count: f64,
}

impl Mean {
    fn add(&mut self, value: Vec3) {
        self.sum += wide(value);
        self.count += 1.0;
    }
}

/// What is going on with one sensor.
#[derive(Debug, Default)]
struct Followed {
    innovations: Vec<f64>,
    kept_out_since: Option<Instant>,
    reported: bool,
}

/// Looks on while a flight is flown.
#[derive(Debug)]
pub struct Observation {
    shadow: Shadow,
    config: EskfConfig,
    random: Noise,
    mode: FlightStatus,
    snapshots: Vec<Snapshot>,
    due: Instant,
    sensors: [Followed; SENSORS.len()],
    /// What gyroscope and accelerometer showed beyond the truth.
    offsets: [Mean; 2],
    lost_since: Option<Instant>,
    result: FlightConsistency,
}

impl Observation {
    /// Nothing seen yet. `seed` chooses the instant that is looked at alone.
    #[must_use]
    pub fn new(config: EskfConfig, seed: u64) -> Self {
        Self {
            shadow: Shadow::new(config),
            config,
            random: Noise::new(seed, STREAM),
            mode: FlightStatus::default(),
            snapshots: Vec::new(),
            due: Instant::ZERO,
            sensors: Default::default(),
            offsets: [Mean::default(); 2],
            lost_since: None,
            result: FlightConsistency::default(),
        }
    }

    /// Takes a sample off the bus.
    fn sample(&mut self, id: Id, at: Instant, generation: u32, words: &[u32]) {
        self.shadow.sample(id, at, generation, words);
        if id == Id::flight_status
            && let Ok(words) = words.try_into()
            && let Some(mode) = FlightStatus::from_words(&words)
        {
            self.mode = mode;
        }
    }

    /// Takes an activation of the flight.
    fn activation(&mut self, activation: &Activation) {
        let flying = self.mode.phase == FlightPhase::Flying;
        let (sensors, result, config) = (&mut self.sensors, &mut self.result, &self.config);
        self.shadow.activation(activation.record(), &mut |sensor, now, fusion| {
            let followed = &mut sensors[sensor as usize];
            let axes = SENSORS[sensor as usize].1;
            match fusion {
                Fusion::Fused { ratio } | Fusion::Gated { ratio } if flying => {
                    followed.innovations.push(f64::from(ratio * config.gate_distance(axes)));
                }
                _ => {}
            }
            match fusion {
                Fusion::Gated { .. } => {
                    let since = *followed.kept_out_since.get_or_insert(now);
                    if now.since(since) > PATIENCE && !result.diverged && !followed.reported {
                        followed.reported = true;
                        result.unresolved += 1;
                    }
                }
                Fusion::Refused(_) => {}
                _ => (followed.kept_out_since, followed.reported) = (None, false),
            }
            result.resets += u32::from(fusion == Fusion::Reset);
        });
        result.diverged |= self.shadow.estimator().status().diverged;
    }

    /// Takes the truth at an instant, in the vehicle's world.
    fn truth(&mut self, at: Instant, truth: &Truth) {
        // An executor that is late has estimated an older instant by now.
        let Some((_, imu)) = self.shadow.imu().filter(|(stamp, _)| *stamp == at) else { return };
        if self.mode.phase != FlightPhase::Flying {
            return;
        }
        self.offsets[0].add(imu.gyro - truth.angular_rate);
        self.offsets[1].add(imu.accel - truth.specific_force);
        let snapshot = self.snapshot(truth);
        self.watch(at, &snapshot.error);
        if at >= self.due {
            self.due = at + PERIOD;
            self.snapshots.push(snapshot);
        }
    }

    /// Errors as "truth less estimate"; the biases' are what they are estimated to be, until their truth is known.
    fn snapshot(&self, truth: &Truth) -> Snapshot {
        let estimator = self.shadow.estimator();
        let nominal = estimator.nominal();
        let attitude: nalgebra::UnitQuaternion<f64> = widen(&nominal.quat());
        let rotation = attitude.to_rotation_matrix();
        let turned = widen(&truth.attitude) * attitude.inverse();
        let mut error = SVector::<f64, N>::zeros();
        let mut put = |block: usize, value: SVector<f64, 3>| error.fixed_rows_mut::<3>(block).copy_from(&value);
        put(POSITION, wide(truth.position - nominal.position));
        put(VELOCITY, wide(truth.velocity - nominal.velocity));
        put(ATTITUDE, turned.scaled_axis());
        put(GYRO_BIAS, -wide(nominal.gyro_bias));
        put(ACCEL_BIAS, -wide(nominal.accel_bias));
        let mut into_world = SMatrix::<f64, N, N>::identity();
        into_world.fixed_view_mut::<3, 3>(ATTITUDE, ATTITUDE).copy_from(rotation.matrix());
        let covariance = SMatrix::from_fn(|i, j| f64::from(estimator.covariance().get(i, j)));
        Snapshot { error, covariance: into_world * covariance * into_world.transpose() }
    }

    /// Counts stretches of time in which the estimate is useless and does not know it.
    fn watch(&mut self, at: Instant, error: &SVector<f64, N>) {
        let estimate = self.shadow.estimator().estimate();
        let valid = |part| estimate.valid.contains(part);
        let velocity = error.fixed_rows::<3>(VELOCITY).norm();
        let lost = valid(Validity::VELOCITY_XY) && velocity > LOST[0]
            || valid(Validity::TILT) && error.fixed_rows::<2>(ATTITUDE).norm() > LOST[1]
            || valid(Validity::POSITION_Z) && error[POSITION + 2].abs() > LOST[2];
        match (lost, self.lost_since) {
            (true, None) => self.lost_since = Some(at),
            (true, Some(since)) if at.since(since) > PATIENCE => {
                self.result.unresolved += 1;
                self.lost_since = Some(at);
            }
            (false, _) => self.lost_since = None,
            _ => {}
        }
    }

    /// What the flight showed.
    ///
    /// The truth of a bias is what the inertial sensor showed beyond the truth on the mean of the flight: its offset,
    /// what its scale and its axes make of gravity and of turning, and what vibration moved it by.
    #[must_use]
    pub fn finish(mut self) -> FlightConsistency {
        let mut result = self.result;
        result.identical = self.shadow.is_identical();
        for snapshot in &mut self.snapshots {
            for (block, offset) in [GYRO_BIAS, ACCEL_BIAS].into_iter().zip(&self.offsets) {
                let mut error = snapshot.error.fixed_rows_mut::<3>(block);
                error += offset.sum / offset.count;
            }
        }
        let mut squares = |values: Vec<f64>| {
            let chosen = (self.random.unit() * values.len() as f64) as usize;
            let once = values.get(chosen).copied()?;
            Some(Squares { mean: values.iter().sum::<f64>() / values.len() as f64, once })
        };
        for (place, (_, states)) in result.errors.iter_mut().zip(&BLOCKS) {
            *place = squares(self.snapshots.iter().map(|snapshot| snapshot.square(states)).collect());
        }
        for (place, followed) in result.innovations.iter_mut().zip(self.sensors) {
            *place = squares(followed.innovations);
        }
        result
    }
}

impl Snapshot {
    /// eᵀ·P⁻¹·e over some of the states, by a Cholesky factorisation. Infinite when P is not positive definite.
    fn square(&self, states: &[usize]) -> f64 {
        let mut factor = [[0.0; N]; N];
        let mut whitened = [0.0; N];
        let mut sum = 0.0;
        for (i, row) in states.iter().enumerate() {
            for (j, column) in states.iter().enumerate().take(i + 1) {
                let shared: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                let rest = self.covariance[(*row, *column)] - shared;
                factor[i][j] = if i == j { rest.sqrt() } else { rest / factor[j][j] };
            }
            if factor[i][i].is_nan() || factor[i][i] <= 0.0 {
                return f64::INFINITY;
            }
            let known: f64 = (0..i).map(|k| factor[i][k] * whitened[k]).sum();
            whitened[i] = (self.error[*row] - known) / factor[i][i];
            sum += whitened[i] * whitened[i];
        }
        sum
    }
}

fn widen(quat: &Quat) -> nalgebra::UnitQuaternion<f64> {
    let [w, x, y, z] = quat.wxyz().map(f64::from);
    nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z))
}

fn wide(vector: Vec3) -> SVector<f64, 3> {
    nalgebra::Vector3::from(vector).cast()
}

impl Observer for Observation {
    fn has_read(&mut self, activation: &Activation) {
        self.activation(activation);
    }
}

impl Witness<Runnables> for Observation {
    fn published(&mut self, topic: usize, at: Instant, generation: u32, words: &[u32]) {
        if let Some(id) = Id::ALL.get(topic) {
            self.sample(*id, at, generation, words);
        }
    }

    fn beside(&mut self, _: usize, at: Instant, _: u32, words: &[u32]) {
        if let Some(truth) = words.try_into().ok().and_then(|words| Truth::from_words(&words)) {
            self.truth(at, &truth);
        }
    }
}

/// The place of each sensor in [`SENSORS`].
const _: () = assert!(Sensor::Tof as usize == 0 && Sensor::Flow as usize == 1 && Sensor::Baro as usize == 2);
