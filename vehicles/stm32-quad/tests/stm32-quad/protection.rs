//! The protections alone: what they say to samples, rates and duties, and that the motors stop.

use stampfly_stm32_quad::Parameters;
use stampfly_stm32_quad::airframe::AIRFRAME;
use stampfly_stm32_quad::messages::{Attitude, ControlState};
use stampfly_stm32_quad::protection::{CUT, Looked, Protection, config};
use stampfly_types::messages::{Alerts, ImuData};
use stampfly_types::{Duration, GRAVITY, Instant, Quat, Stamped, Vec3};

/// A vehicle in flight that is told to turn as `wanted` says, and does as `rate` says.
struct Rig {
    protection: Protection,
    now: Instant,
    noise: u32,
    state: ControlState,
    attitude: Quat,
    wanted: Vec3,
    duty: [f32; 4],
}

impl Rig {
    fn flying(angle_mode: bool) -> Self {
        Self {
            protection: Protection::new(&AIRFRAME, &Parameters::default()),
            now: Instant::ZERO,
            noise: 1,
            state: ControlState { armed: true, calibrating: false, angle_mode, online: true },
            attitude: Quat::identity(),
            wanted: Vec3::zeros(),
            duty: [AIRFRAME.hover; 4],
        }
    }

    /// Noise of a chip that measures.
    fn shaken(&mut self, vector: Vec3, size: f32) -> Vec3 {
        vector
            + Vec3::from_fn(|_| {
                self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                ((self.noise >> 8) as f32 / (1 << 24) as f32 - 0.5) * size
            })
    }

    /// So many milliseconds of this force and rate; when something that stops the motors is said,
    /// after how many, and what.
    fn feels(&mut self, millis: u32, force: Vec3, rate: Vec3) -> Option<(f32, Alerts)> {
        (1..=4 * millis).find_map(|step| {
            let data = ImuData { accel: self.shaken(force, 0.1), gyro: self.shaken(rate, 0.01), ..ImuData::default() };
            let active = self.sample(data, force, rate);
            active.intersects(CUT).then_some((step as f32 * 0.25, active))
        })
    }

    fn sample(&mut self, data: ImuData, accel: Vec3, rate: Vec3) -> Alerts {
        self.now += Duration::from_micros(250);
        let attitude = Attitude { attitude: self.attitude, rate, accel, ..Attitude::default() };
        let looked = Looked {
            attitude: Some(&attitude),
            state: &self.state,
            wanted: self.wanted,
            duty: &self.duty,
            power: None,
            heard: Some(self.now),
        };
        self.protection.step(self.now, &[Stamped { at: self.now, generation: 1, data }], &looked).active
    }
}

const LEVEL: Vec3 = Vec3::new(0.0, 0.0, -GRAVITY);

fn rolled(angle: f32) -> Quat {
    Quat::from_axis_angle(&Vec3::x(), angle)
}

/// What something feels that rests like this.
fn resting(attitude: Quat) -> Vec3 {
    attitude.inverse_transform_vector(&LEVEL)
}

#[test]
fn a_sensor_that_repeats_itself_is_found_within_60_ms() {
    let mut rig = Rig::flying(true);
    assert_eq!(rig.feels(1_000, LEVEL, Vec3::zeros()), None);
    let data = ImuData { accel: LEVEL, gyro: Vec3::new(0.01, 0.0, 0.0), ..ImuData::default() };
    let after = (1..1_000).find(|_| rig.sample(data, LEVEL, Vec3::zeros()).contains(Alerts::IMU_FAULTY));
    assert!(after.is_some_and(|samples| samples <= 240), "{after:?} samples");
}

#[test]
fn a_blow_that_no_leg_bears_is_one_and_a_firm_touch_is_none() {
    for (force, is_blow) in [(9.0, false), (14.0, true)] {
        let mut rig = Rig::flying(true);
        assert_eq!(rig.feels(500, LEVEL, Vec3::zeros()), None);
        let found = rig.feels(30, LEVEL * force, Vec3::zeros());
        let seen = found.is_some_and(|(after, alerts)| after < 22.0 && alerts.contains(Alerts::IMPACT));
        assert_eq!(seen, is_blow, "{found:?}");
    }
}

