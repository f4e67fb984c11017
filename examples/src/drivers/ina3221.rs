//! The battery monitor INA3221: voltage, current and power, and how much charge has gone.

use super::Failure;
use super::show::{Bar, rate};
use core::fmt::Write;
use embedded_hal_async::i2c::I2c;
use stampfly_drivers::chip::ChipError;
use stampfly_drivers::chip::ina3221::{Config, Ina3221};
use stampfly_drivers::{PowerMonitor, Timebase};
use stampfly_types::Duration;

const SPAN: Duration = Duration::from_secs(5);
const LINE: Duration = Duration::from_millis(300);
/// Milliampere hours in an ampere second.
const MAH: f32 = 1_000.0 / 3_600.0;

/// What was found.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Samples per second, by their stamps.
    pub rate: f32,
    /// The least and the most voltage, V.
    pub voltage: [f32; 2],
    /// The least and the most current, A.
    pub current: [f32; 2],
    /// Charge that has left the battery, A s.
    pub charge: f32,
}

/// Has the driver look whether the chip measures at all, and whether there is a battery.
///
/// # Errors
/// Those of [`Ina3221::self_test`].
pub async fn self_test<I: I2c, T: Timebase>(
    i2c: I,
    clock: T,
    out: &mut impl Write,
) -> Result<(), Failure<ChipError<I::Error>>> {
    Ina3221::new(i2c, Ina3221::A0_GROUND, clock, Config::default()).self_test().await?;
    Ok(writeln!(out, "self test: passed")?)
}

/// Shows the battery for five seconds.
///
/// # Errors
/// The driver's.
pub async fn run<I: I2c, T: Timebase>(
    i2c: I,
    clock: T,
    out: &mut impl Write,
) -> Result<Found, Failure<ChipError<I::Error>>> {
    let mut monitor = Ina3221::new(i2c, Ina3221::A0_GROUND, clock, Config::default());
    monitor.start().await?;
    writeln!(out, "INA3221 runs. Switch something on.")?;
    writeln!(out, "   time   voltage   current     power")?;
    let first = monitor.next().await?;
    let (mut last, mut next_line, mut count) = (first, first.at, 0.0);
    let (mut voltage, mut current) = ([first.data.voltage; 2], [first.data.current; 2]);
    let mut charge = 0.0;
    while last.at < first.at + SPAN {
        let data = last.data;
        if last.at >= next_line {
            let (time, bar) = (last.at.since(first.at).seconds(), Bar { value: data.current, full: 6.0 });
            writeln!(out, "{time:5.2} s {:6.2} V {:7.2} A {:7.2} W {bar}", data.voltage, data.current, data.power)?;
            next_line += LINE;
        }
        let sample = monitor.next().await?;
        // A sample is the mean over its time, so nothing is missed in between.
        charge += sample.data.current * sample.at.since(last.at).seconds();
        voltage = widened(voltage, sample.data.voltage);
        current = widened(current, sample.data.current);
        (last, count) = (sample, count + 1.0);
    }
    let rate = rate(count, last.at.since(first.at));
    writeln!(
        out,
        "{rate:.1} samples/s; {:.2} to {:.2} V, {:.2} to {:.2} A, {:.2} mAh in all",
        voltage[0],
        voltage[1],
        current[0],
        current[1],
        charge * MAH
    )?;
    Ok(Found { rate, voltage, current, charge })
}

/// The range with one more value in it.
fn widened([low, high]: [f32; 2], value: f32) -> [f32; 2] {
    [low.min(value), high.max(value)]
}
