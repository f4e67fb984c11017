//! Calibrations on request, on a vehicle that flies with the corrections of an earlier one.

use super::{Errors, MAG_NOISE, Random, still};
use stampfly_eskf::calibration::{CalibrationSession, Corrections, Corrector, Face};
use stampfly_types::messages::{
    CalibrationHint, CalibrationKind, CalibrationReport, CalibrationStage, ImuData, MagData,
};
use stampfly_types::{Duration, GRAVITY, Instant, Quat, Vec3};

/// A vehicle with sensor errors, handled by a person.
struct Held {
    random: Random,
    bias: Vec3,
    gain: Vec3,
    drift: (Vec3, Vec3),
    mount: Quat,
    iron: Vec3,
    stretch: Vec3,
    temperature: f32,
    now: Instant,
    corrector: Corrector,
    session: CalibrationSession,
}

impl Held {
    fn new(seed: u64, known: &Corrections) -> Self {
        let mut random = Random::new(seed);
        Self {
            bias: random.vector(0.4),
            gain: Vec3::repeat(1.0) + random.vector(0.02),
            drift: (random.vector(2e-4), random.vector(2e-3)),
            mount: Quat::from_euler_angles(random.within(0.03), random.within(0.03), 0.0),
            iron: random.vector(40.0),
            stretch: Vec3::repeat(1.0) + random.vector(0.06),
            temperature: 25.0,
            now: Instant::ZERO,
            corrector: Corrector::new(known),
            session: CalibrationSession::new(known),
            random,
        }
    }

    fn sample(&mut self, up: &Vec3, rate: &Vec3) -> ImuData {
        let warmer = self.temperature - 25.0;
        let felt = (self.mount.inverse() * *up).component_mul(&self.gain) + self.bias + self.drift.1 * warmer;
        let mut imu = still(&mut self.random, &(rate + self.drift.0 * warmer), &felt, self.temperature);
        self.corrector.imu(&mut imu);
        imu
    }

    /// Lies with this true specific force after being placed, until the hint changes or the time is
    /// over.
    fn lie(&mut self, up: &Vec3, seconds: f32) -> CalibrationHint {
        for step in 0..(seconds * 400.0) as u32 {
            self.now += Duration::from_micros(2_500);
            let rate = if step < 80 { Vec3::repeat(2.0) } else { Vec3::zeros() };
            let imu = self.sample(up, &rate);
            self.session.imu(self.now, &imu);
        }
        self.session.report().hint
    }

    fn six_positions(&mut self) -> CalibrationReport {
        self.session.request(self.now, CalibrationKind::SixPositions);
        for face in Face::ALL.into_iter().chain([Face::Bottom]) {
            assert_eq!(self.session.report().stage, CalibrationStage::Running, "{face:?}");
            self.lie(&(up(face) * GRAVITY), 3.0);
        }
        *self.session.report()
    }

    fn turn(&mut self, strength: f32) -> CalibrationReport {
        self.session.request(self.now, CalibrationKind::Magnetometer);
        for _ in 0..600 {
            self.now += Duration::from_millis(40);
            let field = self.random.direction().component_mul(&self.stretch) * strength + self.iron;
            let mut mag = MagData { field: field + self.random.noise(MAG_NOISE) };
            self.corrector.mag(&mut mag);
            self.session.mag(self.now, &mag);
        }
        *self.session.report()
    }

    fn warm(&mut self, by: f32) -> CalibrationReport {
        self.session.request(self.now, CalibrationKind::Temperature);
        let from = self.temperature;
        for step in 0..24_000_u16 {
            self.now += Duration::from_micros(2_500);
            self.temperature = from + by * f32::from(step) / 24_000.0;
            let imu = self.sample(&Vec3::new(0.0, 0.0, -GRAVITY), &Vec3::zeros());
            self.session.imu(self.now, &imu);
        }
        *self.session.report()
    }
}

/// Direction of the supporting force when this face is down.
fn up(face: Face) -> Vec3 {
    match face {
        Face::Front => -Vec3::x(),
        Face::Rear => Vec3::x(),
        Face::Right => -Vec3::y(),
        Face::Left => Vec3::y(),
        Face::Bottom => -Vec3::z(),
        Face::Top => Vec3::z(),
    }
}