#[test]
fn on_its_back_it_lies_whatever_it_is_told_and_in_either_mode() {
    for angle_mode in [false, true] {
        let mut rig = Rig::flying(angle_mode);
        rig.attitude = rolled(3.0);
        let (after, alerts) = rig.feels(2_000, resting(rolled(3.0)), Vec3::zeros()).expect("noticed");
        assert!(after < 650.0 && alerts.contains(Alerts::TUMBLED), "{after} ms");
        // It says so as long as it lies, and for two seconds more.
        rig.state.armed = false;
        rig.duty = [0.0; 4];
        assert!(rig.feels(3_000, resting(rolled(3.0)), Vec3::zeros()).is_some());
        rig.attitude = rolled(0.0);
        let clear = (0..40_000).find(|_| {
            let data =
                ImuData { accel: rig.shaken(LEVEL, 0.1), gyro: rig.shaken(Vec3::zeros(), 0.01), ..Default::default() };
            !rig.sample(data, LEVEL, Vec3::zeros()).intersects(CUT)
        });
        assert!(clear.is_some_and(|samples| (7_600..8_600).contains(&samples)), "{clear:?}");
    }
}

#[test]
fn on_its_side_it_lies_and_at_full_speed_it_leans_as_far() {
    let lies = resting(rolled(1.1));
    let mut rig = Rig::flying(false);
    assert!(rig.feels(1_000, lies, Vec3::zeros()).is_some());
    let mut dash = Rig::flying(false);
    (dash.attitude, dash.duty) = (rolled(1.1), [0.95; 4]);
    assert_eq!(dash.feels(5_000, lies, Vec3::zeros()), None);
}

#[test]
fn what_does_not_turn_as_it_is_told_has_tumbled() {
    let mut rig = Rig::flying(true);
    rig.wanted = Vec3::new(4.0, 0.0, 0.0);
    let (after, alerts) = rig.feels(1_000, LEVEL * 0.8, Vec3::zeros()).expect("noticed");
    assert!(after < 500.0 && alerts.contains(Alerts::TUMBLED), "{after} ms");
    // With its throttle down it is not asked.
    let mut falls = Rig { duty: [0.0; 4], ..Rig::flying(false) };
    falls.wanted = Vec3::new(3.1, 0.0, 0.0);
    assert_eq!(falls.feels(3_000, LEVEL * 0.1, Vec3::new(-2.0, 1.0, 0.0)), None);
}

#[test]
fn inverted_flight_in_acro_is_flight() {
    let mut rig = Rig::flying(false);
    rig.attitude = rolled(3.1);
    // Thrust, and less and less of it as the air carries it.
    for force in [-1.0, -0.5, -0.1, 0.3, 0.6] {
        assert_eq!(rig.feels(800, Vec3::new(0.0, 0.5, force * GRAVITY), Vec3::zeros()), None, "{force} g");
    }
    let mut rolls = Rig::flying(false);
    rolls.wanted = Vec3::new(3.0, 0.0, 0.0);
    assert_eq!(rolls.feels(3_000, LEVEL, Vec3::new(3.0, 0.0, 0.0)), None);
}

#[test]
fn the_numbers_follow_the_sticks() {
    let slow = Parameters::default();
    let mut fast = slow;
    (fast.stick.angle_max, fast.stick.rotation_max) = (1.2, 12.0);
    let [slow, fast] = [&slow, &fast].map(|parameters| config(&AIRFRAME, parameters));
    assert!((slow.tumble_tilt - 1.47).abs() < 0.01 && fast.tumble_tilt > slow.tumble_tilt);
    // On its back in ANGLE it is to turn at 14.5 rad/s.
    assert!(slow.rate > 20.0 && fast.rate > slow.rate && fast.rate < 34.9, "{} {}", slow.rate, fast.rate);
}
