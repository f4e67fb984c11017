//! Still calibration, six positions, level trim.

use super::{ACCEL_NOISE, CASES, Errors, GYRO_NOISE, Random, still};
use stampfly_eskf::calibration::{
    Face, LevelTrim, SixPosition, SixPositionFailure, SixPositionRefusal, StillCalibration,
};
use stampfly_types::{Duration, GRAVITY, Instant, Quat, Vec3};

#[test]
fn the_gyro_bias_of_a_still_vehicle_is_found() {
    let mut errors = Errors::default();
    for seed in 0..CASES {
        let random = &mut Random::new(seed);
        let (gyro, accel) = (random.vector(0.03), Vec3::new(0.0, 0.0, -GRAVITY) + random.vector(0.3));
        let mut calibration = StillCalibration::default();
        for step in 0..1_500 {
            calibration.step(Instant::from_micros(2_500 * step), &still(random, &gyro, &accel, 25.0)).unwrap();
        }
        assert!(calibration.result().complete);
        let quality = calibration.quality().unwrap();
        assert!((quality.gyro_noise / GYRO_NOISE - Vec3::repeat(1.0)).amax() < 0.15, "{quality:?}");
        assert!((quality.accel_noise / ACCEL_NOISE - Vec3::repeat(1.0)).amax() < 0.15, "{quality:?}");
        errors.0.push((calibration.result().gyro_bias - gyro).amax());
    }
    // Five standard errors of a mean of a thousand.
    assert!(errors.report("still: gyro bias", "rad/s").1 < 5.0 * GYRO_NOISE / 31.6);
}

/// A vehicle that is placed on its faces.
struct Placed {
    calibration: SixPosition,
    random: Random,
    bias: Vec3,
    gain: Vec3,
    now: Instant,
}

impl Placed {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let (bias, gain) = (random.vector(1.0), Vec3::repeat(1.0) + random.vector(0.04));
        Self { calibration: SixPosition::default(), random, bias, gain, now: Instant::ZERO }
    }

    fn measured(&self, force: &Vec3) -> Vec3 {
        force.component_mul(&self.gain) + self.bias
    }

    /// Turns the vehicle, then leaves it at rest with this true specific force.
    fn hold(&mut self, force: &Vec3) -> Result<Face, SixPositionRefusal> {
        let measured = self.measured(force);
        for step in 0..1_200 {
            self.now += Duration::from_micros(2_500);
            let turn = if step < 80 { Vec3::repeat(2.0) } else { Vec3::zeros() };
            match self.calibration.step(self.now, &still(&mut self.random, &turn, &measured, 25.0)) {
                Ok(Some(face)) => return Ok(face),
                Err(refusal) if !matches!(refusal, SixPositionRefusal::Moving(_)) => return Err(refusal),
                _ => {}
            }
        }
        panic!("neither taken nor refused");
    }

    /// The specific force on a face, tilted by up to 12° per axis.
    fn leaning(&mut self, face: Face) -> Vec3 {
        let axis = match face {
            Face::Front => -Vec3::x(),
            Face::Rear => Vec3::x(),
            Face::Right => -Vec3::y(),
            Face::Left => Vec3::y(),
            Face::Bottom => -Vec3::z(),
            Face::Top => Vec3::z(),
        };
        Quat::from_scaled_axis(self.random.vector(0.2)) * axis * GRAVITY
    }
}

