//! Lag of the collective: first-order delay between the rotors' mean thrust and the force that
//! lifts the vehicle.
//!
//! The manufacturer of the StampFly measured about 110 ms from thrust command to vertical
//! acceleration: "filters, PWM, motor and structure". The PWM runs at 150 kHz and adds no
//! noticeable delay. The rotor takes 16 to 20 ms by separate measurement and is modelled in
//! [motor](super::motor). Filters belong to the measurement. How the remainder divides between
//! filters, air column and frame is not known, so the lag of the vehicle is a condition: 20 to 110
//! ms including the rotor.
//!
//! Only the mean of the thrusts lags. Differences between rotors, which produce torque, do not: the
//! rotation was identified with the rotor's lag alone.

use super::ROTORS;

/// First-order lag of the rotors' mean thrust.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lag {
    /// Share of the remaining difference corrected per step.
    share: f64,
    /// Lagged mean thrust, N; `None` before the first step.
    mean: Option<f64>,
}

impl Lag {
    /// A lag with this time constant and step, s; `None` for a time constant of 0.
    pub fn new(seconds: f64, dt: f64) -> Option<Self> {
        (seconds > 0.0).then(|| Self { share: 1.0 - libm::exp(-dt / seconds), mean: None })
    }

    /// Delays the mean of the rotors' thrusts, N, and keeps their differences. No thrust becomes
    /// negative.
    pub fn pass(&mut self, thrust: [f64; ROTORS]) -> [f64; ROTORS] {
        let now = thrust.iter().sum::<f64>() / ROTORS as f64;
        let before = self.mean.unwrap_or(now);
        let mean = before + (now - before) * self.share;
        self.mean = Some(mean);
        // The same correction for all rotors leaves the torques unchanged.
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
