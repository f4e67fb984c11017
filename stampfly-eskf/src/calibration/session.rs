//! Calibrations on request, one at a time, with progress, hints for the operator and the result.
//!
//! Pass every inertial and magnetic sample, already corrected by the [`Corrections`] given; the
//! session reverts the correction. The [report](CalibrationSession::report) holds progress and a
//! [hint](stampfly_types::messages::CalibrationHint), which the user interface puts into words.
//! Pass a finished report to [`Corrections::accept`]. All calibrations share the memory of the
//! largest one, less than a kilobyte.
//!
//! Not for the calibration after every power-on: that is
//! [`StillCalibration`](super::StillCalibration).

use super::{
    Corrections, DriftFit, DriftRefusal, EllipsoidConfig, EllipsoidFailure, EllipsoidFit, Face, LevelTrim,
    LevelTrimRefusal, NotStill, SixPosition, SixPositionFailure, SixPositionRefusal,
};
use stampfly_types::messages::{
    CalibrationHint as Hint, CalibrationKind as Kind, CalibrationReport, CalibrationStage as Stage, ImuData, MagData,
};
use stampfly_types::{Duration, GRAVITY, Instant, Message, Vec3};

/// Longest time without progress, ten minutes: warming up has longer pauses than turning.
const PATIENCE: Duration = Duration::from_secs(600);
/// Change of temperature required for a drift, K. With less its error would exceed the drift.
const SPAN: f32 = 8.0;
/// Largest plausible drifts, rad/s/K and m/s²/K: five times the data sheet of the BMI270 (0.015 °/s
/// and 0.25 mg).
const DRIFT_MAX: (f32, f32) = (1.3e-3, 1.25e-2);
/// Largest error of the holds' lengths after six positions, m/s²: half a per cent. More means that
/// it was not at rest.
const FORCE_RESIDUAL: f32 = 0.05;
/// Number of magnetic samples between two attempts to solve the ellipsoid.
const LOOK: u32 = 10;
/// Samples, coverage and residual of the ellipsoid. Stricter than the defaults, because a vehicle
/// turned by hand covers more directions.
const ELLIPSOID: (u32, f32, f32) = (150, 0.85, 0.05);

/// The calibration in progress.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[allow(clippy::large_enum_variant, reason = "there is one of them, for as long as the vehicle is on")]
enum Work {
    #[default]
    Nothing,
    Level(LevelTrim),
    SixPositions(SixPosition),
    Magnetometer(EllipsoidFit),
    Temperature(DriftFit),
}

/// Runs calibrations on request.
///
/// ```
/// use stampfly_eskf::calibration::{CalibrationSession, Corrections};
/// use stampfly_types::messages::{CalibrationKind, CalibrationStage, ImuData};
/// use stampfly_types::{GRAVITY, Instant, Vec3, math};
/// let mut session = CalibrationSession::new(&Corrections::default());
/// session.request(Instant::ZERO, CalibrationKind::Level);
/// let (sin, cos) = math::sin_cos(0.02);
/// let felt = ImuData { accel: Vec3::new(0.0, -sin, -cos) * GRAVITY, ..Default::default() };
/// for k in 0..2_000 {
///     session.imu(Instant::from_micros(2_500 * k), &felt);
/// }
/// assert_eq!(session.report().stage, CalibrationStage::Done);
/// let mut found = Corrections::default();
/// assert!(found.accept(session.report()) && (found.level.roll - 0.02).abs() < 1e-5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CalibrationSession {
    work: Work,
    corrections: Corrections,
    report: CalibrationReport,
    /// Time of the last progress.
    since: Instant,
    /// Number of magnetic samples at the last attempt.
    looked: u32,
    /// Hash of the report that [`news`](Self::news) returned last.
    told: u32,
}

/// Hash of a report, in place of a copy (FNV-1a, word by word). Two different reports collide once
/// in 2³².
fn sum(report: &CalibrationReport) -> u32 {
    report.to_words().iter().fold(0x811C_9DC5, |sum: u32, word| (sum ^ word).wrapping_mul(0x0100_0193))
}

impl Default for CalibrationSession {
    fn default() -> Self {
        Self::new(&Corrections::default())
    }
}

impl CalibrationSession {
    /// A session without a request. `corrections` are those applied to the samples.
    #[must_use]
    pub fn new(corrections: &Corrections) -> Self {
        let report = CalibrationReport::default();
        let told = sum(&report);
        Self { work: Work::Nothing, corrections: *corrections, report, since: Instant::ZERO, looked: 0, told }
    }

    /// Progress, hint and result.
    #[must_use]
    pub const fn report(&self) -> &CalibrationReport {
        &self.report
    }

