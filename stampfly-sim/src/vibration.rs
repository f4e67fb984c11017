//! Vibration of an inertial sensor caused by the propellers.
//!
//! Three parts per axis, all proportional to the square of rotor speed, as aerodynamic and
//! centrifugal forces are: tones at each rotor's speed and at twice that (imbalance; two blades
//! passing an arm), broadband noise (flow, brushes), and broadband noise through a resonance of the
//! airframe. In addition the accelerometer reads less than gravity while it vibrates: a
//! rectification that all recorded flights show (about +0.8 m/s² on z).
//!
//! Sampled at the chip's rate before decimation, so aliasing below the control loop's Nyquist
//! frequency is real and follows the rotors. The amplitudes are fitted to recorded flights;
//! `cargo run --release --manifest-path lab/Cargo.toml --example spectra` repeats the comparison.

use crate::noise::Noise;
use crate::normals::Normals;
use crate::plant::ROTORS;

/// Axes: accelerometer x, y, z, then gyroscope x, y, z.
const AXES: usize = 6;

/// Vibration of one axis with all rotors at hover speed.
struct Profile {
    /// Standard deviation of the broadband part per sample.
    broadband: f64,
    /// Resonance of the airframe: frequency, Hz; bandwidth, Hz; standard deviation.
    resonance: (f64, f64, f64),
    /// RMS of the tones at once and twice the rotor speed, all rotors together.
    tones: [f64; 2],
    /// Constant offset.
    rectification: f64,
}

/// Fitted to the flight records; m/s² and rad/s.
const PROFILES: [Profile; AXES] = [
    Profile { broadband: 5.7, resonance: (165.0, 70.0, 2.0), tones: [2.0, 1.5], rectification: 0.0 },
    Profile { broadband: 1.2, resonance: (145.0, 50.0, 1.1), tones: [0.7, 0.7], rectification: 0.0 },
    Profile { broadband: 7.4, resonance: (150.0, 60.0, 1.5), tones: [1.5, 1.5], rectification: 0.8 },
    Profile { broadband: 0.017, resonance: (165.0, 60.0, 0.022), tones: [0.010, 0.015], rectification: 0.0 },
    Profile { broadband: 0.020, resonance: (115.0, 60.0, 0.021), tones: [0.010, 0.015], rectification: 0.0 },
    Profile { broadband: 0.0165, resonance: (165.0, 80.0, 0.005), tones: [0.005, 0.008], rectification: 0.0 },
];

/// The entries of [`PROFILES`] as arrays over the axes.
const BROADBAND: [f64; AXES] = of_axes(0);
const RESONANT: [f64; AXES] = of_axes(1);
const RECTIFICATION: [f64; AXES] = of_axes(2);

const fn of_axes(part: usize) -> [f64; AXES] {
    let (mut parts, mut axis) = ([0.0; AXES], 0);
    while axis < AXES {
        let profile = &PROFILES[axis];
        parts[axis] = [profile.broadband, profile.resonance.2, profile.rectification][part];
        axis += 1;
    }
    parts
}

/// A resonance on every axis: two poles each, and zeros at 0 and at half the sample rate to
/// attenuate both sides.
///
/// All data are arrays over the axes, so that the compiler can vectorise over them.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Resonators {
    feedback: [[f64; AXES]; 2],
    gain: [f64; AXES],
    inputs: [[f64; AXES]; 2],
    outputs: [[f64; AXES]; 2],
}

impl Resonators {
    /// Resonances with these frequencies and bandwidths, Hz. White noise of unit variance gives an
    /// output of unit variance.
    fn new(resonances: [(f64, f64); AXES], dt: f64) -> Self {
        use core::f64::consts::{PI, TAU};
        let (mut feedback, mut gain) = ([[0.0; AXES]; 2], [0.0; AXES]);
        for (axis, (frequency, bandwidth)) in resonances.into_iter().enumerate() {
            let radius = libm::exp(-PI * bandwidth * dt);
            let (a1, a2) = (2.0 * radius * libm::cos(TAU * frequency * dt), -radius * radius);
            // Variance and autocorrelation of the second-order autoregression w = a1·w₁ + a2·w₂ + x
            // (Box and Jenkins); the output is the difference w − w₂.
            let variance = (1.0 - a2) / ((1.0 + a2) * ((1.0 - a2) * (1.0 - a2) - a1 * a1));
            let lag_two = a1 * a1 / (1.0 - a2) + a2;
            gain[axis] = 1.0 / (2.0 * variance * (1.0 - lag_two)).sqrt();
            (feedback[0][axis], feedback[1][axis]) = (a1, a2);
        }
        Self { feedback, gain, inputs: [[0.0; AXES]; 2], outputs: [[0.0; AXES]; 2] }
    }

