//! Random numbers: the only source of randomness in the whole stack.
//!
//! Each random model owns a [`Noise`] made from the simulation's seed and the model's own stream
//! number. Streams of one seed are independent: adding a sensor, or reading one more often, changes
//! no other sensor's values. The generator is ChaCha with 8 rounds. Normal variates use Marsaglia's
//! polar method (Marsaglia and Bray 1964) with the logarithm of the `libm` crate, which has the
//! same bits on every machine, unlike the platform's.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Stream of a model. The number determines the values, so it must never change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub(crate) enum Stream {
    Airframe = 1,
    Wind = 2,
    Imu = 3,
    Vibration = 4,
    BottomTof = 5,
    FrontTof = 6,
    Flow = 7,
    Mag = 8,
    Baro = 9,
    Power = 10,
    Cameras = 11,
    Drift = 12,
    SoftIron = 13,
    Gnss = 14,
    Airspeed = 15,
    Conditions = 16,
    Frame = 17,
    ImuMounting = 18,
    FlowSpecimen = 19,
    FlowMotion = 20,
    BottomTofSpecimen = 21,
    FrontTofSpecimen = 22,
    PressureWander = 23,
    Doors = 24,
    RotorSpecimen = 25,
    VortexRing = 26,
    Room = 27,
}

/// A seeded stream of random numbers.
///
/// ```
/// use stampfly_sim::Noise;
/// let mut first = Noise::new(7, 0);
/// let mut again = Noise::new(7, 0);
/// let mut other = Noise::new(7, 1);
/// let value = first.normal();
/// assert_eq!(value, again.normal());
/// assert_ne!(value, other.normal());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    generator: ChaCha8Rng,
    /// Second variate of a pair: the polar method produces two at a time.
    spare: Option<f64>,
}

impl Noise {
    /// The stream with this number of this seed.
    #[must_use]
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(stream);
        Self { generator, spare: None }
    }

    pub(crate) fn stream(seed: u64, stream: Stream) -> Self {
        Self::new(seed, stream as u64)
    }

    /// Uniform between 0 (inclusive) and 1 (exclusive).
    pub fn unit(&mut self) -> f64 {
        // 53 bits: the precision of an f64.
        (self.generator.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform between −`bound` and +`bound`.
    pub fn within(&mut self, bound: f64) -> f64 {
        bound * (2.0 * self.unit() - 1.0)
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Standard normal: mean 0, standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let point = self.point();
            if point.is_inside() {
                let [first, second] = point.normals();
                self.spare = Some(second);
                return first;
            }
        }
    }

    /// A point of the square in which the polar method draws.
    #[inline]
    pub(crate) fn point(&mut self) -> Point {
        // One draw of 64 bits gives both coordinates; 32 bits each reach beyond six standard
        // deviations.
        let bits = self.generator.next_u64();
        let x = f64::from(bits as u32 as i32) * (1.0 / 2_147_483_648.0);
        let y = f64::from((bits >> 32) as u32 as i32) * (1.0 / 2_147_483_648.0);
        Point { x, y, square: x * x + y * y }
    }

    /// The second variate of the last pair, if it has not been returned yet.
    pub(crate) fn take_spare(&mut self) -> Option<f64> {
        self.spare.take()
    }

    /// Three standard normal variates.
    pub fn normal3(&mut self) -> nalgebra::Vector3<f64> {
        let (x, y, z) = (self.normal(), self.normal(), self.normal());
        nalgebra::Vector3::new(x, y, z)
    }
}

/// A point of the square from −1 to 1, and the square of its distance from the centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub x: f64,
    pub y: f64,
    pub square: f64,
}

impl Point {
    /// True inside the unit circle, where the polar method accepts the point.
    #[inline]
    pub(crate) fn is_inside(&self) -> bool {
        // Without short circuit: one point in five is outside, which branch prediction cannot
        // foresee.
        (self.square > 0.0) & (self.square < 1.0)
    }

    /// The two normal variates of an accepted point.
    fn normals(&self) -> [f64; 2] {
        let scale = libm::sqrt(-2.0 * libm::log(self.square) / self.square);
        [self.x * scale, self.y * scale]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_variates_have_the_moments_of_a_normal_distribution() {
        let mut noise = Noise::new(1, 2);
        let n = 200_000;
        let mut moments = [0.0; 4];
        let mut beyond_three = 0;
        for _ in 0..n {
            let x = noise.normal();
            beyond_three += u32::from(x.abs() > 3.0);
            for (power, moment) in moments.iter_mut().enumerate() {
                *moment += x.powi(power as i32 + 1) / f64::from(n);
            }
        }
        // Tolerances: five standard errors of each moment.
        let error = 5.0 / f64::from(n).sqrt();
        assert!(moments[0].abs() < error, "mean {}", moments[0]);
        assert!((moments[1] - 1.0).abs() < error * 2f64.sqrt(), "variance {}", moments[1]);
        assert!(moments[2].abs() < error * 15f64.sqrt(), "skew {}", moments[2]);
        assert!((moments[3] - 3.0).abs() < error * 96f64.sqrt(), "kurtosis {}", moments[3]);
        assert!((430..=650).contains(&beyond_three), "0.27 % lie beyond three: {beyond_three}");
    }

    #[test]
    fn uniform_variates_fill_their_range() {
        let mut noise = Noise::new(3, 4);
        let values: Vec<f64> = (0..10_000).map(|_| noise.within(2.0)).collect();
        assert!(values.iter().all(|v| v.abs() <= 2.0));
        let mean = values.iter().sum::<f64>() / 1e4;
        assert!(mean.abs() < 0.06 && values.iter().any(|v| *v > 1.99) && values.iter().any(|v| *v < -1.99));
    }
}
