//! The barometer BMP280: pressure, and the height since the start.
//!
//! A storey is 35 Pa; the chip's noise is a few centimetres, its drift by warming up a few decimetres a minute.

use super::Failure;
use super::show::{Bar, Spread, rate};
use core::fmt::Write;
use embedded_hal_async::i2c::I2c;
use stampfly_drivers::chip::ChipError;
use stampfly_drivers::chip::bmp280::{Bmp280, Config};
use stampfly_drivers::{Barometer, Timebase};
use stampfly_types::Duration;

/// What is averaged to be the height zero.
const ZERO: Duration = Duration::from_secs(1);
const SPAN: Duration = Duration::from_secs(6);
const LINE: Duration = Duration::from_millis(400);

/// What was found.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Samples per second, by their stamps.
    pub rate: f32,
    /// Standard deviation of the height in the first second, m.
    pub noise: f32,
    /// Height above the start, m: the mean of the last line.
    pub height: f32,
    /// Air pressure at the end, Pa.
    pub pressure: f32,
}

/// Has the driver look whether the chip measures at all.
///
/// # Errors
/// Those of [`Bmp280::self_test`].
pub async fn self_test<I: I2c, T: Timebase>(
    i2c: I,
    clock: T,
    out: &mut impl Write,
) -> Result<(), Failure<ChipError<I::Error>>> {
    Bmp280::i2c(i2c, Bmp280::SDO_LOW, clock, Config::default()).self_test().await?;
    Ok(writeln!(out, "self test: passed")?)
}

/// Shows the sensor for six seconds, the first of which makes the zero.
///
/// # Errors
/// The driver's.
pub async fn run<I: I2c, T: Timebase>(
    i2c: I,
    clock: T,
    out: &mut impl Write,
) -> Result<Found, Failure<ChipError<I::Error>>> {
    let mut baro = Bmp280::i2c(i2c, Bmp280::SDO_LOW, clock, Config::default());
    baro.start().await?;
    writeln!(out, "BMP280 runs. Leave it for a second, then lift it.")?;
    writeln!(out, "   time     pressure   temperature   height")?;
    let first = baro.next().await?;
    let (mut last, mut count) = (first, 0.0);
    let (mut zero, mut line, mut next_line) = (Spread::default(), Spread::default(), first.at + LINE);
    let mut height = 0.0;
    while last.at < first.at + SPAN {
        if last.at < first.at + ZERO {
            zero.add(last.data.altitude);
        }
        line.add(last.data.altitude);
        if last.at >= next_line {
            height = line.mean() - zero.mean();
            let (time, data) = (last.at.since(first.at).seconds(), last.data);
            let bar = Bar { value: height, full: 4.0 };
            writeln!(out, "{time:5.2} s {:9.0} Pa {:10.1} °C {height:7.2} m {bar}", data.pressure, data.temperature)?;
            (line, next_line) = (Spread::default(), next_line + LINE);
        }
        last = baro.next().await?;
        count += 1.0;
    }
    let (rate, noise) = (rate(count, last.at.since(first.at)), zero.deviation());
    writeln!(out, "{rate:.1} samples/s; noise of the height {noise:.2} m at the start")?;
    Ok(Found { rate, noise, height, pressure: last.data.pressure })
}