    fn step(&mut self, input: &[f64; AXES]) -> [f64; AXES] {
        let output: [f64; AXES] = core::array::from_fn(|i| {
            let poles = self.feedback[0][i] * self.outputs[0][i] + self.feedback[1][i] * self.outputs[1][i];
            poles + input[i] - self.inputs[1][i]
        });
        self.inputs = [*input, self.inputs[0]];
        self.outputs = [output, self.outputs[0]];
        core::array::from_fn(|i| output[i] * self.gain[i])
    }
}

/// Weights of a tone's cosine and sine on each axis, as separate arrays for vectorisation.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tone {
    cos: [f64; AXES],
    sin: [f64; AXES],
}

/// Phase of each rotor as a point on the unit circle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Phases {
    cos: [f64; ROTORS],
    sin: [f64; ROTORS],
}

/// Vibration of one inertial sensor.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Vibration {
    noise: Normals,
    factor: f64,
    dt: f64,
    /// 1 / hover speed, s/rad.
    per_hover: f64,
    phases: Phases,
    /// Tones of each rotor.
    weights: [[Tone; 2]; ROTORS],
    resonators: Resonators,
}

impl Vibration {
    /// `factor` scales the whole recorded disturbance including rectification; `dt` is the sample
    /// period, s.
    pub(crate) fn new(factor: f64, dt: f64, hover_speed: f64, mut noise: Noise) -> Self {
        let phase = [(); ROTORS].map(|()| libm::sincos(noise.within(core::f64::consts::PI)));
        let weights = [(); ROTORS].map(|()| {
            // Propellers differ in balance.
            let balance = 1.0 + noise.within(0.5);
            core::array::from_fn(|harmonic| {
                let mut tone = Tone { cos: [0.0; AXES], sin: [0.0; AXES] };
                for (axis, profile) in PROFILES.iter().enumerate() {
                    let (sin, cos) = libm::sincos(noise.within(core::f64::consts::PI));
                    // Rotors add in power; the amplitude of a tone is √2 times its RMS.
                    let amplitude = balance * profile.tones[harmonic] * (2.0 / ROTORS as f64).sqrt();
                    (tone.cos[axis], tone.sin[axis]) = (amplitude * cos, amplitude * sin);
                }
                tone
            })
        });
        let phases = Phases { cos: phase.map(|(_, cos)| cos), sin: phase.map(|(sin, _)| sin) };
        let resonators = Resonators::new(PROFILES.map(|profile| (profile.resonance.0, profile.resonance.1)), dt);
        Self { noise: noise.into(), factor, dt, per_hover: 1.0 / hover_speed, phases, weights, resonators }
    }

    /// The next sample, accelerometer, m/s², then gyroscope, rad/s, at these rotor speeds, rad/s.
    pub(crate) fn step(&mut self, rotor_speed: &[f64; ROTORS]) -> [f64; AXES] {
        let mut total = [0.0; AXES];
        if self.factor <= 0.0 {
            return total;
        }
        self.phases.turn(&rotor_speed.map(|speed| speed * self.dt));
        let mut power = 0.0;
        for (rotor, tones) in self.weights.iter().enumerate() {
            let (cos, sin) = (self.phases.cos[rotor], self.phases.sin[rotor]);
            let relative = rotor_speed[rotor] * self.per_hover;
            let share = relative * relative;
            power += share / ROTORS as f64;
            // Double-angle formulas give the second harmonic without another rotation.
            let harmonics = [(cos, sin), (cos * cos - sin * sin, 2.0 * sin * cos)];
            for ((cos, sin), tone) in harmonics.into_iter().zip(tones) {
                for ((sum, a), b) in total.iter_mut().zip(&tone.cos).zip(&tone.sin) {
                    *sum += share * (a * cos + b * sin);
                }
            }
        }
        // Standing rotors: no noise is drawn, so a vehicle at rest is cheap.
        if power < 1e-4 {
            return [0.0; AXES];
        }
        let white = self.noise.next();
        let resonant = self.resonators.step(&white);
        core::array::from_fn(|axis| {
            let noise = power * (BROADBAND[axis] * white[axis] + RESONANT[axis] * resonant[axis]);
            (total[axis] + noise) * self.factor + self.factor * power * RECTIFICATION[axis]
        })
    }
}

