//! The inertial sensor BMI270: attitude, turn rate and shaking, four lines a second.
//!
//! The attitude comes from a [`Mahony`] filter over every one of the 400 samples a second, so it stays right when the
//! vehicle is moved; that it creeps by a degree or two is the gyroscope's bias, which is left in. Shaking is the standard
//! deviation of the acceleration's size within a line: at rest the chip's own noise, with motors or a knock on the table
//! much more.

/// How the chip is soldered on the StampFly, upside down: body = (y, x, −z) of the chip.
const AXES: AxisMap = AxisMap::new(Axis::PlusY, Axis::PlusX, Axis::MinusZ).expect("a rotation");
use super::Failure;
use super::show::{Bar, Spread, rate};
use core::fmt::Write;
use embedded_hal_async::spi::SpiDevice;
use stampfly_drivers::chip::bmi270::{Bmi270, Config};
use stampfly_drivers::chip::{Axis, AxisMap, ChipError};
use stampfly_drivers::{Imu, Timebase};
use stampfly_eskf::attitude::Mahony;
use stampfly_types::{Duration, frame};

const SPAN: Duration = Duration::from_secs(5);
const LINE: Duration = Duration::from_millis(250);
/// The filter's gain, 1/s.
const GAIN: f32 = 0.5;

/// What was found.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Samples per second, by their stamps.
    pub rate: f32,
    /// Roll, pitch and turn about the vertical since the start, rad, at the end.
    pub attitude: [f32; 3],
    /// Size of the specific force on average, m/s².
    pub force: f32,
    /// The least shaking of all lines, m/s².
    pub least_shaking: f32,
    /// The most, m/s².
    pub most_shaking: f32,
}

/// Has the chip deflect its accelerometer's masses and test its gyroscope's drive. The vehicle has to stand still.
///
/// Returns whether the gyroscope passed, which is said but no error: the test depends on Bosch's file.
///
/// # Errors
/// Those of [`Bmi270::self_test`], and the bus.
pub async fn self_test<S: SpiDevice, T: Timebase>(
    spi: S,
    clock: T,
    configuration_file: &[u8],
    out: &mut impl Write,
) -> Result<bool, Failure<ChipError<S::Error>>> {
    let mut imu = Bmi270::spi(spi, clock, configuration_file, AXES, Config::default());
    imu.self_test().await?;
    writeln!(out, "self test of the accelerometer: passed")?;
    let passed = match imu.gyro_self_test().await {
        Ok(()) => true,
        Err(ChipError::SelfTest) => false,
        Err(error) => return Err(error.into()),
    };
    writeln!(out, "self test of the gyroscope: {}", if passed { "passed" } else { "not passed" })?;
    Ok(passed)
}

/// Shows the sensor for five seconds. `configuration_file` is Bosch's, 8 kB.
///
/// # Errors
/// The driver's.
pub async fn run<S: SpiDevice, T: Timebase>(
    spi: S,
    clock: T,
    configuration_file: &[u8],
    out: &mut impl Write,
) -> Result<Found, Failure<ChipError<S::Error>>> {
    let mut imu = Bmi270::spi(spi, clock, configuration_file, AXES, Config::default());
    imu.start().await?;
    writeln!(out, "BMI270 runs. Tilt it, turn it, knock on it.")?;
    writeln!(out, "   time    roll   pitch    turn  turn rate  shaking")?;
    let first = imu.next().await?;
    let (mut filter, mut last) = (Mahony::new(GAIN), first);
    let (mut force, mut line) = (Spread::default(), Spread::default());
    let (mut least, mut most) = (f32::INFINITY, 0.0f32);
    let (mut attitude, mut next_line) = ([0.0; 3], first.at + LINE);
    while last.at < first.at + SPAN {
        let sample = imu.next().await?;
        filter.step(&sample.data.accel, &sample.data.gyro, sample.at.since(last.at).seconds());
        force.add(sample.data.accel.norm());
        line.add(sample.data.accel.norm());
        last = sample;
        if last.at >= next_line {
            attitude = frame::roll_pitch_yaw(&filter.attitude());
            let [roll, pitch, turn] = attitude.map(f32::to_degrees);
            let (time, shaking) = (last.at.since(first.at).seconds(), line.deviation());
            let speed = last.data.gyro.norm().to_degrees();
            let bar = Bar { value: shaking, full: 4.0 };
            writeln!(
                out,
                "{time:5.2} s {roll:6.1}° {pitch:6.1}° {turn:6.1}° {speed:6.0} °/s {shaking:5.2} m/s² {bar}"
            )?;
            (least, most) = (least.min(shaking), most.max(shaking));
            (line, next_line) = (Spread::default(), next_line + LINE);
        }
    }
    let rate = rate(force.count(), last.at.since(first.at));
    let temperature = last.data.temperature;
    writeln!(
        out,
        "{rate:.1} samples/s; {:.2} m/s² on average, noise {least:.3} m/s² at rest; {temperature:.0} °C",
        force.mean()
    )?;
    Ok(Found { rate, attitude, force: force.mean(), least_shaking: least, most_shaking: most })
}
