//! An estimator in that world, and its errors.

use super::world::{Fix, Setting, World, vector};
use stampfly_eskf::{Eskf, EskfConfig, Estimator, Fusion};
use stampfly_types::messages::{BaroData, CalibrationResult, Validity};
use stampfly_types::{GRAVITY, Vec3};
use std::collections::VecDeque;

/// Sensors in use, and faults of the fixes.
#[derive(Clone, Copy)]
pub struct Plan {
    pub seconds: f64,
    /// Errors count from this time.
    pub from: f64,
    pub mag: bool,
    pub baro: bool,
    /// Interval without fixes.
    pub gap: [f64; 2],
    /// Interval in which fixes are wrong by this distance to the north, m.
    pub multipath: [f64; 3],
}

impl Default for Plan {
    fn default() -> Self {
        Self { seconds: 120.0, from: 30.0, mag: false, baro: true, gap: [0.0; 2], multipath: [0.0; 3] }
    }
}

/// Result of a run.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Root mean square error of the horizontal position per axis, m, and of the vertical one.
    pub horizontal: f64,
    pub vertical: f64,
    /// Root mean square error of the heading, degrees.
    pub heading: f64,
    /// Largest horizontal error, m.
    pub worst: f64,
    /// Share of the time without a valid position.
    pub invalid: f64,
    /// Largest error of a valid output in standard deviations: position and heading.
    pub sigmas: [f64; 2],
    /// Time at which the heading first was valid, s.
    pub heading_known: Option<f64>,
    /// Fixes: positions and velocities offered, gated, refused, reset to.
    pub offered: u32,
    pub gated: u32,
    pub refused: u32,
    pub resets: u32,
    pub eskf: Option<Eskf>,
}

/// Heading of an attitude, rad.
pub fn heading(eskf: &Eskf) -> f64 {
    let forward = eskf.estimate().attitude * Vec3::new(1.0, 0.0, 0.0);
    f64::from(forward.y).atan2(f64::from(forward.x))
}