impl Phases {
    /// Rotates each point by its angle, rad (0 to 8).
    ///
    /// Sine and cosine of an eighth of the angle by series, then three angle doublings. The result
    /// is renormalised towards the circle, so errors do not accumulate. About thirty
    /// multiplications, with the same bits on every machine.
    fn turn(&mut self, angles: &[f64; ROTORS]) {
        for (rotor, angle) in angles.iter().enumerate() {
            let x = angle * 0.125;
            let xx = x * x;
            let mut s = x * (1.0 - xx / 6.0 * (1.0 - xx / 20.0 * (1.0 - xx / 42.0)));
            let mut c = 1.0 - xx / 2.0 * (1.0 - xx / 12.0 * (1.0 - xx / 30.0 * (1.0 - xx / 56.0)));
            (c, s) = (c * c - s * s, 2.0 * s * c);
            (c, s) = (c * c - s * s, 2.0 * s * c);
            (c, s) = (c * c - s * s, 2.0 * s * c);
            let (cos, sin) = (self.cos[rotor], self.sin[rotor]);
            let (c, s) = (cos * c - sin * s, sin * c + cos * s);
            let pull = 1.5 - 0.5 * (c * c + s * s);
            (self.cos[rotor], self.sin[rotor]) = (c * pull, s * pull);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOVER: f64 = 3000.0;

    fn run(factor: f64, speed: f64, samples: usize) -> Vec<[f64; AXES]> {
        let mut vibration = Vibration::new(factor, 1.0 / 1600.0, HOVER, Noise::new(1, 1));
        (0..samples).map(|_| vibration.step(&[speed; ROTORS])).collect()
    }

    fn deviation(samples: &[[f64; AXES]], axis: usize) -> f64 {
        let n = samples.len() as f64;
        let mean = samples.iter().map(|s| s[axis]).sum::<f64>() / n;
        (samples.iter().map(|s| (s[axis] - mean) * (s[axis] - mean)).sum::<f64>() / n).sqrt()
    }

    #[test]
    fn nothing_shakes_with_the_rotors_still_or_the_factor_zero() {
        assert!(run(1.0, 0.0, 100).iter().flatten().all(|v| *v == 0.0));
        assert!(run(0.0, HOVER, 100).iter().flatten().all(|v| *v == 0.0));
    }

    #[test]
    fn strength_grows_with_the_square_of_speed_and_with_the_factor() {
        let hover = run(1.0, HOVER, 20_000);
        let (half, double) = (run(1.0, HOVER / 2.0, 20_000), run(2.0, HOVER, 20_000));
        for axis in 0..AXES {
            let reference = deviation(&hover, axis);
            assert!((deviation(&half, axis) / reference - 0.25).abs() < 0.02, "axis {axis}");
            assert!((deviation(&double, axis) / reference - 2.0).abs() < 1e-9, "axis {axis}");
        }
    }

    #[test]
    fn phasors_stay_on_the_circle_and_at_the_right_angle() {
        let mut phases = Phases { cos: [1.0; ROTORS], sin: [0.0; ROTORS] };
        for step in 1..=100_000u32 {
            phases.turn(&[0.0, 1.0, 2.345, 4.0]);
            let point = (phases.cos[2], phases.sin[2]);
            if step % 10_000 == 0 {
                let (sin, cos) = libm::sincos(2.345 * f64::from(step));
                assert!((point.0 - cos).abs() < 1e-3 && (point.1 - sin).abs() < 1e-3, "step {step}: {point:?}");
                assert!((point.0 * point.0 + point.1 * point.1 - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn resonators_keep_unit_variance() {
        let mut noise = Noise::new(2, 2);
        let mut resonators = Resonators::new(PROFILES.map(|profile| (profile.resonance.0, 40.0)), 1.0 / 1600.0);
        let mut variances = [0.0; AXES];
        for _ in 0..200_000 {
            let outputs = resonators.step(&[(); AXES].map(|()| noise.normal()));
            variances.iter_mut().zip(outputs).for_each(|(variance, y)| *variance += y * y / 2e5);
        }
        assert!(variances.iter().all(|variance| (variance - 1.0).abs() < 0.05), "{variances:?}");
    }
}
