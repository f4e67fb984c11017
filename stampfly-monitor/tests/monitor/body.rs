//! A vehicle that tilts back and forth on a given course, its sensors, and an estimator with fixed
//! gains.

use stampfly_monitor::{Monitor, MonitorConfig, MonitorInput};
use stampfly_types::messages::*;
use stampfly_types::{GRAVITY, Instant, Quat, Stamped, Vec3, frame, math};

/// Time at rest at the start, s.
const STOOD: f32 = 1.0;
/// Height at rest, m.
const GROUND: f32 = 0.03;
/// Time constant with which it starts to tilt, s.
const SPOOLS: f32 = 0.5;
/// Interval of inertial samples, s.
pub const DT: f32 = 0.0025;

/// A vehicle and its flight.
#[derive(Clone, Copy, Debug)]
pub struct Vehicle {
    /// Height of the flight, m.
    pub height: f32,
    /// Duration of the take-off, s.
    pub climbs: f32,
    /// Amplitude of the tilt, rad, and its frequency, rad/s.
    pub lean: f32,
    pub swing: f32,
    /// Standard deviations of the vibration: m/s² and rad/s.
    pub shakes: [f32; 2],
}

/// A palm-sized vehicle in a room, and one of 2 kg above a field.
pub const VEHICLES: [Vehicle; 2] = [
    Vehicle { height: 0.6, climbs: 1.5, lean: 0.12, swing: 2.5, shakes: [2.0, 0.04] },
    Vehicle { height: 4.0, climbs: 4.0, lean: 0.2, swing: 1.2, shakes: [1.0, 0.03] },
];

/// Readings of the sensors. A fault changes the true values.
pub struct Readings {
    pub time: f32,
    pub imu: ImuData,
    /// Image rate about body x and y, rad/s, before quantisation.
    pub picture: [f32; 2],
    pub range: f32,
    pub altitude: f32,
}

/// Gains of the estimator per m/s of camera residual: velocity, tilt, gyro bias; and per metre of
/// range residual: height, climb rate.
const LOW: f32 = 0.5;
const GAINS: [f32; 3] = [0.08, 0.012, 0.004];
const RANGE_GAINS: [f32; 2] = [0.4, 2.0];
/// Residual above which a range is rejected, m.
const GATE: f32 = 0.05;
/// Range below which it is not compared in flight, m.
const WINDOW: f32 = 0.04;

/// A flight until a finding or its end.
pub struct Flight {
    pub monitor: Monitor,
    pub estimate: StateEstimate,
    pub status: EstimatorStatus,
    pub truth: Truth,
    random: u64,
    step: u64,
    counted: [f32; 2],
    turned: [f32; 2],
    vehicle: Vehicle,
    /// The last correction, and their number.
    pub correction: EstimateCorrection,
    pub corrections: u32,
}

/// State of the body.
#[derive(Clone, Copy, Debug, Default)]
pub struct Truth {
    pub attitude: Quat,
    pub rate: Vec3,
    pub force: Vec3,
    pub velocity: Vec3,
    pub height: f32,
}

impl Flight {
    pub fn new(vehicle: Vehicle, seed: u64) -> Self {
        let estimate = StateEstimate {
            height: GROUND,
            valid: Validity::ALL,
            sensors: SensorMask::IMU | SensorMask::TOF | SensorMask::FLOW,
            ..StateEstimate::default()
        };
        let truth = Truth { height: GROUND, force: Vec3::new(0.0, 0.0, -GRAVITY), ..Truth::default() };
        let status = EstimatorStatus { acceleration_sigma: 0.04, ..EstimatorStatus::default() };
        let mut flight = Self {
            monitor: Monitor::new(MonitorConfig::default()),
            estimate,
            status,
            truth,
            random: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1,
            step: 0,
            counted: [0.0; 2],
            turned: [0.0; 2],
            vehicle,
            correction: EstimateCorrection::default(),
            corrections: 0,
        };
        flight.fly(STOOD, true, |_| ());
        flight
    }

    /// Flies `seconds` or until a finding. Returns the findings and the time since the start, s.
    pub fn until_found(&mut self, seconds: f32, fault: impl FnMut(&mut Readings)) -> Option<(SensorFindings, f32)> {
        let before = self.step;
        self.fly(seconds, false, fault);
        let findings = *self.monitor.findings();
        (findings != SensorFindings::default()).then(|| (findings, (self.step - before) as f32 * DT))
    }

