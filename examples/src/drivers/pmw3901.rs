//! The optical flow sensor PMW3901: how fast the floor moves, and how much of it the chip recognises.
//!
//! The chip counts angles: the floor's speed is the turn rate it shows times the distance to the floor, and rotation
//! of the vehicle is in it, too. It wants 8 cm of distance and light.

/// How the chip is soldered on the StampFly: body = (−y, x) of the chip.
const AXES: AxisMap = AxisMap::new(Axis::MinusY, Axis::PlusX, Axis::PlusZ).expect("a rotation");
use super::Failure;
use super::show::{Bar, Spread, rate};
use core::fmt::Write;
use embedded_hal_async::spi::SpiDevice;
use stampfly_drivers::chip::pmw3901::{Config, Pmw3901};
use stampfly_drivers::chip::{Axis, AxisMap, ChipError};
use stampfly_drivers::{OpticalFlow, Timebase};
use stampfly_types::Duration;

const SPAN: Duration = Duration::from_secs(5);
const LINE: Duration = Duration::from_millis(250);

/// What was found.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Samples per second, by their stamps.
    pub rate: f32,
    /// Angle swept forward and to the right in all samples that the driver vouches for, rad.
    pub swept: [f32; 2],
    /// Share of the samples that the driver vouches for.
    pub good: f32,
}

/// Has the driver look whether the chip takes pictures at all, in whatever light.
///
/// # Errors
/// Those of [`Pmw3901::self_test`].
pub async fn self_test<S: SpiDevice, T: Timebase>(
    spi: S,
    clock: T,
    out: &mut impl Write,
) -> Result<(), Failure<ChipError<S::Error>>> {
    Pmw3901::new(spi, clock, AXES, Config::default()).self_test().await?;
    Ok(writeln!(out, "self test: passed")?)
}

/// Shows the sensor for five seconds.
///
/// # Errors
/// The driver's.
pub async fn run<S: SpiDevice, T: Timebase>(
    spi: S,
    clock: T,
    out: &mut impl Write,
) -> Result<Found, Failure<ChipError<S::Error>>> {
    let config = Config::default();
    let mut flow = Pmw3901::new(spi, clock, AXES, config);
    flow.start().await?;
    writeln!(out, "PMW3901 runs. Move it over a floor with a pattern.")?;
    writeln!(out, "   time   counts forward   right   rad/s forward   right   quality")?;
    let first = flow.next().await?;
    let (mut last, mut next_line) = (first, first.at + LINE);
    let (mut good, mut swept) = (Spread::default(), [0.0; 2]);
    let (mut line, mut line_time, mut quality) = ([0.0; 2], 0.0, Spread::default());
    while last.at < first.at + SPAN {
        last = flow.next().await?;
        let data = last.data;
        good.add(if data.valid { 1.0 } else { 0.0 });
        quality.add(f32::from(data.quality));
        if data.valid {
            for (sum, delta) in line.iter_mut().zip([data.delta_x, data.delta_y]) {
                *sum += delta;
            }
            line_time += data.interval;
        }
        if last.at >= next_line {
            let [forward, right] = line;
            let counts = line.map(|angle| angle / config.radians_per_count);
            // Without a single good sample the speed is unknown, which shows as NaN.
            let speed = [forward / line_time, right / line_time];
            let bar = Bar { value: quality.mean(), full: 255.0 };
            let time = last.at.since(first.at).seconds();
            writeln!(
                out,
                "{time:5.2} s {:14.0} {:7.0} {:15.2} {:7.2} {:9.0} {bar}",
                counts[0],
                counts[1],
                speed[0],
                speed[1],
                quality.mean()
            )?;
            swept = [swept[0] + forward, swept[1] + right];
            (line, line_time, quality, next_line) = ([0.0; 2], 0.0, Spread::default(), next_line + LINE);
        }
    }
    swept = [swept[0] + line[0], swept[1] + line[1]];
    let rate = rate(good.count(), last.at.since(first.at));
    let good = good.mean();
    let [forward, right] = swept;
    writeln!(
        out,
        "{rate:.1} samples/s, {:.0} % good; a metre above the floor that would be {forward:.2} m forward and \
         {right:.2} m to the right",
        good * 100.0
    )?;
    Ok(Found { rate, swept, good })
}
