//! The calibrations find what was put in, and survive what no sensor sends.
//!
//! `cargo test -p stampfly-eskf --test calibration -- --nocapture` prints how near they come, over seeded vehicles.

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use stampfly_eskf::calibration::{
    EllipsoidFailure, EllipsoidFit, Face, LevelTrim, MagRefusal, Reach, SixPosition, SixPositionFailure,
    SixPositionRefusal, StillCalibration, TemperatureRefusal, TemperatureTable,
};
use stampfly_types::messages::{BaroData, ImuData, MagData};
use stampfly_types::{GRAVITY, Micros, Quat, Vec3, math};

/// Noise of one sample, that of the recorded StampFlys and more: rad/s, m/s², µT.
const GYRO_NOISE: f32 = 0.002;
const ACCEL_NOISE: f32 = 0.02;
const MAG_NOISE: f32 = 0.5;
/// Vehicles.
const CASES: u64 = 100;

struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    fn within(&mut self, limit: f32) -> f32 {
        self.0.random_range(-limit..limit)
    }

    fn vector(&mut self, limit: f32) -> Vec3 {
        Vec3::from_fn(|_, _| self.within(limit))
    }

    fn noise(&mut self, sigma: f32) -> Vec3 {
        Vec3::from_fn(|_, _| StandardNormal.sample(&mut self.0)) * sigma
    }

    /// Any direction, each as likely as another.
    fn direction(&mut self) -> Vec3 {
        self.noise(1.0).normalize()
    }
}

/// Errors of many vehicles.
#[derive(Default)]
struct Errors(Vec<f32>);

impl Errors {
    /// Median and largest, printed.
    fn report(mut self, what: &str, unit: &str) -> (f32, f32) {
        self.0.sort_by(f32::total_cmp);
        let (median, worst) = (self.0[self.0.len() / 2], self.0[self.0.len() - 1]);
        println!("{what:44} median {median:.2e}, worst {worst:.2e} {unit} of {}", self.0.len());
        (median, worst)
    }
}

/// Level, with noise.
fn still(random: &mut Random, gyro: &Vec3, accel: &Vec3, temperature: f32) -> ImuData {
    ImuData { gyro: gyro + random.noise(GYRO_NOISE), accel: accel + random.noise(ACCEL_NOISE), temperature }
}

