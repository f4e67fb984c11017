//! One axis of a vehicle of its own: moment of inertia, motors that lag, a delay, noise, gusts. In `f64` and with an exact solution
//! between steps, and its frequency response from the formula: nothing here is shared with what is tested.

use std::collections::VecDeque;
use std::f64::consts::PI;

use stampfly_control::autotune::{Autotune, AutotuneAxis, AutotuneInput, AutotuneStage};
use stampfly_control::pid::{Integration, Pid, PidGains};
use stampfly_control::rate::RateConfig;
use stampfly_control::{Airframe, CascadeConfig};
use stampfly_types::messages::{
    Alerts, CommandSetpoint, CommandSource, FlightMode, FlightPhase, FlightStatus, GroundContact, LandDetected,
    StateEstimate, Validity,
};
use stampfly_types::{Duration, Instant, Quat, Vec3};

pub const AIRFRAME: Airframe = Airframe::EXAMPLE;
pub const PERIOD: Duration = Duration::from_micros(2_500);
const DT: f64 = 0.0025;
/// Steps of the plant in a control period: the delay is a whole number of them.
const SUBSTEPS: usize = 10;

/// What is not known of the vehicle.
#[derive(Clone, Copy, Debug)]
pub struct Plant {
    /// Moment of inertia, kg·m².
    pub inertia: f64,
    /// Motor lag, s.
    pub lag: f64,
    /// What a rotor's own inertia gives, s: torque while it speeds up.
    pub lead: f64,
    /// From motion to its measurement, s; half a period of holding the torque comes on top.
    pub delay: f64,
    /// Standard deviation of the noise on the rate, rad/s.
    pub noise: f64,
    /// That of the torque of gusts, N·m, with a correlation time of 0.3 s.
    pub gusts: f64,
}

impl Plant {
    /// The axis that the gains are for, a little noisy.
    pub fn nominal(axis: AutotuneAxis) -> Self {
        let inertia = f64::from(axis.of(&AIRFRAME.inertia));
        Self { inertia, lag: f64::from(AIRFRAME.motor_lag), lead: 0.0, delay: 0.0045, noise: 0.03, gusts: 0.0 }
    }

    /// Body rate over torque at an angular frequency, rad/s: real and imaginary part.
    pub fn response(&self, frequency: f64) -> (f64, f64) {
        // Held for a period: sin(x)/x late by half of it; integrator: a quarter turn late.
        let half = 0.5 * frequency * DT;
        let magnitude = half.sin() / half / (self.inertia * frequency * (1.0 + (frequency * self.lag).powi(2)).sqrt());
        let angle = -half - frequency * self.delay - 0.5 * PI - (frequency * self.lag).atan();
        let (re, im) = (magnitude * angle.cos(), magnitude * angle.sin());
        let lead = frequency * self.lead;
        (re - lead * im, im + lead * re)
    }
}

/// Margins of gains around the true plant, loop opened at the torque, attitude loop closed: degrees, decibels, rad/s. The phase is
/// followed from where the delay does not matter, so that an unstable loop has less than none.
pub fn true_margins(plant: &Plant, gains: &PidGains, attitude: f64) -> (f64, f64, f64) {
    let open = |frequency: f64| {
        let omega = 2.0 / DT * (0.5 * frequency * DT).tan();
        let (kp, ti, td, eta) = (f64::from(gains.kp), f64::from(gains.ti), f64::from(gains.td), f64::from(gains.eta));
        let (integral, outer, corner) = (1.0 / (ti * omega), attitude / omega, eta * td * omega);
        let derivative = td * omega / (1.0 + corner * corner);
        let (re, im) = (1.0 - integral * outer + derivative * corner, derivative - integral - outer);
        let (p, q) = plant.response(frequency);
        (kp * (re * p - im * q), kp * (re * q + im * p))
    };
    let (mut phase, mut gain, mut crossover) = (f64::INFINITY, f64::INFINITY, 0.0);
    let mut before: Option<(f64, f64)> = None;
    for step in 0..20_000 {
        let frequency = 1.0 * (1_200.0f64).powf(f64::from(step) / 20_000.0);
        let (re, im) = open(frequency);
        let size = re.hypot(im);
        // From -180 degrees; followed from step to step.
        let principal = (-im).atan2(-re);
        let angle = before.map_or(principal, |(_, last)| last + (principal - last + PI).rem_euclid(2.0 * PI) - PI);
        if let Some((was, last)) = before {
            if (was >= 1.0) != (size >= 1.0) {
                phase = phase.min(angle.to_degrees());
                crossover = frequency;
            }
            if (last / (2.0 * PI)).round() == (angle / (2.0 * PI)).round()
                && (last.rem_euclid(2.0 * PI) > PI) != (angle.rem_euclid(2.0 * PI) > PI)
            {
                gain = gain.min((20.0 * size.log10()).abs());
            }
        }
        before = Some((size, angle));
    }
    (phase, gain, crossover)
}

/// The axis under its attitude loop and rate loop, with the tuning on top.
pub struct Rig {
    pub plant: Plant,
    pub axis: AutotuneAxis,
    pub gains: PidGains,
    pub autotune: Autotune,
    pub attitude_gain: f64,
    pub now: Instant,
    pub estimate: StateEstimate,
    pub command: CommandSetpoint,
    pub flight_status: FlightStatus,
    pub land_detected: LandDetected,
    pub alerts: Alerts,
    pub unmet: [f32; 4],
    /// What the controller asked for, and what came out.
    pub asked: Vec3,
    pub torque: Vec3,
    pid: Pid,
    angle: f64,
    rate: f64,
    rotors: f64,
    gust: f64,
    seen: VecDeque<f64>,
    random: u64,
}

