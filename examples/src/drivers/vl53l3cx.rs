//! Two range finders VL53L3CX on one bus: one looks down, one looks ahead.
//!
//! Both start at the same address. The drivers agree through one [`BootAddress`] who may wake up, and move their chips
//! to addresses of their own; from then on nobody has to know of the other.

use super::Failure;
use super::show::{Bar, rate};
use core::fmt::Write;
use embassy_futures::join::join;
use embedded_hal::digital::OutputPin;
use embedded_hal_async::i2c::I2c;
use stampfly_drivers::chip::ChipError;
use stampfly_drivers::chip::vl53l3cx::{BootAddress, Config, Vl53l3cx};
use stampfly_drivers::{RangeFinder, Timebase};
use stampfly_types::Duration;
use stampfly_types::messages::TofData;

const SPAN: Duration = Duration::from_secs(5);
const LINE: Duration = Duration::from_millis(250);
/// Addresses beside the one they start at, which is 0x29.
const DOWN: u8 = 0x30;
const AHEAD: u8 = 0x31;

/// What was found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    /// Measurements per second of the one that looks down, by their stamps.
    pub rate: f32,
    /// The last distance of the one that looks down and of the one that looks ahead, m; `None` is nothing in sight.
    pub distance: [Option<f32>; 2],
    /// How often each saw something.
    pub seen: [u32; 2],
}

/// Has the drivers look whether the chips measure at all, one after the other. Buses and pins as for [`run`].
///
/// # Errors
/// Those of [`Vl53l3cx::self_test`], of either.
pub async fn self_test<I: I2c, X: OutputPin, T: Timebase + Clone>(
    [bus_down, bus_ahead]: [I; 2],
    [shutdown_down, shutdown_ahead]: [X; 2],
    clock: T,
    out: &mut impl Write,
) -> Result<(), Failure<ChipError<I::Error>>> {
    let boot = BootAddress::new();
    let mut down = Vl53l3cx::new(bus_down, shutdown_down, &boot, DOWN, clock.clone(), Config::default());
    let mut ahead = Vl53l3cx::new(bus_ahead, shutdown_ahead, &boot, AHEAD, clock, Config::default());
    down.self_test().await?;
    writeln!(out, "self test of the one that looks down: passed")?;
    ahead.self_test().await?;
    Ok(writeln!(out, "self test of the one that looks ahead: passed")?)
}

/// Shows both for five seconds. The buses are handles of the same one; the pins are wired to each chip's XSHUT.
///
/// # Errors
/// Either driver's.
pub async fn run<I: I2c, X: OutputPin, T: Timebase + Clone>(
    [bus_down, bus_ahead]: [I; 2],
    [shutdown_down, shutdown_ahead]: [X; 2],
    clock: T,
    out: &mut impl Write,
) -> Result<Found, Failure<ChipError<I::Error>>> {
    let boot = BootAddress::new();
    // Creating a driver puts its chip into reset: both, before either is used.
    let mut down = Vl53l3cx::new(bus_down, shutdown_down, &boot, DOWN, clock.clone(), Config::default());
    let mut ahead = Vl53l3cx::new(bus_ahead, shutdown_ahead, &boot, AHEAD, clock, Config::default());
    down.start().await?;
    ahead.start().await?;
    writeln!(out, "Two VL53L3CX run, at {DOWN:#04x} and {AHEAD:#04x}. Hold a hand in front of them.")?;
    writeln!(out, "   time   down                                  ahead")?;
    // The first measurement after a start is not vouched for.
    let first = down.next().await?;
    let (mut last, mut next_line, mut count) = (first, first.at, 0.0);
    let mut found = Found::default();
    while last.at < first.at + SPAN {
        // Both at once, or each would miss measurements while the other is waited for.
        let (below, before) = join(down.next(), ahead.next()).await;
        last = below?;
        count += 1.0;
        let samples = [last.data, before?.data];
        found.distance = samples.map(|sample| sample.valid.then_some(sample.distance));
        for (seen, distance) in found.seen.iter_mut().zip(found.distance) {
            *seen += u32::from(distance.is_some());
        }
        if last.at >= next_line {
            write!(out, "{:5.2} s ", last.at.since(first.at).seconds())?;
            for sample in samples {
                show(sample, out)?;
            }
            writeln!(out)?;
            next_line += LINE;
        }
    }
    found.rate = rate(count, last.at.since(first.at));
    let [below, before] = found.seen;
    writeln!(out, "{:.1} measurements/s of each; {below} saw the floor, {before} something ahead", found.rate)?;
    Ok(found)
}

/// A distance with its noise and a bar, or why there is none, 38 characters wide.
fn show(sample: TofData, out: &mut impl Write) -> core::fmt::Result {
    if !sample.valid {
        return write!(out, "nothing (status {}){:19}", sample.status, "");
    }
    let TofData { distance, sigma, .. } = sample;
    write!(out, "{distance:5.3} m ± {:2.0} mm ", sigma * 1_000.0)?;
    let bar = Bar { value: distance, full: 2.0 };
    write!(out, "{bar:<23}")
}