    /// Flies `seconds`, with or without findings.
    pub fn fly_on(&mut self, seconds: f32, mut fault: impl FnMut(&mut Readings)) {
        for n in 0..(seconds / DT) as u64 {
            self.one(false, n as f32 * DT, &mut fault);
        }
    }

    fn fly(&mut self, seconds: f32, stands: bool, mut fault: impl FnMut(&mut Readings)) {
        for n in 0..(seconds / DT) as u64 {
            self.one(stands, n as f32 * DT, &mut fault);
            if *self.monitor.findings() != SensorFindings::default() {
                return;
            }
        }
    }

    /// One inertial sample, and the other samples due with it.
    fn one(&mut self, stands: bool, time: f32, fault: &mut impl FnMut(&mut Readings)) {
        self.step += 1;
        let now = Instant::from_micros(1_000_000 + self.step * 2_500);
        let flown = self.step as f32 * DT;
        if !stands {
            self.moves(flown - STOOD);
        }
        let [force_noise, rate_noise] = if stands { [0.02, 0.003] } else { self.vehicle.shakes };
        let accel = self.truth.force + self.noise() * force_noise;
        let gyro = self.truth.rate + self.noise() * rate_noise;
        let body = self.truth.attitude.inverse_transform_vector(&self.truth.velocity);
        let picture = [body.x / self.truth.height + self.truth.rate.y, body.y / self.truth.height - self.truth.rate.x];
        let noise = self.noise();
        let mut readings = Readings {
            time,
            imu: ImuData { accel, gyro, ..ImuData::default() },
            picture,
            range: self.truth.height / frame::cos_tilt(&self.truth.attitude) + 0.003 * noise.x,
            altitude: self.truth.height + 0.08 * noise.y,
        };
        fault(&mut readings);

        self.predict(&readings.imu);
        let imu = [stamped(now, readings.imu)];
        for (sum, rate) in self.counted.iter_mut().zip(readings.picture) {
            *sum += rate * DT;
        }
        self.turned = [self.turned[0] + readings.imu.gyro.y * DT, self.turned[1] - readings.imu.gyro.x * DT];
        let every = |n: u64| self.step.is_multiple_of(n);
        let flow = every(4).then(|| stamped(now, self.flow(stands)));
        let tof = (self.step % 13 == 5).then(|| stamped(now, self.tof(readings.range, stands)));
        let baro = (self.step % 16 == 9).then(|| {
            let data = BaroData { altitude: readings.altitude, ..BaroData::default() };
            stamped(now, data)
        });
        let input = MonitorInput {
            imu: &imu,
            flow: flow.as_slice(),
            tof: tof.as_slice(),
            baro: baro.as_slice(),
            estimate: &self.estimate,
            status: &self.status,
            stands,
            flies: !stands,
            felt: true,
            restarts: 0,
        };
        if let Some(correction) = self.monitor.step(now, &input) {
            self.corrections += 1;
            self.correction = correction;
            let estimate = &mut self.estimate;
            estimate.attitude = (Quat::from_scaled_axis(correction.turn) * estimate.attitude).normalize();
            estimate.velocity += correction.velocity;
            estimate.gyro_bias += correction.gyro_bias;
        }
    }

    /// Tilts the body back and forth; the thrust carries its weight.
    fn moves(&mut self, time: f32) {
        let Vehicle { lean, swing, .. } = self.vehicle;
        // It starts gradually, not from one sample to the next.
        let grown = |time: f32| lean * (1.0 - math::exp(-time / SPOOLS));
        let angles = |time: f32| [swing, 1.3 * swing].map(|swing| grown(time) * math::sin(swing * time));
        let ([roll, pitch], [roll_next, pitch_next]) = (angles(time), angles(time + DT));
        let (now, next) =
            (Quat::from_euler_angles(roll, pitch, 0.0), Quat::from_euler_angles(roll_next, pitch_next, 0.0));
        self.truth.attitude = now;
        self.truth.rate = (now.inverse() * next).scaled_axis() / DT;
        let upwards = self.climbs(time);
        self.truth.force = Vec3::new(0.0, 0.0, -(GRAVITY + upwards) / frame::cos_tilt(&now));
        let acceleration = now.transform_vector(&self.truth.force) + Vec3::new(0.0, 0.0, GRAVITY);
        self.truth.velocity += acceleration * DT;
        self.truth.height -= self.truth.velocity.z * DT;
    }