impl Rig {
    pub fn new(plant: Plant, axis: AutotuneAxis) -> Self {
        let cascade = CascadeConfig::for_airframe(&AIRFRAME);
        let gains = axis.gains(&RateConfig::for_airframe(&AIRFRAME));
        let attitude_gain = match axis {
            AutotuneAxis::Yaw => cascade.attitude.heading_gain,
            _ => cascade.attitude.tilt_gain,
        };
        Self {
            plant,
            axis,
            gains,
            autotune: Autotune::for_airframe(&AIRFRAME),
            attitude_gain: f64::from(attitude_gain),
            now: Instant::from_secs(20),
            estimate: StateEstimate { height: 1.0, valid: Validity::ALL, ..StateEstimate::default() },
            command: CommandSetpoint { source: CommandSource::Guided, ..CommandSetpoint::default() },
            flight_status: FlightStatus {
                phase: FlightPhase::Flying,
                mode: FlightMode::PosHold,
                armed: true,
                ..FlightStatus::default()
            },
            land_detected: LandDetected { contact: GroundContact::Air, ..LandDetected::default() },
            alerts: Alerts::default(),
            unmet: [0.0; 4],
            asked: Vec3::zeros(),
            torque: Vec3::zeros(),
            pid: Pid::new(gains, axis.of(&RateConfig::for_airframe(&AIRFRAME).torque_max)),
            angle: 0.0,
            rate: 0.0,
            rotors: 0.0,
            gust: 0.0,
            seen: VecDeque::from(vec![0.0; (plant.delay / DT * SUBSTEPS as f64).round() as usize]),
            random: 0x9E37_79B9_7F4A_7C15,
        }
    }

    pub fn seeded(self, seed: u64) -> Self {
        Self { random: self.random ^ seed.wrapping_mul(0xD134_2543_DE82_EF95), ..self }
    }

    /// Other gains in the loop than the airframe's.
    pub fn with_gains(self, gains: PidGains) -> Self {
        Self { gains, pid: Pid::new(gains, self.pid.limit()), ..self }
    }

    pub fn start(&mut self) -> Result<(), stampfly_control::autotune::AutotuneStop> {
        let mut autotune = self.autotune.clone();
        let started = autotune.start(self.now, self.axis, self.gains, &self.input());
        self.autotune = autotune;
        started
    }

    pub fn input(&self) -> AutotuneInput<'_> {
        AutotuneInput {
            estimate: &self.estimate,
            command: &self.command,
            flight_status: &self.flight_status,
            land_detected: &self.land_detected,
            alerts: self.alerts,
            unmet: self.unmet,
        }
    }

    /// One control period, after which what the estimator says may be changed.
    pub fn step(&mut self) {
        let (rate, angle) = (self.axis.of(&self.estimate.angular_rate), self.angle);
        let target = -self.attitude_gain * angle;
        self.asked = Vec3::zeros();
        *self.axis.of_mut(&mut self.asked) = self.pid.step(target as f32, rate, DT as f32, Integration::Free);
        let mut autotune = self.autotune.clone();
        self.torque = autotune.step(self.now, &self.input(), &self.asked);
        self.autotune = autotune;
        self.now += PERIOD;
        self.turn(f64::from(self.axis.of(&self.torque)));
    }

    /// Something pushes: the rate jumps, rad/s.
    pub fn kick(&mut self, rate: f64) {
        self.rate += rate;
    }

    /// Steps for `seconds`.
    pub fn fly(&mut self, seconds: f64) {
        for _ in 0..(seconds / DT) as usize {
            self.step();
        }
    }

    /// The largest rate while it steps for `seconds`, rad/s.
    pub fn shakes(&mut self, seconds: f64) -> f32 {
        let mut largest = 0.0f32;
        for _ in 0..(seconds / DT) as usize {
            self.step();
            largest = largest.max(self.axis.of(&self.estimate.angular_rate).abs());
        }
        largest
    }

    /// Starts, and steps until it is over. Panics if it is not over after a minute and a half.
    pub fn tune(&mut self) -> AutotuneStage {
        self.fly(1.0);
        self.start().expect("it hovers");
        for _ in 0..36_000 {
            self.step();
            if matches!(self.autotune.stage(), AutotuneStage::Done | AutotuneStage::Stopped) {
                return self.autotune.stage();
            }
        }
        panic!("it does not end: {:?}", self.autotune.stage());
    }

    fn turn(&mut self, torque: f64) {
        let kick = self.normal();
        let share = DT / 0.3;
        self.gust += -self.gust * share + kick * self.plant.gusts * (2.0 * share).sqrt();
        let h = DT / SUBSTEPS as f64;
        let decay = (-h / self.plant.lag).exp();
        let mut measured = self.rate;
        for _ in 0..SUBSTEPS {
            let off = self.rotors - torque;
            // Exact: the rotors approach the torque, and the rate is their integral.
            let impulse = torque * h + off * self.plant.lag * (1.0 - decay) + self.gust * h;
            let rotors = torque + off * decay;
            let impulse = impulse + self.plant.lead * (rotors - self.rotors);
            self.rotors = rotors;
            let before = self.rate;
            self.rate += impulse / self.plant.inertia;
            self.angle += 0.5 * (before + self.rate) * h;
            self.seen.push_back(self.rate);
            measured = self.seen.pop_front().unwrap_or(measured);
        }
        measured += self.plant.noise * self.normal();
        *self.axis.of_mut(&mut self.estimate.angular_rate) = measured as f32;
        let mut angles = Vec3::zeros();
        *self.axis.of_mut(&mut angles) = self.angle as f32;
        self.estimate.attitude = Quat::from_euler_angles(angles.x, angles.y, angles.z);
    }

    /// Twelve uniform numbers are normal enough.
    fn normal(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.random >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }
}