#[test]
fn scale_and_bias_are_found_from_six_leaning_faces() {
    let (mut biases, mut scales, mut lengths) = (Errors::default(), Errors::default(), Errors::default());
    for seed in 0..CASES {
        let mut placed = Placed::new(seed);
        // In a random order; half of the vehicles are placed on two faces twice.
        let mut order = [0, 1, 2, 3, 4, 5].map(|n| Face::ALL[(n * 5 + seed as usize) % 6]).to_vec();
        if seed % 2 == 1 {
            order.extend([Face::Bottom, Face::Left]);
        }
        for face in &order {
            let force = placed.leaning(*face);
            assert_eq!(placed.hold(&force), Ok(*face));
        }
        let (correction, quality) = placed.calibration.solve().unwrap();
        biases.0.push((correction.bias - placed.bias).amax());
        scales.0.push((correction.scale.component_mul(&placed.gain) - Vec3::repeat(1.0)).amax());
        let force = placed.random.direction() * GRAVITY;
        lengths.0.push((correction.correct(placed.measured(&force)) - force).norm());
        assert_eq!(quality.redundancy as usize, order.len() - 6);
        assert!(quality.residual < 5e-3 && quality.residual_before > 10.0 * quality.residual, "{quality:?}");
        assert!(quality.noise < 2e-3, "{quality:?}");
    }
    assert!(biases.report("six positions: bias", "m/s²").1 < 5e-3);
    assert!(scales.report("six positions: scale", "").1 < 5e-4);
    assert!(lengths.report("six positions: any corrected force", "m/s²").1 < 1e-2);
}

#[test]
fn a_hold_that_cannot_be_right_is_refused_and_the_others_stay() {
    let mut placed = Placed::new(3);
    assert_eq!(placed.calibration.solve().unwrap_err(), SixPositionFailure::Missing(Face::Front));
    for face in Face::ALL.into_iter().filter(|face| *face != Face::Top) {
        let force = placed.leaning(face);
        assert_eq!(placed.hold(&force), Ok(face));
    }
    let oblique = Vec3::new(-0.7, 0.0, -0.714) * GRAVITY;
    assert_eq!(placed.hold(&oblique), Err(SixPositionRefusal::NotAFace));
    let in_a_lift = Vec3::new(0.0, 0.0, -GRAVITY - 0.8);
    assert_eq!(placed.hold(&in_a_lift), Err(SixPositionRefusal::Contradiction(Face::Bottom)));
    assert_eq!(placed.calibration.solve().unwrap_err(), SixPositionFailure::Missing(Face::Top));
    for _ in 0..2 {
        assert_eq!(placed.hold(&Vec3::new(0.0, 0.0, GRAVITY)), Ok(Face::Top));
    }
    assert_eq!(placed.hold(&Vec3::new(0.0, 0.0, GRAVITY)), Err(SixPositionRefusal::FaceFull(Face::Top)));
    let (correction, _) = placed.calibration.solve().unwrap();
    assert!((correction.bias - placed.bias).amax() < 5e-3, "{correction:?}");
}

#[test]
fn a_crooked_sensor_is_straightened() {
    let (mut trims, mut levels) = (Errors::default(), Errors::default());
    for seed in 0..CASES {
        let random = &mut Random::new(seed);
        let (roll, pitch) = (random.within(0.06), random.within(0.06));
        let mount = Quat::from_euler_angles(roll, pitch, 0.0);
        let felt = mount.inverse() * Vec3::new(0.0, 0.0, -GRAVITY);
        let mut level = LevelTrim::default();
        let found = (0..2_000).find_map(|step| {
            level.step(Instant::from_micros(2_500 * step), &still(random, &Vec3::zeros(), &felt, 25.0)).unwrap()
        });
        let (trim, quality) = found.unwrap();
        trims.0.push((trim.roll - roll).abs().max((trim.pitch - pitch).abs()));
        // Any vector of the airframe is recovered, except for heading.
        let vector = random.direction();
        levels.0.push(trim.correct(mount.inverse() * vector).cross(&vector).norm());
        assert!(quality.noise < 1e-4 && quality.force_error.abs() < 0.01, "{quality:?}");
    }
    assert!(trims.report("level trim: roll and pitch", "rad").1 < 5.0 * ACCEL_NOISE / GRAVITY / 31.6);
    assert!(levels.report("level trim: any corrected direction", "rad").1 < 1e-3);
}
