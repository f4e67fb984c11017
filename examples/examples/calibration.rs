//! A new vehicle on the bench: five calibrations on simulated sensors, and how good each one says it is.

use stampfly_eskf::calibration::{EllipsoidFit, LevelTrim, SixPosition, StillCalibration, TemperatureTable};
use stampfly_types::messages::ImuData;
use stampfly_types::{Duration, GRAVITY, Instant, Vec3, math};
use std::mem::size_of;

/// What is wrong with this vehicle. Nothing below the sensors knows it.
const GYRO_BIAS: Vec3 = Vec3::new(0.012, -0.006, 0.003);
const GYRO_DRIFT: Vec3 = Vec3::new(2e-4, -1e-4, 5e-5);
const ACCEL_BIAS: Vec3 = Vec3::new(0.12, -0.2, 0.25);
const ACCEL_GAIN: Vec3 = Vec3::new(1.01, 0.99, 1.02);
const MOUNT_ROLL: f32 = 0.02;
const HARD_IRON: Vec3 = Vec3::new(85.0, -40.0, 130.0);
const SOFT_IRON: Vec3 = Vec3::new(1.08, 0.95, 1.0);

/// The bench: a clock and sensors with noise.
struct Bench {
    now: Instant,
    random: u32,
}

impl Bench {
    /// Noise that is the same on every machine: a linear congruential generator, −1 to 1.
    fn noise(&mut self) -> Vec3 {
        Vec3::from_fn(|_| {
            self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (self.random >> 8) as f32 / 8_388_608.0 - 1.0
        })
    }

    /// The next sample of a vehicle that turns at this rate and feels this force.
    fn sample(&mut self, rate: Vec3, force: Vec3, temperature: f32) -> (Instant, ImuData) {
        self.now += Duration::from_micros(2_500);
        let gyro = rate + GYRO_BIAS + GYRO_DRIFT * (temperature - 25.0) + self.noise() * 0.004;
        let accel = force.component_mul(&ACCEL_GAIN) + ACCEL_BIAS + self.noise() * 0.03;
        (self.now, ImuData { accel, gyro, temperature, ..Default::default() })
    }
}

