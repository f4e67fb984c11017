//! The lag of the collective: between the thrust that the rotors make and the force that lifts the whole vehicle.
//!
//! From a thrust command to the vertical acceleration of a StampFly, its makers measured some 110 ms: "filters, PWM, motor and structure". The
//! PWM has 150 kHz and no lag to speak of. The rotor's is in its [motor](super::motor), 16 to 20 ms by its own measurement. Filters are some of the
//! rest, and belong to whoever measures. Nobody has told them from what the air column and the frame take, so between nothing and all of the rest is a lag
//! of the vehicle: 20 to 110 ms with the rotor's.
//!
//! It is of first order and in the mean of the thrusts alone. Differences between rotors, which turn the vehicle, do not have it: turning has been identified
//! with the rotor's lag and none beside.

use super::ROTORS;

/// A lag of the rotors' mean thrust.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lag {
    /// Share of the difference that is made up in one step.
    share: f64,
    /// Mean thrust that has come about, N; `None` before the first step.
    mean: Option<f64>,
}

impl Lag {
    /// With this time constant, s, and this step, s; `None` without a lag.
    pub fn new(seconds: f64, dt: f64) -> Option<Self> {
        (seconds > 0.0).then(|| Self { share: 1.0 - libm::exp(-dt / seconds), mean: None })
    }

    /// What becomes of the rotors' thrusts, N.
    pub fn pass(&mut self, thrust: [f64; ROTORS]) -> [f64; ROTORS] {
        let now = thrust.iter().sum::<f64>() / ROTORS as f64;
        let before = self.mean.unwrap_or(now);
        let mean = before + (now - before) * self.share;
        self.mean = Some(mean);
        thrust.map(|thrust| (thrust + (mean - now)).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 625e-6;

    #[test]
    fn the_mean_lags_and_differences_do_not() {
        let mut lag = Lag::new(0.09, DT).expect("a lag");
        assert_eq!(lag.pass([0.1; ROTORS]), [0.1; ROTORS], "it begins where it is");
        let stepped = [0.13, 0.11, 0.13, 0.11];
        let at_once = lag.pass(stepped);
        assert!((at_once[0] - at_once[1] - 0.02).abs() < 1e-12, "what turns acts at once: {at_once:?}");
        let mut steps = 1;
        while lag.pass(stepped).iter().sum::<f64>() / 4.0 < 0.1 + 0.02 * (1.0 - (-1f64).exp()) {
            steps += 1;
        }
        assert!((f64::from(steps) * DT - 0.09).abs() < 2e-3, "{} s", f64::from(steps) * DT);
    }

    #[test]
    fn without_a_lag_there_is_nothing() {
        assert!(Lag::new(0.0, DT).is_none());
    }

    #[test]
    fn no_rotor_pulls() {
        let mut lag = Lag::new(0.09, DT).expect("a lag");
        lag.pass([0.0; ROTORS]);
        assert!(lag.pass([0.4, 0.0, 0.0, 0.0]).iter().all(|thrust| *thrust >= 0.0));
    }
}