    /// The report, if it has changed since the last call.
    pub fn news(&mut self) -> Option<CalibrationReport> {
        let sum = sum(&self.report);
        (sum != core::mem::replace(&mut self.told, sum)).then_some(self.report)
    }

    /// Whether a calibration is in progress.
    #[must_use]
    pub const fn is_running(&self) -> bool {
        !matches!(self.work, Work::Nothing)
    }

    /// Starts a calibration and drops the one in progress. [`CalibrationKind::None`](Kind::None)
    /// only drops it.
    pub fn request(&mut self, now: Instant, kind: Kind) {
        self.since = now;
        self.looked = 0;
        self.work = match kind {
            Kind::None => return self.end(Stage::Cancelled),
            Kind::Level => Work::Level(LevelTrim::default()),
            Kind::SixPositions => Work::SixPositions(SixPosition::default()),
            Kind::Magnetometer => {
                let (samples_min, coverage_min, residual_max) = ELLIPSOID;
                let config = EllipsoidConfig { samples_min, coverage_min, residual_max, ..EllipsoidConfig::default() };
                Work::Magnetometer(EllipsoidFit::new(config))
            }
            Kind::Temperature => Work::Temperature(DriftFit::default()),
        };
        let hint = if kind == Kind::Magnetometer { Hint::Directions } else { Hint::Measuring };
        self.report = CalibrationReport { kind, stage: Stage::Running, hint, ..CalibrationReport::default() };
    }

    /// Aborts the calibration in progress because the vehicle was armed.
    pub fn arm(&mut self) {
        self.end(Stage::Armed);
    }

    fn end(&mut self, stage: Stage) {
        if self.is_running() {
            self.work = Work::Nothing;
            (self.report.stage, self.report.hint) = (stage, Hint::None);
        }
    }

    fn done(&mut self, [before, residual]: [f32; 2], values: [f32; 9]) {
        self.end(Stage::Done);
        let report = &mut self.report;
        (report.progress, report.before, report.residual, report.values) = (1.0, before, residual, values);
    }

    fn forward(&mut self, now: Instant, progress: f32) {
        if progress > self.report.progress {
            self.report.progress = progress;
            self.since = now;
        }
    }

    /// Takes an inertial sample.
    pub fn imu(&mut self, now: Instant, imu: &ImuData) {
        if self.is_running() && now.since(self.since) > PATIENCE {
            self.end(Stage::TimedOut);
        }
        let measured = |session: &Self| ImuData { accel: session.corrections.undo_accel(imu.accel), ..*imu };
        match self.work {
            Work::Nothing | Work::Magnetometer(_) => {}
            Work::Level(_) => self.level(now, &measured(self)),
            Work::SixPositions(_) => self.six_positions(now, &measured(self)),
            Work::Temperature(_) => self.temperature(now, &measured(self)),
        }
    }

    fn level(&mut self, now: Instant, measured: &ImuData) {
        let Work::Level(level) = &mut self.work else { return };
        let accel = self.corrections.accel;
        let corrected = ImuData { accel: accel.correct(measured.accel), ..*measured };
        match level.step(now, &corrected) {
            Ok(None) => {
                // Motion restarts the average, so the progress shown may decrease.
                self.report.progress = level.progress();
                if self.report.hint == Hint::Moving {
                    self.report.hint = Hint::Measuring;
                }
            }
            Ok(Some((trim, quality))) => {
                // Reconstruct the uncorrected mean force: `Corrections::accept` applies the
                // correction of its own.
                let force = trim.undo(Vec3::new(0.0, 0.0, -GRAVITY - quality.force_error));
                let Vec3 { x, y, z } = force.component_div(&accel.scale) + accel.bias;
                let before = self.corrections.level;
                let tilt = Vec3::new(trim.roll - before.roll, trim.pitch - before.pitch, 0.0).norm();
                self.done([tilt, quality.noise], [x, y, z, trim.roll, trim.pitch, 0.0, 0.0, 0.0, 0.0]);
            }
            Err(LevelTrimRefusal::Tilted { .. }) => self.report.hint = Hint::Tilted,
            Err(LevelTrimRefusal::Moving(NotStill::NotFinite)) => {}
            Err(LevelTrimRefusal::Moving(_)) => (self.report.progress, self.report.hint) = (0.0, Hint::Moving),
        }
    }

