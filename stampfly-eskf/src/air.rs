//! Airspeed and wind from a pitot tube beside an estimator, and whether the tube is to be believed.
//!
//! A tube that is blocked, iced or wet shows some pressure or other, and an aircraft that believes it dives or stalls. Beside a satellite receiver it can be judged: the velocity over the ground less the wind that was learnt is the
//! airspeed, too, as long as the receiver has a fix. While a tube is not believed, that is what counts, and the wind stays as it was. On the ground there is nothing to compare it with.
//!
//! Use it for whatever flies fast enough for a tube. Not for a multirotor.

use crate::aid::airspeed::Wind;
use crate::estimator::Estimator;
use stampfly_types::messages::{AirState, AirspeedData, SensorMask, StateEstimate, Validity};
use stampfly_types::{Duration, Instant, Stamped, Vec3, math};

/// A tube that has been silent for longer is none.
const SILENT: Duration = Duration::from_millis(500);
/// Standard deviation of an airspeed, m/s: the tube's scale.
const SIGMA: f32 = 0.6;
/// Slower than this, m/s, a tube shows nothing of the wind.
const SLOW: f32 = 6.0;
/// Density of the air in the standard atmosphere at sea level, kg/m³, and how far an altitude thins it, 1/m (ICAO doc 7488).
const DENSITY: f32 = 1.225;
const THINNER: f32 = 1.0 / 9_500.0;
/// A tube is not believed when it has disagreed by this share and this speed, m/s, for so long, s; and again after so long.
const DISAGREES: (f32, f32) = (0.25, 3.0);
const DOUBT: f32 = 1.0;
const TRUST: f32 = 10.0;
/// A wind that is known worse than this, m/s, contradicts only a tube that shows less than this share: no wind that anybody takes off with is so strong.
/// Nothing contradicts anybody while both are slower than the last of these, m/s.
const KNOWN_WIND: f32 = 2.5;
const NO_WIND: f32 = 0.4;
const FLIES: f32 = 8.0;

/// The air around an aircraft.
///
/// ```
/// use stampfly_eskf::{Air, Eskf, EskfConfig, Estimator};
/// use stampfly_types::{Instant, Stamped, messages::AirspeedData};
/// let (mut air, mut eskf) = (Air::new(15.0), Eskf::new(EskfConfig::outdoors()));
/// let sample = Stamped { at: Instant::from_millis(10), generation: 1, data: AirspeedData { pressure: 176.4, temperature: 20.0 } };
/// air.step(Instant::from_millis(10), &[sample], 120.0, true, &mut eskf);
/// let state = air.state(&eskf.estimate());
/// assert!(state.measured && (state.airspeed - 17.08).abs() < 0.01 && (state.indicated - 16.97).abs() < 0.01);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Air {
    wind: Wind,
    /// Airspeed when nothing shows it, m/s.
    unknown: f32,
    altitude: f32,
    /// The tube's last speed, and when it was.
    tube: Option<(Instant, f32)>,
    /// For how long it has disagreed, or agreed again, s.
    doubt: f32,
    believed: bool,
    last: Instant,
}

impl Air {
    /// Before the first sample. `unknown`: the airspeed when nothing shows it, m/s. Its cruise, so that nobody takes it for standing and deflects its surfaces too far.
    #[must_use]
    pub fn new(unknown: f32) -> Self {
        Self {
            wind: Wind::default(),
            unknown,
            altitude: 0.0,
            tube: None,
            doubt: 0.0,
            believed: true,
            last: Instant::ZERO,
        }
    }

    /// Takes the tube's samples since the last step, the pressure altitude, m, and whether it stands on the ground.
    pub fn step(
        &mut self,
        now: Instant,
        samples: &[Stamped<AirspeedData>],
        altitude: f32,
        on_ground: bool,
        estimator: &mut impl Estimator,
    ) {
        let dt = now.since(self.last).seconds().min(0.1);
        self.last = now;
        self.wind.propagate(dt);
        if altitude.is_finite() {
            self.altitude = altitude;
        }
        let estimate = estimator.estimate();
        let is_moving = estimate.valid.contains(Validity::VELOCITY_XY);
        for Stamped { at, data, .. } in samples {
            if !data.pressure.is_finite() {
                continue;
            }
            let speed = math::sqrt(2.0 * data.pressure.max(0.0) / self.density());
            self.tube = Some((*at, speed));
            if self.believed && speed > SLOW && !on_ground && is_moving {
                // What became of it is counted there.
                let _ = estimator.fuse_airspeed(*at, speed, SIGMA, &mut self.wind);
            }
        }
        let heard = self.tube.filter(|(at, _)| now.since(*at) < SILENT).map(|(_, speed)| speed);
        if on_ground {
            // A new flight begins with trust.
            (self.believed, self.doubt) = (heard.is_some(), 0.0);
            return;
        }
        // A velocity that nobody corrects drifts, and would condemn the one sensor that still holds it.
        let is_judge = estimate.sensors.contains(SensorMask::EXTERNAL);
        let agrees = match (heard, self.through_air(&estimate).filter(|_| is_judge)) {
            (None, _) => Some(false),
            // A tube that hardly moves feels the wind along the nose alone.
            (Some(speed), Some(other)) if speed.max(other) > FLIES => Some(match self.wind.sigma() < KNOWN_WIND {
                true => (speed - other).abs() <= (DISAGREES.0 * other).max(DISAGREES.1),
                false => speed >= NO_WIND * other,
            }),
            // Nothing to compare it with: that is no reason to believe it again, nor to doubt it.
            _ => None,
        };
        let changes = agrees.is_some_and(|agrees| agrees != self.believed);
        self.doubt = if changes { self.doubt + dt } else { 0.0 };
        if heard.is_none() || self.doubt > if self.believed { DOUBT } else { TRUST } {
            (self.believed, self.doubt) = (heard.is_some() && !self.believed, 0.0);
        }
    }

    /// Speed through the air as velocity and wind have it, m/s.
    fn through_air(&self, estimate: &StateEstimate) -> Option<f32> {
        let [north, east] = self.wind.velocity();
        let air = estimate.velocity - Vec3::new(north, east, 0.0);
        estimate.valid.contains(Validity::VELOCITY_XY).then(|| air.norm())
    }

    fn density(&self) -> f32 {
        DENSITY * (1.0 - self.altitude.clamp(-500.0, 5_000.0) * THINNER)
    }

    /// Airspeed and wind, where the estimator says this.
    #[must_use]
    pub fn state(&self, estimate: &StateEstimate) -> AirState {
        let tube = self.tube.filter(|_| self.believed).map(|(_, speed)| speed);
        let airspeed = tube.or_else(|| self.through_air(estimate)).unwrap_or(self.unknown);
        let indicated = airspeed * math::sqrt(self.density() / DENSITY);
        let (wind, wind_sigma) = (self.wind.velocity(), self.wind.sigma());
        AirState { airspeed, indicated, wind, wind_sigma, measured: tube.is_some() }
    }
}
