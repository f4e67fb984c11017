//! The truth and its sensors: a vehicle on a level circle or a straight line, optionally climbing;
//! heading along the course plus a constant angle.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use stampfly_types::messages::{ImuData, MagData};
use stampfly_types::{Instant, Vec3};

/// Three numbers of the truth.
pub type V = [f64; 3];

/// Gravity, m/s².
const G: f64 = 9.80665;
/// Start of the filter, s: a clock does not start with it.
const START: f64 = 10.0;

/// Parameters of the simulation. Times in s, lengths in m, angles in rad.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Inertial samples per second.
    pub rate: f64,
    /// Radius of the circle; infinite for a straight line to the north.
    pub radius: f64,
    pub speed: f64,
    /// Climb rate, m/s, after the first five seconds.
    pub climb: f64,
    /// Initial heading, and its rate on the circle, rad/s.
    pub heading: f64,
    /// Time at rest before it moves, s; accelerates for the same time.
    pub stands: f64,
    /// Start, relative to the origin of the receiver's frame.
    pub origin: V,
    /// Noise density of the accelerometer, m/s²/√Hz, and of the gyro, rad/s/√Hz.
    pub accel_noise: f64,
    pub gyro_noise: f64,
    /// Biases after calibration, body.
    pub accel_bias: V,
    pub gyro_bias: V,
    /// Time between fixes, and their delay.
    pub fix_period: f64,
    pub fix_delay: f64,
    /// Errors of a fix: white position error, horizontal and down, white velocity error; and a slow
    /// position error with its time constant.
    pub position_sigma: [f64; 2],
    pub velocity_sigma: [f64; 2],
    pub wander_sigma: f64,
    pub wander_time: f64,
    /// Earth's field at the place, true north, µT.
    pub field: V,
    pub seed: u64,
}

impl Default for Setting {
    fn default() -> Self {
        Self {
            rate: 200.0,
            radius: 30.0,
            speed: 6.0,
            climb: 0.0,
            heading: 0.0,
            stands: 2.0,
            origin: [0.0; 3],
            accel_noise: 0.03,
            gyro_noise: 5e-4,
            accel_bias: [0.05, -0.04, 0.06],
            gyro_bias: [0.0005, -0.0004, 0.0005],
            fix_period: 0.2,
            fix_delay: 0.0,
            position_sigma: [0.5, 0.8],
            velocity_sigma: [0.1, 0.15],
            wander_sigma: 0.0,
            wander_time: 60.0,
            field: [20.0, 0.0, 40.0],
            seed: 1,
        }
    }
}

/// The truth at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    pub position: V,
    pub velocity: V,
    pub acceleration: V,
    /// Heading; the body is level.
    pub heading: f64,
    pub heading_rate: f64,
}

/// A fix of the receiver.
#[derive(Clone, Copy, Debug)]
pub struct Fix {
    /// Time of validity, and time of arrival.
    pub at: f64,
    pub arrives: f64,
    pub position: V,
    pub velocity: V,
}

/// The world: the truth as a function of time, and sensors with seeded errors.
pub struct World {
    pub setting: Setting,
    random: ChaCha8Rng,
    wander: V,
    wander_at: f64,
}

impl World {
    pub fn new(setting: Setting) -> Self {
        let random = ChaCha8Rng::seed_from_u64(setting.seed);
        Self { setting, random, wander: [0.0; 3], wander_at: 0.0 }
    }

    /// The instant `time` seconds after the start.
    pub fn instant(time: f64) -> Instant {
        Instant::from_micros(((START + time) * 1e6).round() as u64)
    }

    /// Path, speed and acceleration along the course: from rest to `speed` on half a cosine, then
    /// speed changes of a quarter every eight seconds. At constant speed on a circle a wrong
    /// heading would look like an accelerometer error.
    fn along(&self, time: f64) -> V {
        let Setting { stands, speed, .. } = self.setting;
        let since = time - stands;
        if since <= 0.0 {
            return [0.0; 3];
        }
        let w = std::f64::consts::PI / stands;
        if since >= stands {
            let (surge, w, since) = (0.25 * speed, std::f64::consts::TAU / 8.0, since - stands);
            // Starts and ends at zero, so the acceleration does not jump.
            let (sin, cos) = (w * since).sin_cos();
            let way = speed * (since + 0.5 * stands) + surge * (since - sin / w);
            return [way, speed + surge * (1.0 - cos), surge * w * sin];
        }
        let (sin, cos) = (w * since).sin_cos();
        [0.5 * speed * (since - sin / w), 0.5 * speed * (1.0 - cos), 0.5 * speed * w * sin]
    }