pub fn wrapped(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

/// Runs the estimator.
pub fn run(setting: Setting, plan: Plan, config: EskfConfig) -> Outcome {
    let mut world = World::new(setting);
    let mut eskf = Eskf::new(config);
    let field = world.mag(0.0).field;
    let calibration = CalibrationResult {
        specific_force: Vec3::new(0.0, 0.0, -GRAVITY),
        field: if plan.mag { field } else { Vec3::zeros() },
        complete: true,
        ..CalibrationResult::default()
    };
    eskf.initialize(World::instant(0.0), &calibration);
    let mut outcome = Outcome::default();
    let mut pending: VecDeque<Fix> = VecDeque::new();
    let (mut next_fix, mut next_mag, mut next_baro) = (setting.fix_period, 0.05, 0.04);
    let mut squares = [0.0; 3];
    let (mut counted, mut invalid) = (0u32, 0u32);
    let steps = (plan.seconds * setting.rate) as u32;
    for step in 1..=steps {
        let time = f64::from(step) / setting.rate;
        eskf.predict(World::instant(time), &world.imu(time));
        if time >= next_fix {
            let mut fix = world.fix(next_fix);
            let [from, to, off] = plan.multipath;
            if (from..to).contains(&next_fix) {
                fix.position[0] += off;
            }
            if !(plan.gap[0]..plan.gap[1]).contains(&next_fix) {
                pending.push_back(fix);
            }
            next_fix += setting.fix_period;
        }
        while pending.front().is_some_and(|fix| fix.arrives <= time) {
            let Some(fix) = pending.pop_front() else { break };
            let at = World::instant(fix.at);
            let [h, v] = setting.position_sigma;
            // The vertical error is half as large again.
            let [h, v] = [h.hypot(setting.wander_sigma), v.hypot(1.5 * setting.wander_sigma)].map(|sigma| sigma as f32);
            let [vh, vv] = setting.velocity_sigma.map(|sigma| sigma as f32);
            let told = [
                eskf.fuse_position(at, &vector(fix.position), &Vec3::new(h, h, v)),
                eskf.fuse_velocity(at, &vector(fix.velocity), &Vec3::new(vh, vh, vv)),
            ];
            for fusion in told {
                outcome.offered += 1;
                outcome.gated += u32::from(matches!(fusion, Fusion::Gated { .. }));
                outcome.refused += u32::from(matches!(fusion, Fusion::Refused(_)));
                outcome.resets += u32::from(fusion == Fusion::Reset);
            }
        }
        if plan.mag && time >= next_mag {
            let mag = world.mag(time);
            _ = eskf.fuse_mag(World::instant(time), &mag);
            next_mag += 0.05;
        }
        if plan.baro && time >= next_baro {
            let altitude = world.altitude(time);
            _ = eskf.fuse_baro(World::instant(time), &BaroData { altitude, ..BaroData::default() });
            next_baro += 0.04;
        }
        let estimate = eskf.estimate();
        let truth = world.truth(time);
        let error: [f64; 3] = std::array::from_fn(|i| f64::from(estimate.position[i]) - truth.position[i]);
        let turned = wrapped(heading(&eskf) - truth.heading);
        let p = |i: usize| f64::from(eskf.covariance().get(i, i)).sqrt();
        if estimate.valid.contains(Validity::POSITION_XY) {
            let off = (error[0] / p(0)).abs().max((error[1] / p(1)).abs());
            outcome.sigmas[0] = outcome.sigmas[0].max(off);
        }
        if estimate.valid.contains(Validity::POSITION_Z) {
            outcome.sigmas[0] = outcome.sigmas[0].max((error[2] / p(2)).abs());
        }
        if estimate.valid.contains(Validity::HEADING) {
            outcome.heading_known.get_or_insert(time);
            // The body is level: the third attitude error is that of the heading.
            outcome.sigmas[1] = outcome.sigmas[1].max((turned / p(8)).abs());
        }
        if time < plan.from {
            continue;
        }
        counted += 1;
        invalid += u32::from(!estimate.valid.contains(Validity::POSITION_XY | Validity::POSITION_Z));
        squares[0] += 0.5 * (error[0] * error[0] + error[1] * error[1]);
        squares[1] += error[2] * error[2];
        squares[2] += turned * turned;
        outcome.worst = outcome.worst.max(error[0].hypot(error[1]));
    }
    let [horizontal, vertical, heading] = squares.map(|sum| (sum / f64::from(counted.max(1))).sqrt());
    (outcome.horizontal, outcome.vertical, outcome.heading) = (horizontal, vertical, heading.to_degrees());
    outcome.invalid = f64::from(invalid) / f64::from(counted.max(1));
    outcome.eskf = Some(eskf);
    outcome
}

/// Checks that the position error is within 1.5 times the limit of the receiver's noise, and never
/// above five standard deviations while valid.
pub fn check(name: &str, setting: &Setting, outcome: &Outcome) {
    let Setting { accel_noise, fix_period, position_sigma, velocity_sigma, fix_delay, .. } = *setting;
    let allowed =
        super::reference::position_sigma(accel_noise, fix_period, position_sigma[0], velocity_sigma[0], fix_delay);
    println!(
        "{name}: {:.3} m (allowed {:.3}), {:.3} m vertical, heading {:.2}°, invalid {:.1} %, worst {:.2} m, σ {:?}, known {:?}, {}/{}/{} of {} gated, refused, reset",
        outcome.horizontal,
        1.5 * allowed,
        outcome.vertical,
        outcome.heading,
        100.0 * outcome.invalid,
        outcome.worst,
        outcome.sigmas,
        outcome.heading_known,
        outcome.gated,
        outcome.refused,
        outcome.resets,
        outcome.offered,
    );
    assert!(
        outcome.horizontal < 1.5 * allowed,
        "{name}: {} m, {} m allow {}",
        outcome.horizontal,
        allowed,
        1.5 * allowed
    );
    let down =
        super::reference::position_sigma(accel_noise, fix_period, position_sigma[1], velocity_sigma[1], fix_delay);
    assert!(outcome.vertical < 1.5 * down, "{name}: {} m of height, {} m allow {}", outcome.vertical, down, 1.5 * down);
    assert!(outcome.heading < 3.0, "{name}: heading {}°", outcome.heading);
    assert!(outcome.sigmas.iter().all(|off| *off < 5.0), "{name}: {:?} σ", outcome.sigmas);
    assert!(outcome.invalid < 0.001, "{name}: invalid {} of the time", outcome.invalid);
}
