//! Airspeed alone, after the receiver has become silent, in an unknown wind.

use super::run::heading;
use super::world::{Setting, World, vector};
use stampfly_eskf::aid::{self, airspeed::Wind};
use stampfly_eskf::{Eskf, EskfConfig, Estimator, Fusion, StartHeading};
use stampfly_types::messages::{BaroData, CalibrationResult, Validity};
use stampfly_types::{GRAVITY, Vec3};

#[test]
fn airspeed_alone_holds_velocity_and_position_in_an_unknown_wind() {
    for (seed, wind) in [(1, [3.0, -2.0]), (2, [-5.0, 1.0]), (3, [0.0, 0.0]), (4, [2.0, 6.0])] {
        let with = fly(seed, wind, true);
        let without = fly(seed, wind, false);
        println!("wind {wind:?}: {with:?}; without {without:?}");
        assert!(with.sigmas < 5.0 && with.heading < 3.0, "{wind:?}: {with:?}");
        assert!(with.speed < 1.0 && with.invalid == 0.0, "{wind:?}: {with:?}");
        assert!((with.wind[0] - wind[0]).hypot(with.wind[1] - wind[1]) < 0.5, "{wind:?}: {with:?}");
        assert_eq!((with.refused, with.gated), (0, 0));
        assert!(
            without.invalid > 0.9 && without.position > 2.0 * with.position,
            "{wind:?}: {with:?}, without {without:?}"
        );
    }
}

/// Over two minutes after a minute with fixes: the largest error of position, m, and velocity, m/s,
/// the larger one of both in standard deviations, the heading error, degrees, and the share of the
/// time without a valid position.
#[derive(Debug, Default)]
struct Flown {
    position: f64,
    speed: f64,
    sigmas: f64,
    heading: f64,
    invalid: f64,
    wind: [f64; 2],
    gated: u32,
    refused: u32,
}

fn fly(seed: u64, blows: [f64; 2], airspeed: bool) -> Flown {
    let setting = Setting { speed: 15.0, radius: 80.0, stands: 5.0, seed, ..Setting::default() };
    let mut world = World::new(setting);
    let mut eskf = Eskf::new(EskfConfig {
        mag_enable: true,
        start_heading: StartHeading::Magnetic,
        earth_field: Some(aid::field::earth(0.0, 1.107)),
        ..EskfConfig::outdoors()
    });
    let field = world.mag(0.0).field;
    let specific_force = Vec3::new(0.0, 0.0, -GRAVITY);
    eskf.initialize(World::instant(0.0), &CalibrationResult { specific_force, field, ..CalibrationResult::default() });
    let (mut wind, mut flown, mut invalid) = (Wind::default(), Flown::default(), 0u32);
    for step in 1..=36_000u32 {
        let time = f64::from(step) / 200.0;
        let at = World::instant(time);
        eskf.predict(at, &world.imu(time));
        if step % 40 == 0 && time < 60.0 {
            let fix = world.fix(time);
            _ = eskf.fuse_position(at, &vector(fix.position), &Vec3::new(0.5, 0.5, 0.8));
            _ = eskf.fuse_velocity(at, &vector(fix.velocity), &Vec3::new(0.1, 0.1, 0.15));
        }
        if step % 10 == 0 {
            _ = eskf.fuse_mag(at, &world.mag(time));
            _ = eskf.fuse_baro(at, &BaroData { altitude: world.altitude(time), ..BaroData::default() });
        }
        let truth = world.truth(time);
        if airspeed && step % 20 == 5 && time > 15.0 {
            wind.propagate(0.1);
            let (sin, cos) = truth.heading.sin_cos();
            let noise = f64::from(step * 7 % 13) / 6.0 - 1.0;
            let speed = cos * (truth.velocity[0] - blows[0]) + sin * (truth.velocity[1] - blows[1]) + 0.3 * noise;
            let fusion = eskf.fuse_airspeed(at, speed as f32, 0.3, &mut wind);
            flown.gated += u32::from(matches!(fusion, Fusion::Gated { .. }));
            flown.refused += u32::from(matches!(fusion, Fusion::Refused(_)));
        }
        if time < 60.0 {
            continue;
        }
        let estimate = eskf.estimate();
        let valid = estimate.valid.contains(Validity::POSITION_XY | Validity::VELOCITY_XY);
        invalid += u32::from(!valid);
        for axis in 0..2 {
            let off = [
                f64::from(estimate.position[axis]) - truth.position[axis],
                f64::from(estimate.velocity[axis]) - truth.velocity[axis],
            ];
            flown.position = flown.position.max(off[0].abs());
            flown.speed = flown.speed.max(off[1].abs());
            for (part, off) in off.into_iter().enumerate().filter(|_| valid) {
                let deviation = f64::from(eskf.covariance().get(3 * part + axis, 3 * part + axis)).sqrt();
                flown.sigmas = flown.sigmas.max(off.abs() / deviation);
            }
        }
        let turned = (heading(&eskf) - truth.heading).sin().asin().abs().to_degrees();
        flown.heading = flown.heading.max(turned);
    }
    flown.invalid = f64::from(invalid) / 24_000.0;
    flown.wind = wind.velocity().map(f64::from);
    flown
}
