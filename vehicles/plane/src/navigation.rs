//! Where it is and how the air moves: calibration, the estimator, the airspeed and the wind.
//!
//! The aircraft stands when it is switched on, its heading unknown: the compass shows it, and without a compass the first metres of the take-off do. Height is the barometer's, whose error changes by
//! decimetres in a flight where a receiver's does by metres; a receiver's height is used while there is no barometer.

use crate::Parameters;
use crate::parameters::CompassParameters;
use serde::{Deserialize, Serialize};
use stampfly_eskf::aid::field;
use stampfly_eskf::calibration::{IronCorrection, StillCalibration};
use stampfly_eskf::{Air, Eskf, EskfConfig, Estimator, Measurements, StartHeading, feed};
use stampfly_fixed_wing::messages::{AirState, Home, MeasuredHeights};
use stampfly_types::messages::*;
use stampfly_types::{Duration, Instant, Stamped, Vec3};

/// Home is the first fix that is better than this, m.
const GOOD_FIX: f32 = 4.0;
/// Velocity less wind leads on for so long after the last fix; then it is too far from where it thinks that it is. Receivers pause for less under trees and bridges.
const LEADS: Duration = Duration::from_secs(10);
/// Nobody takes off with a receiver that has been silent for longer.
const LEADS_STANDING: Duration = Duration::from_secs(2);
/// A sensor that has been silent for longer is none.
const SILENT: Duration = Duration::from_millis(500);

/// The samples since the last step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Samples<'a> {
    /// Inertial.
    pub imu: &'a [Stamped<ImuData>],
    /// Magnetic field.
    pub mag: &'a [Stamped<MagData>],
    /// Air pressure.
    pub baro: &'a [Stamped<BaroData>],
    /// Satellite receiver.
    pub gnss: &'a [Stamped<GnssData>],
    /// Pitot tube.
    pub airspeed: &'a [Stamped<AirspeedData>],
}

/// Estimator, wind and airspeed.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Navigation {
    calibration: StillCalibration,
    eskf: Eskf,
    air: Air,
    home: Home,
    iron: IronCorrection,
    on_ground: bool,
    baro_at: Option<Instant>,
    fix_at: Option<Instant>,
    altitude: f32,
    heights: MeasuredHeights,
    /// Pressure altitude at home, m.
    altitude_home: Option<f32>,
    now: Instant,
}

impl Navigation {
    /// Before the first sample.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        let CompassParameters { x, y, z, declination, inclination } = parameters.compass;
        let config = EskfConfig {
            mag_enable: true,
            start_heading: StartHeading::Magnetic,
            earth_field: Some(field::earth(declination, inclination)),
            baro_backup: false,
            baro_sigma: 0.5,
            ..EskfConfig::outdoors()
        };
        Self {
            calibration: StillCalibration::default(),
            eskf: Eskf::new(config),
            air: Air::new(parameters.speed.cruise),
            home: Home::default(),
            iron: IronCorrection { offset: Vec3::new(x, y, z), ..IronCorrection::default() },
            on_ground: false,
            baro_at: None,
            fix_at: None,
            altitude: 0.0,
            heights: MeasuredHeights::default(),
            altitude_home: None,
            now: Instant::ZERO,
        }
    }

    /// Takes the samples. `standing`: it is disarmed, so it does not move.
    pub fn step(&mut self, now: Instant, samples: &Samples<'_>, standing: bool) {
        let Samples { imu, mag, baro, gnss, airspeed } = *samples;
        self.now = now;
        if !self.calibration.result().complete {
            mag.iter().for_each(|sample| self.calibration.add_mag(&self.field(sample)));
            baro.iter().for_each(|sample| self.calibration.add_baro(&sample.data));
            for sample in imu {
                // A sample in motion does not count; it begins again by itself.
                let _ = self.calibration.step(sample.at, &sample.data);
            }
            if self.calibration.result().complete {
                self.eskf.initialize(now, &self.calibration.result());
            }
        }
        if standing != self.on_ground {
            self.on_ground = standing;
            self.eskf.command(now, &EstimatorCommand { on_ground: standing, flying: !standing, ..Default::default() });
        }
        if let Some(sample) = baro.last() {
            (self.baro_at, self.altitude) = (Some(sample.at), sample.data.altitude);
            if self.home.known {
                let home = *self.altitude_home.get_or_insert(sample.data.altitude);
                (self.heights.barometer, self.heights.barometer_at) = (sample.data.altitude - home, sample.at);
            }
        }
        feed(&mut self.eskf, &Measurements { imu, baro, ..Measurements::default() }, |_, _, _| {});
        for sample in mag {
            let field = self.field(sample);
            // What became of it is counted there.
            let _ = self.eskf.fuse_mag(sample.at, &field);
        }
        for sample in gnss {
            self.fix(sample);
        }
        self.air.step(now, airspeed, self.altitude, standing, &mut self.eskf);
    }

    /// The field without the aircraft's own iron.
    fn field(&self, sample: &Stamped<MagData>) -> MagData {
        MagData { field: self.iron.correct(sample.data.field) }
    }

    fn fix(&mut self, Stamped { at, data, .. }: &Stamped<GnssData>) {
        if !self.home.known && data.fix == GnssFix::ThreeDimensional && data.horizontal_accuracy < GOOD_FIX {
            let altitude = (data.altitude * 1e3) as i32;
            self.home = Home { latitude: data.latitude, longitude: data.longitude, altitude, known: true };
        }
        let Some(origin) = self.home.origin() else { return };
        if data.fix == GnssFix::ThreeDimensional {
            let height = data.altitude - origin.altitude as f32 * 1e-3;
            (self.heights.receiver, self.heights.receiver_at) = (height, *at);
        }
        let has_baro = self.baro_at.is_some_and(|seen| at.since(seen) < SILENT);
        let flat = data.fix == GnssFix::ThreeDimensional && has_baro;
        let fix = if flat { GnssFix::TwoDimensional } else { data.fix };
        let [place, _] = self.eskf.fuse_gnss(*at, &GnssData { fix, ..*data }, &origin);
        self.fix_at = if place.is_fused() { Some(*at) } else { self.fix_at };
    }

    /// Where it is.
    #[must_use]
    pub fn estimate(&self) -> StateEstimate {
        let estimate = self.eskf.estimate();
        let leads = if self.on_ground { LEADS_STANDING } else { LEADS };
        let led = self.fix_at.is_some_and(|at| self.now.since(at) < leads);
        let valid = estimate.valid.set(Validity::POSITION_XY, led && estimate.valid.contains(Validity::POSITION_XY));
        StateEstimate { valid, ..estimate }
    }

    /// How the estimator gets on with its sensors.
    #[must_use]
    pub fn status(&self) -> EstimatorStatus {
        self.eskf.status()
    }

    /// Where the local frame begins.
    #[must_use]
    pub const fn home(&self) -> &Home {
        &self.home
    }

    /// Heights that nothing has estimated.
    #[must_use]
    pub const fn heights(&self) -> &MeasuredHeights {
        &self.heights
    }

    /// The air.
    #[must_use]
    pub fn air(&self) -> AirState {
        self.air.state(&self.eskf.estimate())
    }
}
