//! Two hours of flight at 400 Hz with all sensors, across the overflow of 32-bit microseconds.

use super::flight::{Flight, is_sound};
use stampfly_eskf::{Eskf, EskfConfig, Estimator, Fusion};
use stampfly_types::Instant;

#[test]
fn two_hours_leave_it_as_sound_as_the_first_minute() {
    let mut flight = Flight::new(Instant::from_micros((1 << 32) - 1_800_000_000), 3);
    let config = EskfConfig { mag_enable: true, ..EskfConfig::default() };
    let mut eskf = Eskf::new(config);
    eskf.initialize(flight.start, &flight.calibration());
    let (mut squares, mut flows) = (0.0, 0u32);
    for step in 1..=2 * 3600 * 400u64 {
        // Flow separately, so that its innovations can be observed.
        let at = flight.at(step);
        let imu = flight.imu(at);
        eskf.predict(at, &imu);
        if step % 13 == 0 {
            _ = eskf.fuse_tof(at, &flight.tof(at));
        }
        if step % 4 == 0
            && let Fusion::Fused { ratio } | Fusion::Gated { ratio } = eskf.fuse_flow(at, &flight.flow(at))
        {
            squares += f64::from(ratio * config.gate_distance(2));
            flows += 1;
        }
        if step % 8 == 0 {
            _ = eskf.fuse_baro(at, &flight.baro(at));
        }
        if step % 16 == 0 {
            _ = eskf.fuse_mag(at, &flight.mag(at));
        }
        if step % 24_000 == 0 {
            let minute = step / 24_000;
            let [tilt, velocity, height] = flight.errors(&eskf, at);
            assert!(is_sound(&eskf), "minute {minute}");
            assert!(tilt < 0.03 && velocity < 0.15 && height < 0.03, "minute {minute}: {tilt} {velocity} {height}");
            let mean = squares / f64::from(flows);
            assert!((0.1..4.0).contains(&mean), "minute {minute}: flow's innovation squared is {mean}, not about 2");
            (squares, flows) = (0.0, 0);
        }
    }
    let status = eskf.status();
    assert!(!status.diverged && status.resets == 0, "{status:?}");
}
