//! The magnetometer BMM150: the field, and the heading once the vehicle has been turned around.
//!
//! The vehicle carries iron and current of its own, and their field, which turns with it, is often larger than the
//! Earth's. The middle between the largest and the smallest value that each axis sees in a full turn is that field;
//! what is left points north. This is the simplest calibration there is, and for a level turn only: `stampfly-eskf`
//! has those that fly.

use super::Failure;
use super::show::{Spread, rate};
use core::f32::consts::TAU;
use core::fmt::Write;
use embedded_hal_async::i2c::I2c;
use stampfly_drivers::chip::bmm150::{Bmm150, Config};
use stampfly_drivers::chip::{Axis, AxisMap, ChipError};
use stampfly_drivers::{Magnetometer, Timebase};
use stampfly_types::{Duration, math};

/// How the chip is soldered on the StampFly: body = (−y, x, z) of the chip.
const AXES: AxisMap = AxisMap::new(Axis::MinusY, Axis::PlusX, Axis::PlusZ).expect("a rotation");
/// Time for a full turn.
const TURN: Duration = Duration::from_secs(6);
const SPAN: Duration = Duration::from_secs(10);
const LINE: Duration = Duration::from_millis(500);
/// The points of the compass, from north through east.
const POINTS: [&str; 8] = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];

/// What was found.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Samples per second, by their stamps.
    pub rate: f32,
    /// The last heading without the vehicle's own field, from magnetic north through east, rad.
    pub heading: f32,
    /// The vehicle's own field in the plane of the turn, µT, body FRD.
    pub own_field: [f32; 2],
    /// Horizontal strength of what is left, µT, on average after the turn.
    pub horizontal: f32,
}

/// Has the chip deflect its own sensors.
///
/// # Errors
/// Those of [`Bmm150::self_test`].
pub async fn self_test<I: I2c, T: Timebase>(
    i2c: I,
    clock: T,
    out: &mut impl Write,
) -> Result<(), Failure<ChipError<I::Error>>> {
    Bmm150::i2c(i2c, Bmm150::ALL_LOW, clock, AXES, Config::default()).self_test().await?;
    Ok(writeln!(out, "self test: passed")?)
}

/// Shows the sensor for ten seconds, the first six of which are for a turn.
///
/// # Errors
/// The driver's.
pub async fn run<I: I2c, T: Timebase>(
    i2c: I,
    clock: T,
    out: &mut impl Write,
) -> Result<Found, Failure<ChipError<I::Error>>> {
    let mut compass = Bmm150::i2c(i2c, Bmm150::ALL_LOW, clock, AXES, Config::default());
    compass.start().await?;
    writeln!(out, "BMM150 runs. Turn the level vehicle around once, within {:.0} s.", TURN.seconds())?;
    writeln!(out, "   time    forward      right       down")?;
    let first = compass.next().await?;
    let (mut last, mut next_line, mut count) = (first, first.at, 0.0);
    let (mut low, mut high, mut horizontal) = (first.data.field, first.data.field, Spread::default());
    let mut heading = 0.0;
    while last.at < first.at + SPAN {
        let field = last.data.field;
        let own = (low + high) * 0.5;
        let turned = last.at >= first.at + TURN;
        if turned {
            let earth = field - own;
            // A nose that points east has the north at its left.
            heading = math::atan2(-earth.y, earth.x);
            horizontal.add(math::sqrt(earth.x * earth.x + earth.y * earth.y));
        } else {
            (low, high) = (low.inf(&field), high.sup(&field));
        }
        if last.at >= next_line {
            let [x, y, z]: [f32; 3] = field.into();
            write!(out, "{:5.2} s {x:7.1} µT {y:7.1} µT {z:7.1} µT", last.at.since(first.at).seconds())?;
            if turned {
                let degrees = heading.to_degrees();
                write!(out, "   {:4.0}° {}", if degrees < 0.0 { degrees + 360.0 } else { degrees }, point(heading))?;
            }
            writeln!(out)?;
            next_line += LINE;
        }
        last = compass.next().await?;
        count += 1.0;
    }
    let own = (low + high) * 0.5;
    let rate = rate(count, last.at.since(first.at));
    writeln!(
        out,
        "{rate:.1} samples/s; the vehicle's own field is ({:.0}, {:.0}) µT; the Earth's, level, {:.0} ± {:.0} µT",
        own.x,
        own.y,
        horizontal.mean(),
        horizontal.deviation()
    )?;
    Ok(Found { rate, heading, own_field: [own.x, own.y], horizontal: horizontal.mean() })
}

/// The point of the compass nearest to a heading.
fn point(heading: f32) -> &'static str {
    let eighth = math::round(heading / TAU * POINTS.len() as f32) as i32;
    let index = eighth.rem_euclid(POINTS.len() as i32) as usize;
    POINTS.get(index).copied().unwrap_or("?")
}
