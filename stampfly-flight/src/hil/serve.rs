//! The vehicle's end of a whole flight: from the greeting to the end.

use super::vehicle::{Flight, Greeting, Line, Over, greet};
use crate::{Assembled, FlightLoop};
use core::mem::MaybeUninit;
use stampfly_bus::Schedule;
use stampfly_param::Parameters;
use stampfly_types::{Duration, Instant};

/// A vehicle that has been waiting to be switched on for this long by its own clock stops waiting: a person has had time to
/// start the program at the other end.
pub const GREETING: Duration = Duration::from_secs(60);

/// A line of bytes, and the vehicle's own clock.
#[allow(async_fn_in_trait, reason = "the caller polls one future, on one core")]
pub trait Wire {
    /// Waits for bytes, a tenth of a second at most, and returns how many came.
    async fn receive(&mut self, buffer: &mut [u8]) -> usize;

    /// Sends bytes. What is not taken within a tenth of a second is lost, and is asked for again.
    async fn send(&mut self, bytes: &[u8]);

    /// The clock.
    fn now(&self) -> Instant;
}

/// What has become of a vehicle that was to fly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Served {
    /// It has flown.
    Over(Over),
    /// Nobody has switched it on within [`GREETING`].
    Nobody,
}

/// Greets, takes parameters into `config`, makes a vehicle in `place` on `bus` and lets it fly until it is
/// [over](Flight::over). Nothing may have been published on `bus`. To fly again, restart.
///
/// # Cancellation
/// Dropping the future ends the flight; the vehicle stands as after its last step.
pub async fn serve<'b, R: Schedule>(
    wire: &mut impl Wire,
    line: &mut Line<'_>,
    place: &'b mut MaybeUninit<FlightLoop<'b, R>>,
    bus: &'b mut R::Topics,
    config: &mut R::Config,
) -> Served
where
    R::Config: Parameters,
{
    let mut buffer = [0; 256];
    let begun = wire.now();
    let start = 'greeting: loop {
        let count = wire.receive(&mut buffer).await;
        let now = wire.now();
        for byte in buffer.iter().take(count) {
            let greeting = greet::<R>(line, *byte, now, config);
            if greeting != Greeting::Incomplete {
                wire.send(line.reply()).await;
            }
            if let Greeting::Starts(at) = greeting {
                break 'greeting at;
            }
        }
        if now.since(begun) > GREETING {
            return Served::Nobody;
        }
    };
    let mut flight = Flight::<R>::new(line, Assembled::in_place(place, bus, None, config, start), start);
    loop {
        let count = wire.receive(&mut buffer).await;
        for byte in buffer.iter().take(count) {
            if flight.feed(*byte, || wire.now()) {
                wire.send(flight.reply()).await;
            }
        }
        if let Some(over) = flight.over(wire.now()) {
            return Served::Over(over);
        }
    }
}