fn main() {
    let mut bench = Bench { now: Instant::ZERO, random: 1 };
    let (sin, cos) = math::sin_cos(MOUNT_ROLL);
    let level = Vec3::new(0.0, -sin, -cos) * GRAVITY;
    let still = Vec3::zeros();

    println!("Still, {} bytes: leave it alone for four seconds.", size_of::<StillCalibration>());
    let mut calibration = StillCalibration::default();
    while !calibration.result().complete {
        let touched = (Instant::from_millis(1_500)..Instant::from_millis(1_600)).contains(&bench.now);
        let (now, imu) = bench.sample(if touched { Vec3::x() } else { still }, level, 25.0);
        let before = calibration.result().restarts;
        if let Err(reason) = calibration.step(now, &imu)
            && calibration.result().restarts > before
        {
            println!("  {:.2} s: {reason:?}, begins again", now.seconds_f64());
        }
    }
    let quality = calibration.quality().expect("complete");
    let bias = calibration.result().gyro_bias;
    println!("  gyro bias {:.2?} mrad/s, off by {:.2}", (bias * 1e3).to_array(), (bias - GYRO_BIAS).amax() * 1e3);
    println!("  noise {:.1} mrad/s, |a| − g {:+.2} m/s²", quality.gyro_noise.amax() * 1e3, quality.force_error);

    println!("Six positions, {} bytes: put it on each face, on its feet twice.", size_of::<SixPosition>());
    let mut six = SixPosition::default();
    let faces = [-Vec3::z(), Vec3::x(), Vec3::new(-0.7, 0.0, -0.7), -Vec3::x(), Vec3::y(), -Vec3::y(), Vec3::z()];
    for up in faces.into_iter().chain([-Vec3::z()]) {
        // Nobody stands a vehicle on its nose exactly upright.
        let force = (up + bench.noise() * 0.05).normalize() * GRAVITY;
        for step in 0..1_200 {
            let (now, imu) = bench.sample(if step < 100 { Vec3::repeat(1.5) } else { still }, force, 25.0);
            match six.step(now, &imu) {
                Ok(Some(face)) => println!("  {face:?} is down, taken"),
                Err(refusal) if step > 300 => {
                    println!("  refused: {refusal:?}");
                    break;
                }
                _ => {}
            }
        }
    }
    let (accel, quality) = six.solve().expect("all faces");
    println!("  bias {:.3?} m/s², off by {:.4}", accel.bias.to_array(), (accel.bias - ACCEL_BIAS).amax());
    let scale = accel.scale.component_mul(&ACCEL_GAIN) - Vec3::repeat(1.0);
    println!("  scale {:.4?}, off by {:.5}", accel.scale.to_array(), scale.amax());
    println!(
        "  |a| − g {:.3} m/s² before, {:.4} after, {} hold to check it",
        quality.residual_before, quality.residual, quality.redundancy
    );

    println!("Level trim, {} bytes: stand it on a level floor.", size_of::<LevelTrim>());
    let mut trimming = LevelTrim::default();
    let (trim, quality) = loop {
        let (now, mut imu) = bench.sample(still, level, 25.0);
        imu.accel = accel.correct(imu.accel);
        if let Ok(Some(found)) = trimming.step(now, &imu) {
            break found;
        }
    };
    println!(
        "  roll {:.2}°, pitch {:.2}°, mounted at {:.2}° and 0°",
        trim.roll.to_degrees(),
        trim.pitch.to_degrees(),
        MOUNT_ROLL.to_degrees()
    );
    println!("  noise {:.4}°, |a| − g {:+.4} m/s²", quality.noise.to_degrees(), quality.force_error);

    println!("Ellipsoid, {} bytes: turn it all ways.", size_of::<EllipsoidFit>());
    let mut fit = EllipsoidFit::default();
    for step in 1..=1_500u16 {
        let (around, over) = (f32::from(step) * 0.13, f32::from(step) * 0.0043);
        let (up, across) = math::sin_cos(1.6 * math::sin(over));
        let field = Vec3::new(across * math::cos(around), across * math::sin(around), up) * 46.0;
        // Samples that say nothing new are refused.
        let _ = fit.add(&(field.component_mul(&SOFT_IRON) + HARD_IRON + bench.noise()));
        if step % 500 == 0 {
            match fit.solve() {
                Ok((_, quality)) => println!("  {step} samples: coverage {:.0} %", quality.coverage * 1e2),
                Err(failure) => println!("  {step} samples: not yet, {failure:?}"),
            }
        }
    }
    let (mag, quality) = fit.solve().expect("turned all ways");
    println!("  hard iron {:.1?} µT, off by {:.2}", mag.offset.to_array(), (mag.offset - HARD_IRON).amax());
    println!(
        "  field {:.1} µT, stretched {:.2} : 1, residual {:.2} µT, coverage {:.0} %, {} samples taken",
        mag.strength,
        quality.stretch,
        quality.residual,
        quality.coverage * 1e2,
        quality.samples
    );

    println!("Temperature, {} bytes: let it warm up.", size_of::<TemperatureTable>());
    let mut table = TemperatureTable::default();
    for step in 0..80_000u32 {
        let (now, imu) = bench.sample(still, level, 22.0 + step as f32 * 3e-4);
        if let Err(refusal) = table.step(now, &imu) {
            println!("  refused: {refusal:?}");
        }
    }
    let quality = table.quality().expect("filled");
    let [coldest, warmest] = quality.span;
    println!(
        "  {} bins from {coldest:.0} to {warmest:.0} °C, scatter {:.2} mrad/s",
        quality.filled,
        quality.gyro_scatter * 1e3
    );
    for temperature in [10.0, 20.0, 33.0, 60.0] {
        let bias = table.bias(temperature).expect("filled");
        let off = bias.gyro - GYRO_BIAS - GYRO_DRIFT * (temperature - 25.0);
        println!(
            "  {temperature:2.0} °C: off by {:.2} mrad/s, {:?}, {} samples",
            off.amax() * 1e3,
            bias.coverage,
            bias.samples
        );
    }
}
