//! The chip as ST's own driver runs it: each measurement is a histogram of photons over time, whose pulse the processor finds.
//!
//! It is the second way to range ([`Ranging::Histogram`](crate::Ranging)), for a part that makes nonsense of the first. Every public program that is known to
//! range with a VL53L3CX does it this way; none is known that does it like a VL53L1X, which [`codec`](crate::codec) describes. It costs the bus 3.7 ms a
//! measurement instead of 0.6, and the processor what [`bins`](crate::bins) does. Not for several targets: the strongest one counts.

use crate::bins::{BLOCK_BYTES, Histogram};
use crate::codec::Reading;
use crate::preset::{BLOCK, FACTORY_OFFSET, FAST_OSCILLATOR, ONCE, Session, TIMES, TIMES_BYTES};
use crate::{REPETITIONS, Vl53l3cx, Xshut, early};
use embedded_hal_async::i2c::I2c;
use stampfly_driver_core::Timebase;
use stampfly_driver_core::chip::ChipError;
use stampfly_types::Instant;

impl<I: I2c, X: Xshut, T: Timebase> Vl53l3cx<'_, I, X, T> {
    /// Sets a chip up that has just been woken. It measures when it is asked to.
    pub(crate) async fn start_histogram(&mut self) -> Result<(), ChipError<I::Error>> {
        let oscillator = u16::from_be_bytes(self.port.read_twice(FAST_OSCILLATOR).await?);
        let factory = i16::from_be_bytes(self.port.read_twice(FACTORY_OFFSET).await?);
        let budget = self.config.budget.as_micros() as u32;
        let session = Session::new(budget, oscillator, factory).ok_or(ChipError::Data)?;
        let times = session.times();
        for (register, values) in ONCE.into_iter().chain([(TIMES, &times[..])]) {
            self.port.write(register, values).await?;
        }
        // A wrong bit in here would not be noticed as anything but wrong distances.
        let kept: [u8; TIMES_BYTES] = self.port.read(TIMES).await?;
        if kept != times {
            return Err(ChipError::Configuration { status: kept[6] });
        }
        self.session = Some(session);
        self.stale = true;
        Ok(())
    }

    /// Sends the settings, which takes the interrupt back and starts a measurement.
    async fn arm(&mut self) -> Result<(), ChipError<I::Error>> {
        let Some(session) = &mut self.session else { return Err(ChipError::NoSample) };
        for (register, values) in session.runs() {
            self.port.write(register, values).await?;
        }
        session.sent();
        self.stale = false;
        self.due = self.port.now() + early(self.config.budget);
        Ok(())
    }

    /// A measurement, and when it was there: one that runs already, because a call for it was dropped, or one of its own.
    pub(crate) async fn histogram(&mut self) -> Result<(Instant, Reading), ChipError<I::Error>> {
        // And one more, for the first after a start is of nothing.
        for _ in 0..=REPETITIONS + 1 {
            // One that nobody came for in time is too old.
            if self.stale || self.port.now() > self.due + self.config.period / 4 {
                // A chip that lost its power does not answer here any more.
                self.look().await?;
                self.arm().await?;
            }
            let seen = self.ready().await?;
            let block: [u8; BLOCK_BYTES] = self.read(BLOCK).await?;
            self.stale = true;
            let histogram = Histogram::decode(&block).ok_or(ChipError::Data)?;
            let Some(session) = &mut self.session else { break };
            if let Some(reading) = session.take(&histogram) {
                return Ok((seen, reading));
            }
        }
        self.ranging = false;
        Err(ChipError::NoSample)
    }
}