    fn six_positions(&mut self, now: Instant, measured: &ImuData) {
        let Work::SixPositions(calibration) = &mut self.work else { return };
        let face = match calibration.step(now, measured) {
            Ok(Some(face)) => face,
            Ok(None) => {
                // A hint about this hold stays until the vehicle is moved.
                if self.report.hint == Hint::Moving {
                    self.report.hint = Hint::Measuring;
                }
                return;
            }
            Err(refusal) => {
                self.report.hint = match refusal {
                    SixPositionRefusal::Moving(NotStill::NotFinite) => return,
                    SixPositionRefusal::Moving(_) | SixPositionRefusal::Creeping => Hint::Moving,
                    SixPositionRefusal::NotAFace => Hint::NoFace,
                    SixPositionRefusal::Contradiction(_) => Hint::Contradiction,
                    SixPositionRefusal::FaceFull(_) => Hint::Turn,
                };
                return;
            }
        };
        self.report.hint = Hint::Turn;
        self.report.faces |= 1 << face as u32;
        let faces = self.report.faces.count_ones();
        let solved = calibration.solve();
        // Six faces and a seventh hold that checks the result.
        self.forward(now, faces as f32 / (Face::ALL.len() + 1) as f32);
        match solved {
            Ok((correction, quality)) if quality.redundancy > 0 => {
                if quality.residual > FORCE_RESIDUAL {
                    return self.end(Stage::Implausible);
                }
                let ([bx, by, bz], [sx, sy, sz]) = (correction.bias.to_array(), correction.scale.to_array());
                let values = [bx, by, bz, sx, sy, sz, 0.0, 0.0, 0.0];
                self.done([quality.residual_before, quality.residual], values);
            }
            Err(SixPositionFailure::NotSolvable | SixPositionFailure::Implausible) => self.end(Stage::Implausible),
            _ => {}
        }
    }

    fn temperature(&mut self, now: Instant, measured: &ImuData) {
        let trim = self.corrections.trim();
        let Work::Temperature(fit) = &mut self.work else { return };
        match fit.step(now, &ImuData { gyro: trim.undo(measured.gyro), ..*measured }) {
            Ok(false) => {
                if self.report.hint == Hint::Moving {
                    self.report.hint = Hint::Measuring;
                }
                return;
            }
            Err(refusal) => {
                self.report.hint = match refusal {
                    DriftRefusal::Moving(NotStill::NotFinite) => return,
                    DriftRefusal::Moving(_) => Hint::Moving,
                    DriftRefusal::NoTemperature => Hint::NoTemperature,
                };
                return;
            }
            Ok(true) => self.report.hint = Hint::Warming,
        }
        let (span, found) = (fit.span(), fit.solve());
        self.forward(now, (span / SPAN).min(1.0));
        let (true, Some(found)) = (span >= SPAN, found) else { return };
        // The samples are already corrected by the known drift; the fit finds the rest.
        let known = self.corrections.drift;
        let (gyro, accel) = (known.gyro + found.gyro, known.accel + found.accel);
        if gyro.amax() > DRIFT_MAX.0 || accel.amax() > DRIFT_MAX.1 {
            return self.end(Stage::Implausible);
        }
        let ([gx, gy, gz], [ax, ay, az]) = (gyro.to_array(), accel.to_array());
        self.done([found.before, found.residual], [gx, gy, gz, ax, ay, az, found.temperature, 0.0, 0.0]);
    }

    /// Takes a magnetic sample.
    pub fn mag(&mut self, now: Instant, mag: &MagData) {
        let Work::Magnetometer(fit) = &mut self.work else { return };
        let Some(measured) = self.corrections.mag.undo(mag.field) else { return };
        // Unusable samples are skipped.
        if fit.add(&measured).is_err() || fit.samples() < self.looked + LOOK {
            return;
        }
        self.looked = fit.samples();
        let (least, coverage_min, _) = ELLIPSOID;
        let samples = (self.looked as f32 / least as f32).min(1.0);
        let (covered, hint) = match fit.solve() {
            Ok((correction, quality)) => {
                let [x, y, z] = correction.offset.to_array();
                let m = correction.matrix;
                let values = [x, y, z, m.m11, m.m22, m.m33, m.m12, m.m13, m.m23];
                let off = (correction.offset - self.corrections.mag.offset).norm() / correction.strength;
                return self.done([off, quality.residual / correction.strength], values);
            }
            Err(EllipsoidFailure::Coverage { coverage }) => (coverage / coverage_min, Hint::Directions),
            Err(EllipsoidFailure::Strength { .. }) => (1.0, Hint::Strength),
            Err(EllipsoidFailure::Residual { .. } | EllipsoidFailure::Stretched { .. }) => (1.0, Hint::Disturbed),
            Err(_) => (0.0, Hint::Directions),
        };
        self.report.hint = hint;
        // Below 1.0 until there is a result.
        self.forward(now, 0.5 * samples + 0.49 * covered.min(1.0));
    }
}
