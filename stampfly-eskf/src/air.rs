//! Airspeed and wind from a pitot tube, with a plausibility check of the tube.
//!
//! A tube that is blocked, iced or wet shows an arbitrary pressure, and an aircraft that uses it
//! dives or stalls. With a satellite receiver the tube can be checked: ground velocity minus the
//! estimated wind is a second airspeed, valid as long as the receiver has a fix. While the tube is
//! rejected, that airspeed is used and the wind estimate is held. On the ground there is no
//! reference, so the tube is not checked.
//!
//! Use it for any vehicle that flies fast enough for a pitot tube. Not for a multirotor.

use crate::aid::airspeed::Wind;
use crate::estimator::Estimator;
use stampfly_types::messages::{AirState, AirspeedData, SensorMask, StateEstimate, Validity};
use stampfly_types::{Duration, Instant, Stamped, Vec3, math};

/// After this time without samples the tube counts as absent.
const SILENT: Duration = Duration::from_millis(500);
/// Standard deviation of an airspeed, m/s, from the scale error of the tube.
const SIGMA: f32 = 0.6;
/// Lowest airspeed used to estimate the wind, m/s.
const SLOW: f32 = 6.0;
/// Air density at sea level of the standard atmosphere, kg/m³, and its relative decrease per metre
/// of altitude, 1/m (ICAO doc 7488).
const DENSITY: f32 = 1.225;
const THINNER: f32 = 1.0 / 9_500.0;
/// The tube is rejected when it differs from the reference by more than this share and this speed,
/// m/s, for `DOUBT` seconds. It is accepted again after `TRUST` seconds of agreement.
const DISAGREES: (f32, f32) = (0.25, 3.0);
const DOUBT: f32 = 1.0;
const TRUST: f32 = 10.0;
/// With a wind standard deviation above `KNOWN_WIND`, m/s, the tube is rejected only below the
/// share `NO_WIND` of the reference, because no wind in which the aircraft takes off explains that.
/// Below `FLIES`, m/s, nothing is compared.
const KNOWN_WIND: f32 = 2.5;
const NO_WIND: f32 = 0.4;
const FLIES: f32 = 8.0;

/// Airspeed and wind of an aircraft.
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
    /// Airspeed assumed when no source is available, m/s.
    unknown: f32,
    altitude: f32,
    /// Time and speed of the tube's last sample.
    tube: Option<(Instant, f32)>,
    /// Time for which the tube has contradicted its present verdict, s.
    doubt: f32,
    believed: bool,
    last: Instant,
}

impl Air {
    /// State before the first sample. `unknown` is the airspeed used when no source is available,
    /// m/s: the cruise speed, because a controller that assumes a lower one deflects the surfaces
    /// too far.
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

    /// Processes the tube's samples since the last step. `altitude` is the pressure altitude, m;
    /// `on_ground` disables the plausibility check.
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
            // Bernoulli: p = ρ·v²/2. Noise around zero gives negative pressures.
            let speed = math::sqrt(2.0 * data.pressure.max(0.0) / self.density());
            self.tube = Some((*at, speed));
            if self.believed && speed > SLOW && !on_ground && is_moving {
                // The estimator counts the result in its own tally.
                let _ = estimator.fuse_airspeed(*at, speed, SIGMA, &mut self.wind);
            }
        }
        let heard = self.tube.filter(|(at, _)| now.since(*at) < SILENT).map(|(_, speed)| speed);
        if on_ground {
            // Each flight starts with the tube accepted.
            (self.believed, self.doubt) = (heard.is_some(), 0.0);
            return;
        }
        // Without external aiding the velocity drifts; it must not reject the one sensor that still
        // bounds it.
        let is_judge = estimate.sensors.contains(SensorMask::EXTERNAL);
        let agrees = match (heard, self.through_air(&estimate).filter(|_| is_judge)) {
            (None, _) => Some(false),
            // Below `FLIES` the tube may measure only the component of the wind along the nose.
            (Some(speed), Some(other)) if speed.max(other) > FLIES => Some(match self.wind.sigma() < KNOWN_WIND {
                true => (speed - other).abs() <= (DISAGREES.0 * other).max(DISAGREES.1),
                false => speed >= NO_WIND * other,
            }),
            // No reference: keep the present verdict.
            _ => None,
        };
        let changes = agrees.is_some_and(|agrees| agrees != self.believed);
        self.doubt = if changes { self.doubt + dt } else { 0.0 };
        if heard.is_none() || self.doubt > if self.believed { DOUBT } else { TRUST } {
            (self.believed, self.doubt) = (heard.is_some() && !self.believed, 0.0);
        }
    }

    /// Airspeed from velocity and wind estimate, m/s.
    fn through_air(&self, estimate: &StateEstimate) -> Option<f32> {
        let [north, east] = self.wind.velocity();
        let air = estimate.velocity - Vec3::new(north, east, 0.0);
        estimate.valid.contains(Validity::VELOCITY_XY).then(|| air.norm())
    }

    fn density(&self) -> f32 {
        DENSITY * (1.0 - self.altitude.clamp(-500.0, 5_000.0) * THINNER)
    }

    /// Airspeed and wind for this estimate.
    #[must_use]
    pub fn state(&self, estimate: &StateEstimate) -> AirState {
        let tube = self.tube.filter(|_| self.believed).map(|(_, speed)| speed);
        let airspeed = tube.or_else(|| self.through_air(estimate)).unwrap_or(self.unknown);
        let indicated = airspeed * math::sqrt(self.density() / DENSITY);
        let (wind, wind_sigma) = (self.wind.velocity(), self.wind.sigma());
        AirState { airspeed, indicated, wind, wind_sigma, measured: tube.is_some() }
    }
}