    /// Upward acceleration of a smooth take-off, m/s².
    fn climbs(&self, time: f32) -> f32 {
        let share = time / self.vehicle.climbs;
        let way = self.vehicle.height - GROUND;
        if share < 1.0 { way * (6.0 - 12.0 * share) / (self.vehicle.climbs * self.vehicle.climbs) } else { 0.0 }
    }

    fn predict(&mut self, imu: &ImuData) {
        let estimate = &mut self.estimate;
        let rate = imu.gyro - estimate.gyro_bias;
        estimate.attitude = (estimate.attitude * Quat::from_scaled_axis(rate * DT)).normalize();
        let acceleration = estimate.attitude.transform_vector(&imu.accel) + Vec3::new(0.0, 0.0, GRAVITY);
        estimate.velocity += acceleration * DT;
        estimate.height -= estimate.velocity.z * DT;
        estimate.position.z = -estimate.height;
        (estimate.angular_rate, estimate.specific_force) = (rate, imu.accel);
    }

    fn flow(&mut self, stands: bool) -> FlowData {
        // A count of a PMW3901.
        const COUNT: f32 = 0.0022;
        const NOISY: f32 = 0.5;
        let interval = 4.0 * DT;
        let noise = self.noise();
        let counted = core::mem::take(&mut self.counted);
        let counts = [0, 1].map(|axis| math::round(counted[axis] / COUNT + NOISY * noise[axis]) * COUNT);
        let turned = core::mem::take(&mut self.turned);
        let distance = self.estimate.height / frame::cos_tilt(&self.estimate.attitude);
        let bias = self.estimate.gyro_bias;
        // The estimator compensates the camera with the raw rates.
        let measured = [0, 1].map(|axis| (counts[axis] - turned[axis]) / interval * distance);
        let body = self.estimate.attitude.inverse_transform_vector(&self.estimate.velocity);
        let predicted = [body.x - distance * bias.y, body.y + distance * bias.x];
        self.status.flow_innovation = [measured[0] - predicted[0], measured[1] - predicted[1]];
        self.status.tested[1] += 1;
        if stands {
            self.estimate.velocity = Vec3::zeros();
            self.estimate.attitude = Quat::identity();
        } else {
            self.status.acceleration_sigma = 0.1;
            let [x, y] = self.status.flow_innovation;
            let world = self.estimate.attitude.transform_vector(&Vec3::new(x, y, 0.0));
            // A velocity that is too large to the north comes from a nose that is too low.
            let turn = Vec3::new(world.y, -world.x, 0.0);
            // The noise of a velocity grows with the height.
            let share = (LOW / self.vehicle.height).min(1.0);
            let [velocity, tilt, bias] = GAINS.map(|gain| gain * share);
            let estimate = &mut self.estimate;
            estimate.velocity += world * velocity;
            estimate.attitude = (Quat::from_scaled_axis(turn * tilt) * estimate.attitude).normalize();
            estimate.gyro_bias -= estimate.attitude.inverse_transform_vector(&(turn * bias));
        }
        FlowData { delta_x: counts[0], delta_y: counts[1], interval, quality: 100, valid: true }
    }

    fn tof(&mut self, range: f32, stands: bool) -> TofData {
        let expected = self.estimate.height / frame::cos_tilt(&self.estimate.attitude);
        let off = range - expected;
        self.status.offered[0] += 1;
        if !stands && range < WINDOW && expected > 2.0 * WINDOW {
            return TofData { distance: range, valid: true, ..TofData::default() };
        }
        self.status.tested[0] += 1;
        if off.abs() > GATE {
            self.status.refused[0] += 1;
        } else if !stands {
            self.estimate.height += RANGE_GAINS[0] * off;
            self.estimate.velocity.z -= RANGE_GAINS[1] * off;
        }
        TofData { distance: range, valid: true, ..TofData::default() }
    }

    /// Three independent numbers with unit standard deviation.
    fn noise(&mut self) -> Vec3 {
        Vec3::from_fn(|_| {
            let mut sum = -6.0;
            for _ in 0..12 {
                self.random ^= self.random << 13;
                self.random ^= self.random >> 7;
                self.random ^= self.random << 17;
                sum += (self.random >> 40) as f32 / (1u32 << 24) as f32;
            }
            sum
        })
    }
}

fn stamped<T>(at: Instant, data: T) -> Stamped<T> {
    Stamped { at, generation: 1, data }
}
