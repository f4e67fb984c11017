//! Estimators and calibrations.

use super::{Numbers, STEP, at, bytes, goes_on};
use stampfly_eskf::attitude::{AttitudeConfig, AttitudeFilter, Mahony};
use stampfly_eskf::calibration::{
    EllipsoidFit, LevelTrim, SixPosition, StillCalibration, StillnessConfig, TemperatureTable,
};
use stampfly_eskf::filter::History;
use stampfly_eskf::{Complementary, ComplementaryConfig, Eskf, EskfConfig, Estimator, GravityUse, MagModel};
use stampfly_types::messages::*;
use stampfly_types::{GRAVITY, Quat, Vec3};

const STILL: Vec3 = Vec3::new(0.0, 0.0, -GRAVITY);
const EARTH: Vec3 = Vec3::new(30.0, 0.0, 35.0);

/// A flight: stands, lifts off, is moved about, gets a new origin, is started again.
fn fly<E: Estimator>(estimator: &mut E, k: u64, n: &mut Numbers) -> (StateEstimate, EstimatorStatus) {
    if k == 1 {
        let calibration = CalibrationResult {
            gyro_bias: n.vector(0.01),
            specific_force: STILL + n.vector(0.2),
            field: EARTH,
            complete: true,
            ..Default::default()
        };
        estimator.initialize(at(0), &calibration);
    }
    let command = EstimatorCommand {
        on_ground: k < 100,
        flying: k > 300,
        accel_faulty: (900..950).contains(&k),
        origin_resets: u32::from(k > 550) + u32::from(k > 800),
        full_resets: u32::from(k > 580),
    };
    estimator.command(at(k), &command);
    let imu = ImuData { accel: STILL + n.vector(1.0), gyro: n.vector(0.4), temperature: 25.0, ..Default::default() };
    estimator.predict(at(k), &imu);
    let (distance, quality) = (0.4 + n.number(0.02), 150 + n.number(100.0) as u8);
    if k.is_multiple_of(13) {
        _ = estimator.fuse_tof(at(k), &TofData { distance, sigma: 0.01, status: 0, valid: !n.once_in(8) });
    }
    if k % 4 == 1 {
        let [delta_x, delta_y] = [n.number(0.01), n.number(0.01)];
        _ = estimator.fuse_flow(at(k - 1), &FlowData { delta_x, delta_y, interval: 0.01, quality, valid: true });
    }
    if k % 16 == 2 {
        let altitude = 100.0 + n.number(0.3);
        _ = estimator.fuse_baro(at(k), &BaroData { pressure: 1e5, temperature: 25.0, altitude });
        _ = estimator.fuse_mag(at(k), &MagData { field: EARTH + n.vector(2.0) });
    }
    if k % 40 == 3 {
        _ = estimator.fuse_velocity(at(k), &n.vector(0.1), &Vec3::new(0.2, 0.2, 0.2));
        _ = estimator.fuse_position(at(k), &n.vector(0.1), &Vec3::new(0.2, 0.2, 0.2));
        _ = estimator.fuse_attitude(at(k), &Quat::from_euler_angles(n.number(0.1), n.number(0.1), n.number(0.1)), 0.1);
    }
    (estimator.estimate(), estimator.status())
}

#[test]
fn eskf_goes_on() {
    let other = EskfConfig {
        baro_enable: true,
        mag_enable: true,
        mag_model: MagModel::Field,
        gravity_use: GravityUse::Always,
        ..EskfConfig::default()
    };
    for config in [EskfConfig::default(), other] {
        let eskf = goes_on(Eskf::new(config), 600, fly);
        let status = eskf.status();
        let used = status.offered.iter().zip(status.refused).map(|(offered, refused)| offered - refused);
        assert!(used.take(2).all(|used| used > 20), "{status:?}");
    }
}

#[test]
fn complementary_goes_on() {
    goes_on(Complementary::new(ComplementaryConfig::default()), 600, fly);
}

#[test]
fn attitude_filters_go_on() {
    goes_on(AttitudeFilter::new(AttitudeConfig { hard_iron: true, ..AttitudeConfig::default() }), 1_500, fly);
    goes_on(Mahony::new(0.4), 500, |mahony, _, n| {
        mahony.step(&(STILL + n.vector(1.0)), &n.vector(0.5), STEP.seconds());
        mahony.attitude()
    });
}

fn still(n: &mut Numbers) -> ImuData {
    let accel = STILL + Vec3::new(0.1, -0.05, 0.02) + n.vector(0.02);
    ImuData {
        accel,
        gyro: Vec3::new(0.01, -0.02, 0.005) + n.vector(0.003),
        temperature: 24.0 + n.number(0.5),
        ..Default::default()
    }
}

#[test]
fn calibrations_go_on() {
    // Restored half way through its stretch, complete at the end.
    let calibration = goes_on(StillCalibration::default(), 900, |calibration, k, n| {
        if k.is_multiple_of(16) {
            calibration.add_mag(&MagData { field: EARTH + n.vector(1.0) });
            calibration.add_baro(&BaroData { altitude: 100.0 + n.number(0.5), ..Default::default() });
        }
        let _ = calibration.step(at(k), &still(n));
        calibration.result()
    });
    assert!(calibration.result().complete);

    let short = StillnessConfig { samples: 200, ..StillnessConfig::default() };
    let mut trims = 0;
    goes_on(LevelTrim::new(short, 0.2), 700, |level, k, n| {
        trims += u32::from(level.step(at(k), &still(n)).is_ok_and(|trim| trim.is_some()));
        level.progress()
    });
    assert!(trims > 2);
    let mut filled = 0;
    goes_on(TemperatureTable::new(short), 1_500, |table, k, n| {
        let imu = ImuData { temperature: 20.0 + 0.01 * k as f32, ..still(n) };
        filled += u32::from(table.step(at(k), &imu) == Ok(true));
        table.bias(35.0).map(|bias| bias.gyro)
    });
    assert!(filled > 4);
    let mut faces = 0;
    goes_on(SixPosition::new(short), 2_400, |six, k, n| {
        let imu = still(n);
        let [x, y, z] = imu.accel.into();
        let turned = [[x, y, z], [z, x, y], [y, z, x], [x, y, -z], [-z, x, y], [y, -z, x]];
        let accel = Vec3::from(turned[(k / 800) as usize % 6]);
        let step = six.step(at(k), &ImuData { accel, ..imu });
        faces += u32::from(step.is_ok_and(|face| face.is_some()));
        six.solve().map_or([0.0; 3], |(correction, _)| correction.bias.into())
    });
    assert!(faces > 4);
    let fit = goes_on(EllipsoidFit::default(), 400, |fit, _, n| {
        let field = Vec3::new(5.0, -8.0, 3.0) + n.vector(1.0).normalize() * 46.0;
        let _ = fit.add(&field);
        (fit.samples(), fit.solve().map_or(EARTH, |(correction, _)| correction.offset))
    });
    let (correction, _) = fit.solve().expect("a sphere");
    let back = postcard::from_bytes(&bytes(&correction));
    assert_eq!(back, Ok(correction));
}

#[test]
fn a_place_beyond_the_memory_is_refused() {
    let mut written = bytes(&History::default());
    assert!(postcard::from_bytes::<History>(&written).is_ok());
    // The place of the newest stretch is the last number.
    *written.last_mut().expect("bytes") = 48;
    assert!(postcard::from_bytes::<History>(&written).is_err());
    *written.last_mut().expect("bytes") = 47;
    assert!(postcard::from_bytes::<History>(&written).is_ok());
    assert!(postcard::from_bytes::<History>(&written[..written.len() - 2]).is_err());
}