#[test]
fn the_gyro_bias_of_a_still_vehicle_is_found() {
    let mut errors = Errors::default();
    for seed in 0..CASES {
        let random = &mut Random::new(seed);
        let (gyro, accel) = (random.vector(0.03), Vec3::new(0.0, 0.0, -GRAVITY) + random.vector(0.3));
        let mut calibration = StillCalibration::default();
        for step in 0..1_500 {
            calibration.step(Micros(2_500 * step), &still(random, &gyro, &accel, 25.0)).unwrap();
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

/// A vehicle that is put on its faces.
struct Placed {
    calibration: SixPosition,
    random: Random,
    bias: Vec3,
    gain: Vec3,
    now: Micros,
}

impl Placed {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let (bias, gain) = (random.vector(1.0), Vec3::repeat(1.0) + random.vector(0.04));
        Self { calibration: SixPosition::default(), random, bias, gain, now: Micros::ZERO }
    }

    fn measured(&self, force: &Vec3) -> Vec3 {
        force.component_mul(&self.gain) + self.bias
    }

    /// Turns the vehicle, then leaves it alone with this true specific force.
    fn hold(&mut self, force: &Vec3) -> Result<Face, SixPositionRefusal> {
        let measured = self.measured(force);
        for step in 0..1_200 {
            self.now += Micros(2_500);
            let turn = if step < 80 { Vec3::repeat(2.0) } else { Vec3::zeros() };
            match self.calibration.step(self.now, &still(&mut self.random, &turn, &measured, 25.0)) {
                Ok(Some(face)) => return Ok(face),
                Err(refusal) if !matches!(refusal, SixPositionRefusal::Moving(_)) => return Err(refusal),
                _ => {}
            }
        }
        panic!("neither taken nor refused");
    }

    /// The specific force on a face, leaning by up to 12° an axis.
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
        // In an order of its own; half of the vehicles are put on two faces twice.
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

/// A magnetometer with its iron: field → shape · field + offset.
fn magnetometer(random: &mut Random, offset: f32) -> (nalgebra::Matrix3<f32>, Vec3) {
    let mut shape = nalgebra::Matrix3::identity();
    for (row, column) in [(0, 1), (0, 2), (1, 2)] {
        let skew = random.within(0.06);
        (shape[(row, column)], shape[(column, row)]) = (skew, skew);
    }
    for axis in 0..3 {
        shape[(axis, axis)] = 1.0 + random.within(0.15);
    }
    (shape, random.vector(offset))
}

#[test]
fn hard_and_soft_iron_are_found_from_all_directions() {
    let (mut offsets, mut angles, mut residuals) = (Errors::default(), Errors::default(), Errors::default());
    for seed in 0..CASES {
        let random = &mut Random::new(seed);
        let strength = 45.0 + random.within(18.0);
        let (shape, offset) = magnetometer(random, 500.0);
        let mut fit = EllipsoidFit::default();
        for _ in 0..1_000 {
            let _ = fit.add(&(shape * random.direction() * strength + offset + random.noise(MAG_NOISE)));
        }
        let (correction, quality) = fit.solve().unwrap();
        offsets.0.push((correction.offset - offset).norm());
        let direction = random.direction();
        let corrected = correction.correct(shape * direction * strength + offset);
        angles.0.push(corrected.angle(&direction).to_degrees());
        residuals.0.push(quality.residual);
        assert!(quality.coverage == 1.0 && quality.samples > 900, "{quality:?}");
        assert!((correction.matrix - correction.matrix.transpose()).amax() < 1e-5);
        assert!((correction.matrix.determinant() - 1.0).abs() < 1e-4);
    }
    assert!(offsets.report("ellipsoid: offset, up to 500 each axis", "µT").1 < 0.3);
    assert!(angles.report("ellipsoid: any corrected direction", "°").1 < 0.5);
    let (median, worst) = residuals.report("ellipsoid: residual", "µT");
    assert!((0.8..1.2).contains(&(median / MAG_NOISE)) && worst < 2.0 * MAG_NOISE, "it measures the noise");
}

#[test]
fn a_vehicle_that_is_not_turned_every_way_gets_no_ellipsoid() {
    type Path = fn(f32) -> Vec3;
    let around = |angle: f32, up: f32| Vec3::new(math::cos(angle), math::sin(angle), up).normalize();
    let paths: [(&str, Path); 3] = [
        ("level", |angle| Vec3::new(math::cos(angle), math::sin(angle), 0.0)),
        ("a line", |angle| Vec3::new(math::cos(angle), 0.0, 0.0)),
        ("one spot", |_| Vec3::x()),
    ];
    for seed in 0..CASES {
        let random = &mut Random::new(seed);
        let mut refused = |name: &str, path: &dyn Fn(f32) -> Vec3| {
            let mut fit = EllipsoidFit::default();
            for step in 0..2_000u16 {
                let _ = fit.add(&(path(f32::from(step) * 0.05) * 48.0 + random.noise(MAG_NOISE)));
            }
            let result = fit.solve();
            assert!(result.is_err(), "{name}, seed {seed}: {result:?}");
        };
        for (name, path) in paths {
            refused(name, &path);
        }
        refused("a cone", &|angle| around(angle, 0.6));
        refused("a cap", &|angle| around(angle, 1.2 + 0.5 * math::sin(3.1 * angle)));
        refused("a hemisphere", &|angle| around(angle, 1.0 + 1.0 * math::sin(3.1 * angle)));
    }
}

#[test]
fn what_is_accepted_of_a_part_of_the_sphere_is_good() {
    let mut offsets = Errors::default();
    for seed in 0..5 * CASES {
        let random = &mut Random::new(seed);
        let (shape, offset) = magnetometer(random, 100.0);
        let (pole, lowest) = (random.direction(), random.within(1.0));
        let mut fit = EllipsoidFit::default();
        for _ in 0..2_000 {
            let direction = random.direction();
            if direction.dot(&pole) > lowest {
                let _ = fit.add(&(shape * direction * 45.0 + offset + random.noise(MAG_NOISE)));
            }
        }
        if let Ok((correction, _)) = fit.solve() {
            offsets.0.push((correction.offset - offset).norm());
        }
    }
    assert!(offsets.0.len() > CASES as usize);
    assert!(offsets.report("ellipsoid: offset, part of the sphere", "µT").1 < 2.0);
}

#[test]
fn a_strange_field_is_named() {
    let fit = |strength: f32, drift: f32| {
        let random = &mut Random::new(1);
        let mut fit = EllipsoidFit::default();
        for step in 0..600u16 {
            // The strength changes, as it does when a steel door is near.
            let strength = strength * (1.0 + drift * math::sin(f32::from(step) * 0.02));
            let _ = fit.add(&(random.direction() * strength));
        }
        fit.solve().map(|(_, quality)| quality)
    };
    assert!(fit(48.0, 0.0).is_ok());
    assert!(matches!(fit(8.0, 0.0), Err(EllipsoidFailure::Strength { strength }) if (strength - 8.0).abs() < 0.1));
    assert!(matches!(fit(48.0, 0.3), Err(EllipsoidFailure::Residual { residual }) if residual > 0.1));
    let mut one = EllipsoidFit::default();
    assert_eq!(one.add(&Vec3::repeat(f32::NAN)), Err(MagRefusal::NotFinite));
    assert_eq!(one.add(&Vec3::repeat(1e20)), Ok(()), "the first sample may be a spike");
    assert_eq!(one.add(&Vec3::x()), Err(MagRefusal::TooFar));
    assert_eq!(one.add(&Vec3::x()), Ok(()), "then the next one begins");
    assert_eq!(one.add(&Vec3::x()), Err(MagRefusal::TooNear));
    assert_eq!(one.solve().unwrap_err(), EllipsoidFailure::TooFew { samples: 1 });
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
        let found = (0..2_000)
            .find_map(|step| level.step(Micros(2_500 * step), &still(random, &Vec3::zeros(), &felt, 25.0)).unwrap());
        let (trim, quality) = found.unwrap();
        trims.0.push((trim.roll - roll).abs().max((trim.pitch - pitch).abs()));
        // Any vector of the airframe comes out as it was, heading aside.
        let vector = random.direction();
        levels.0.push(trim.correct(mount.inverse() * vector).cross(&vector).norm());
        assert!(quality.noise < 1e-4 && quality.force_error.abs() < 0.01, "{quality:?}");
    }
    assert!(trims.report("level trim: roll and pitch", "rad").1 < 5.0 * ACCEL_NOISE / GRAVITY / 31.6);
    assert!(levels.report("level trim: any corrected direction", "rad").1 < 1e-3);
}

/// A bias that bends with temperature.
fn bias(curve: &[Vec3; 3], temperature: f32) -> Vec3 {
    let [constant, slope, bend] = curve;
    let off = (temperature - 30.0) / 20.0;
    constant + slope * off + bend * (off * off)
}

#[test]
fn a_bias_that_moves_with_temperature_is_tabulated() {
    let (mut inside, mut accels, mut beside) = (Errors::default(), Errors::default(), Errors::default());
    for seed in 0..20 {
        let random = &mut Random::new(seed);
        let gyro = [random.vector(0.01), random.vector(0.006), random.vector(0.002)];
        let accel = [Vec3::zeros(), random.vector(0.1), random.vector(0.03)];
        let mut table = TemperatureTable::default();
        let attitudes = [Vec3::new(0.0, 0.0, -GRAVITY), Vec3::new(0.5, -0.3, -9.78)];
        let mut now = Micros::ZERO;
        for (attitude, from) in attitudes.iter().zip([15.0, 30.0]) {
            table.begin();
            for step in 0..48_000u16 {
                now += Micros(2_500);
                let temperature = from + f32::from(step) / 48_000.0 * 25.0;
                let felt = attitude + bias(&accel, temperature);
                table.step(now, &still(random, &bias(&gyro, temperature), &felt, temperature)).unwrap();
            }
        }
        let quality = table.quality().unwrap();
        assert!(quality.filled == 8 && (quality.span[1] - quality.span[0] - 40.0).abs() < 2.0, "{quality:?}");
        assert!(quality.gyro_scatter < 2e-3 && quality.samples > 90_000, "{quality:?}");
        let zero = bias(&accel, quality.span[0]);
        for temperature in 17..=53u8 {
            let temperature = f32::from(temperature);
            let found = table.bias(temperature).unwrap();
            assert!(found.reach == Reach::Inside && found.samples >= 400, "{found:?}");
            inside.0.push((found.gyro - bias(&gyro, temperature)).amax());
            accels.0.push((found.accel - bias(&accel, temperature) + zero).amax());
        }
        for temperature in [11.0, 59.0] {
            let found = table.bias(temperature).unwrap();
            assert_eq!(found.reach, Reach::Beside);
            beside.0.push((found.gyro - bias(&gyro, temperature)).amax());
        }
        for (far, edge) in [(-40.0, quality.span[0] - 5.0), (1e30, quality.span[1] + 5.0)] {
            let (far, edge) = (table.bias(far).unwrap(), table.bias(edge).unwrap());
            assert_eq!((far.reach, far.gyro, far.accel), (Reach::Clamped, edge.gyro, edge.accel));
        }
    }
    assert!(inside.report("temperature: gyro, inside", "rad/s").1 < 5e-4);
    assert!(accels.report("temperature: accelerometer, inside", "m/s²").1 < 1e-2);
    assert!(beside.report("temperature: gyro, one bin outside", "rad/s").1 < 2e-3);
}

#[test]
fn a_table_refuses_what_it_cannot_place() {
    let mut table = TemperatureTable::default();
    let mut now = Micros::ZERO;
    let mut lie = |table: &mut TemperatureTable, temperature: f32| {
        (0..900).find_map(|_| {
            now += Micros(2_500);
            let imu = ImuData { accel: Vec3::new(0.0, 0.0, -9.8), temperature, ..Default::default() };
            table.step(now, &imu).map_or_else(|refusal| Some(Err(refusal)), |taken| taken.then_some(Ok(())))
        })
    };
    assert_eq!(table.bias(20.0), None);
    assert_eq!(table.quality(), None);
    assert_eq!(lie(&mut table, f32::NAN), Some(Err(TemperatureRefusal::NoTemperature)));
    assert_eq!(lie(&mut table, 120.0), Some(Err(TemperatureRefusal::OutOfRange { temperature: 120.0 })));
    assert_eq!(lie(&mut table, 20.0), Some(Ok(())));
    table.begin();
    assert_eq!(lie(&mut table, 40.0), Some(Err(TemperatureRefusal::Moved)));
    assert_eq!(lie(&mut table, 22.0), Some(Ok(())));
    assert_eq!(lie(&mut table, 40.0), Some(Ok(())), "now it lies as it lay at 22 °C");
    assert_eq!(table.bias(f32::NAN), None);
}

/// Numbers a broken sensor sends, mixed with those of a working one.
fn number(usual: f32) -> impl Strategy<Value = f32> {
    prop_oneof![8 => -usual..usual, 1 => any::<f32>(), 1 => Just(0.0f32), 1 => Just(1e19f32), 1 => Just(f32::NAN)]
}

fn vector(usual: f32) -> impl Strategy<Value = Vec3> {
    [number(usual), number(usual), number(usual)].prop_map(Vec3::from)
}

fn finite(vectors: &[Vec3]) -> bool {
    vectors.iter().all(|vector| vector.iter().all(|v| v.is_finite()))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    /// Short stretches of anything, each number repeated so that some of it counts as still.
    #[test]
    fn nothing_that_is_not_finite_comes_out_of_an_inertial_calibration(
        samples in prop::collection::vec((vector(11.0), vector(0.1), number(90.0), 1usize..900, any::<u16>()), 1..12)
    ) {
        let (mut calibration, mut six) = (StillCalibration::default(), SixPosition::default());
        let (mut level, mut table) = (LevelTrim::default(), TemperatureTable::default());
        let mut now = Micros::ZERO;
        for (accel, gyro, temperature, repeats, jump) in samples {
            now += Micros(u64::from(jump));
            for _ in 0..repeats {
                now += Micros(2_500);
                let imu = ImuData { accel, gyro, temperature };
                let _ = (calibration.step(now, &imu), six.step(now, &imu), table.step(now, &imu));
                calibration.add_mag(&MagData { field: accel });
                calibration.add_baro(&BaroData { altitude: temperature, ..Default::default() });
                if let Ok(Some((trim, quality))) = level.step(now, &imu) {
                    prop_assert!(finite(&[trim.correct(Vec3::x())]) && quality.noise.is_finite());
                }
            }
            let result = calibration.result();
            prop_assert!(finite(&[result.gyro_bias, result.specific_force, result.field]));
            prop_assert!(result.baro_altitude.is_finite() && (0.0..=1.0).contains(&result.progress));
            if let Ok((correction, quality)) = six.solve() {
                prop_assert!(finite(&[correction.bias, correction.scale]) && quality.residual.is_finite());
            }
            for temperature in [temperature, -300.0, 12.0, 1e30] {
                if let Some(bias) = table.bias(temperature) {
                    prop_assert!(finite(&[bias.gyro, bias.accel]), "{bias:?}");
                }
            }
            prop_assert!(table.quality().is_none_or(|quality| quality.gyro_scatter.is_finite()));
        }
    }

    #[test]
    fn nothing_that_is_not_finite_comes_out_of_an_ellipsoid(
        fields in prop::collection::vec(vector(60.0), 100..400), sphere in any::<bool>()
    ) {
        let mut fit = EllipsoidFit::default();
        for field in fields {
            let _ = fit.add(&if sphere && field.norm() > 1.0 { field / field.norm() * 50.0 } else { field });
            if let Ok((correction, quality)) = fit.solve() {
                let columns = correction.matrix.column_iter().map(|column| column.into_owned()).collect::<Vec<_>>();
                prop_assert!(finite(&columns) && finite(&[correction.offset]));
                prop_assert!(quality.residual.is_finite() && (15.0..=90.0).contains(&correction.strength));
            }
        }
    }
}