    pub fn truth(&self, time: f64) -> Truth {
        let Setting { radius, heading, climb, origin, .. } = self.setting;
        let [way, speed, push] = self.along(time);
        let turn = if radius.is_finite() { 1.0 / radius } else { 0.0 };
        let angle = way * turn;
        let (sin, cos) = angle.sin_cos();
        let plan = if turn == 0.0 { [way, 0.0] } else { [radius * sin, radius * (1.0 - cos)] };
        // The climb starts after five seconds, within one.
        let up = [-climb, 0.0, 0.0].map(|v| v * (time - 5.5).max(0.0))[0];
        let (rise, lift) = if time < 5.0 {
            (0.0, 0.0)
        } else if time < 6.0 {
            (-climb * (time - 5.0), -climb)
        } else {
            (-climb, 0.0)
        };
        let down = if time < 5.0 {
            0.0
        } else if time < 6.0 {
            -0.5 * climb * (time - 5.0) * (time - 5.0)
        } else {
            up
        };
        let side = speed * speed * turn;
        Truth {
            position: [origin[0] + plan[0], origin[1] + plan[1], origin[2] + down],
            velocity: [speed * cos, speed * sin, rise],
            acceleration: [push * cos - side * sin, push * sin + side * cos, lift],
            heading: heading + angle,
            heading_rate: speed * turn,
        }
    }

    fn normal(&mut self, sigma: f64) -> f64 {
        let value: f64 = StandardNormal.sample(&mut self.random);
        sigma * value
    }

    fn around(&mut self, value: V, sigmas: V) -> V {
        let mut noisy = value;
        for (axis, sigma) in noisy.iter_mut().zip(sigmas) {
            *axis += self.normal(sigma);
        }
        noisy
    }

    /// The inertial sample that ends at this time: means over the period before it.
    pub fn imu(&mut self, time: f64) -> ImuData {
        let Setting { rate, accel_noise, gyro_noise, accel_bias, gyro_bias, .. } = self.setting;
        let truth = self.truth(time - 0.5 / rate);
        let force = body(&truth, [truth.acceleration[0], truth.acceleration[1], truth.acceleration[2] - G]);
        let force = std::array::from_fn(|i| force[i] + accel_bias[i]);
        let turn = [gyro_bias[0], gyro_bias[1], gyro_bias[2] + truth.heading_rate];
        let white = rate.sqrt();
        let accel = vector(self.around(force, [accel_noise * white; 3]));
        let gyro = vector(self.around(turn, [gyro_noise * white; 3]));
        ImuData { accel, gyro, temperature: 25.0, ..ImuData::default() }
    }

    /// The fix that is valid at this time. Advances its slow error.
    pub fn fix(&mut self, time: f64) -> Fix {
        let Setting { fix_delay, position_sigma: [h, v], velocity_sigma: [vh, vv], .. } = self.setting;
        let truth = self.truth(time);
        let keep = (-(time - self.wander_at) / self.setting.wander_time).exp();
        self.wander_at = time;
        let drive = self.setting.wander_sigma * (1.0 - keep * keep).sqrt();
        let kept = self.wander.map(|error| error * keep);
        self.wander = self.around(kept, [drive, drive, 1.5 * drive]);
        let wandered = std::array::from_fn(|i| truth.position[i] + self.wander[i]);
        let position = self.around(wandered, [h, h, v]);
        let velocity = self.around(truth.velocity, [vh, vh, vv]);
        Fix { at: time, arrives: time + fix_delay, position, velocity }
    }

    /// The magnetic field in the body.
    pub fn mag(&mut self, time: f64) -> MagData {
        let truth = self.truth(time);
        let field = body(&truth, self.setting.field);
        MagData { field: vector(self.around(field, [0.5; 3])) }
    }

    /// Barometric altitude; the origin is at 100 m.
    pub fn altitude(&mut self, time: f64) -> f32 {
        let down = self.truth(time).position[2];
        (100.0 - down + self.normal(0.3)) as f32
    }
}

/// World to body.
fn body(truth: &Truth, [x, y, z]: V) -> V {
    let (sin, cos) = truth.heading.sin_cos();
    [cos * x + sin * y, cos * y - sin * x, z]
}

pub fn vector([x, y, z]: V) -> Vec3 {
    Vec3::new(x as f32, y as f32, z as f32)
}