#[test]
fn what_is_found_twice_is_the_same_although_the_second_time_it_was_corrected() {
    let (mut biases, mut levels, mut irons, mut drifts, mut again) =
        (Errors::default(), Errors::default(), Errors::default(), Errors::default(), Errors::default());
    for seed in 0..10 {
        let mut found = Corrections::default();
        let mut last = None;
        for round in 0..2 {
            let mut held = Held::new(seed, &found);
            let drift = held.warm(12.0);
            assert!(found.accept(&drift), "{drift:?}");
            drifts.0.push((found.drift.gyro - held.drift.0).amax());
            // The other calibrations run at the temperature without drift.
            held.temperature = 25.0;
            found.drift.reference = 25.0;
            let six = held.six_positions();
            assert!(found.accept(&six), "{six:?}");
            biases.0.push((found.accel.bias - held.bias).amax());
            held.session.request(held.now, CalibrationKind::Level);
            held.lie(&Vec3::new(0.0, 0.0, -GRAVITY), 5.0);
            assert!(found.accept(held.session.report()), "{:?}", held.session.report());
            let mut stands = held.sample(&Vec3::new(0.0, 0.0, -GRAVITY), &Vec3::zeros());
            stands.accel =
                found.trim().correct(found.accel.correct(held.corrector.corrections().undo_accel(stands.accel)));
            levels.0.push(stands.accel.horizontal().norm() / GRAVITY);
            let turned = held.turn(46.0);
            assert!(found.accept(&turned), "{turned:?}");
            irons.0.push((found.mag.offset - held.iron).amax());
            if round == 1 {
                let before: Corrections = last.unwrap();
                again.0.push((before.accel.bias - found.accel.bias).amax());
                assert!(turned.before < 0.02 && six.residual < 5e-3, "{turned:?} {six:?}");
            }
            last = Some(found);
        }
    }
    assert!(drifts.report("session: drift of the gyro", "rad/s/K").1 < 2e-5);
    assert!(biases.report("session: bias", "m/s²").1 < 1e-2);
    assert!(levels.report("session: level", "rad").1 < 1e-2);
    assert!(irons.report("session: hard iron", "µT").1 < 0.5);
    assert!(again.report("session: bias, twice", "m/s²").1 < 1e-2);
}

#[test]
fn it_says_what_to_do() {
    let mut held = Held::new(3, &Corrections::default());
    assert_eq!(held.session.news(), None, "nothing was asked for");
    held.session.request(held.now, CalibrationKind::SixPositions);
    assert_eq!(held.session.news().map(|report| report.stage), Some(CalibrationStage::Running));
    assert_eq!(held.session.news(), None);
    assert_eq!(held.lie(&(up(Face::Front) * GRAVITY), 3.0), CalibrationHint::Turn);
    assert_eq!(held.lie(&(up(Face::Front) * GRAVITY), 0.2), CalibrationHint::Moving);
    assert_eq!(held.lie(&(Vec3::new(-0.7, 0.0, -0.714) * GRAVITY), 3.0), CalibrationHint::NoFace);
    assert_eq!(held.session.report().faces, 1);
    held.session.request(held.now, CalibrationKind::Level);
    assert_eq!(held.lie(&(Vec3::new(0.3, 0.0, -0.954) * GRAVITY), 5.0), CalibrationHint::Tilted);
    held.session.request(held.now, CalibrationKind::Magnetometer);
    let iron = MagData { field: Vec3::new(30.0, 0.0, 36.0) };
    held.session.mag(held.now, &iron);
    assert_eq!(held.session.report().hint, CalibrationHint::Directions);
}

#[test]
fn it_ends_when_the_vehicle_is_armed_or_nobody_goes_on_and_nothing_is_taken_of_it() {
    let mut found = Corrections::default();
    for stage in [CalibrationStage::Armed, CalibrationStage::Cancelled, CalibrationStage::TimedOut] {
        let mut held = Held::new(4, &found);
        held.session.request(held.now, CalibrationKind::SixPositions);
        held.lie(&(up(Face::Front) * GRAVITY), 3.0);
        match stage {
            CalibrationStage::Armed => held.session.arm(),
            CalibrationStage::Cancelled => held.session.request(held.now, CalibrationKind::None),
            _ => {
                held.now += Duration::from_secs(601);
                held.lie(&(up(Face::Front) * GRAVITY), 0.1);
            }
        }
        assert_eq!((held.session.report().stage, held.session.is_running()), (stage, false));
        assert!(!found.accept(held.session.report()) && found == Corrections::default());
        // A finished calibration stays finished, and reports nothing else.
        let report = *held.session.report();
        held.lie(&(up(Face::Rear) * GRAVITY), 3.0);
        assert_eq!(*held.session.report(), report);
    }
}

#[test]
fn a_drift_that_no_sensor_has_is_refused() {
    let mut held = Held::new(5, &Corrections::default());
    held.drift.0.y = 2e-3;
    assert_eq!(held.warm(10.0).stage, CalibrationStage::Implausible);
    let mut held = Held::new(5, &Corrections::default());
    assert_eq!(held.warm(4.0).stage, CalibrationStage::Running, "too little for a result");
}

#[test]
fn it_is_small() {
    let session = size_of::<CalibrationSession>();
    println!("{session} bytes, of them corrections {}", size_of::<Corrections>());
    assert!(session < 1_000, "{session}");
}
