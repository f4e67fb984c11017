//! Rates that follow torques, and others.

use super::*;

const INERTIA: f32 = 1e-5;
const DT: f32 = 0.0025;

/// A vehicle whose controller asks for torques that go to and fro, rad/s², for four seconds, beside
/// a constant one. The body does `body` times what they make, and `disturbed` is what else turns
/// it, rad/s²; the gyro tells `scale` of that, noisy. Do its rates follow in the last two seconds?
/// Before that the constant torque is a change.
fn follow(asked: f32, constant: f32, body: f32, scale: f32, disturbed: fn(f32) -> f32) -> bool {
    let config = FailsafeConfig { inertia: Vec3::repeat(INERTIA), motor_lag: 0.02, ..FailsafeConfig::default() };
    let (mut monitor, mut rig) = (FollowsMonitor::default(), Rig::flying());
    let (mut lagged, mut rate) = (0.0, 0.0);
    (0..1600u16).all(|n| {
        let time = DT * f32::from(n);
        let torque = asked * stampfly_types::math::sin(12.0 * time) + constant;
        lagged += (torque - lagged) * (DT / (0.02 + DT));
        rate += (body * (lagged - constant) + disturbed(time)) * DT;
        let imu = ImuData { gyro: Vec3::new(0.0, scale * rate, 0.0) + rig.noise(0.1), ..Default::default() };
        let follows = monitor.step(
            &config,
            Instant::from_micros(2_500 * u64::from(n)),
            &imu,
            Vec3::new(0.0, torque * INERTIA, 0.0),
        );
        follows || n < 800
    })
}

#[test]
fn rates_of_any_specimen_follow() {
    for body in [0.6, 1.0, 1.4] {
        for constant in [0.0, 100.0, -150.0] {
            assert!(follow(40.0, constant, body, 1.0, |_| 0.0), "{body}, askew by {constant} rad/s^2");
        }
        assert!(follow(40.0, 0.0, body, 0.6, |_| 0.0), "{body}, a gyro of 0.6 of its scale");
        assert!(follow(40.0, 0.0, body, 1.0, |time| if time < 3.0 { 10.0 } else { -10.0 }), "{body}, in a gust");
    }
}

#[test]
fn rates_of_another_body_do_not_follow() {
    for scale in [0.0, 0.2, -1.0] {
        assert!(!follow(40.0, 0.0, 1.0, scale, |_| 0.0), "{scale}");
    }
    assert!(!follow(40.0, 0.0, 0.1, 1.0, |_| 0.0), "motors that do not answer");
}

#[test]
fn where_nothing_is_asked_everything_follows() {
    for scale in [0.0, -1.0] {
        assert!(follow(1.0, 100.0, 1.0, scale, |_| 0.0), "{scale}");
    }
}

#[test]
fn of_an_unknown_airframe_every_rate_follows() {
    let mut monitor = FollowsMonitor::default();
    let config = FailsafeConfig::default();
    let follows = (0..400u16).all(|n| {
        let rate = if n % 80 < 40 { 30.0 } else { -30.0 };
        let imu = ImuData { gyro: Vec3::repeat(rate), ..Default::default() };
        monitor.step(&config, Instant::from_micros(2_500 * u64::from(n)), &imu, Vec3::repeat(-rate))
    });
    assert!(follows);
}
