//! Histogram mode: each measurement is a histogram of photons over time, in which the processor
//! finds the pulse.
//!
//! The second ranging mode ([`Ranging::Histogram`](crate::Ranging)), for parts that yield no useful
//! results in the first. All public programs known to use a VL53L3CX work this way; none is known
//! that uses it like a VL53L1X, as described in [`codec`](crate::codec). A measurement takes 3.7 ms
//! on the bus instead of 0.6 ms, and the processor time of [`bins`](crate::bins). Not for several
//! targets: only the strongest one is evaluated.

use crate::bins::{BLOCK_BYTES, Histogram};
use crate::codec::Reading;
use crate::preset::{BLOCK, FACTORY_OFFSET, FAST_OSCILLATOR, ONCE, Session, TIMES, TIMES_BYTES};
use crate::{REPETITIONS, Vl53l3cx, Xshut, early};
use embedded_hal_async::i2c::I2c;
use stampfly_driver_core::Timebase;
use stampfly_driver_core::chip::ChipError;
use stampfly_types::Instant;

impl<I: I2c, X: Xshut, T: Timebase> Vl53l3cx<'_, I, X, T> {
    /// Sets up a chip that has just been woken. It measures on request.
    pub(crate) async fn start_histogram(&mut self) -> Result<(), ChipError<I::Error>> {
        let oscillator = u16::from_be_bytes(self.port.read_twice(FAST_OSCILLATOR).await?);
        let factory = i16::from_be_bytes(self.port.read_twice(FACTORY_OFFSET).await?);
        let budget = self.config.budget.as_micros() as u32;
        let session = Session::new(budget, oscillator, factory).ok_or(ChipError::Data)?;
        let times = session.times();
        for (register, values) in ONCE.into_iter().chain([(TIMES, &times[..])]) {
            self.port.write(register, values).await?;
        }
        // Read back, because a wrong bit here would only show as wrong distances.
        let kept: [u8; TIMES_BYTES] = self.port.read(TIMES).await?;
        if kept != times {
            return Err(ChipError::Configuration { status: kept[6] });
        }
        self.session = Some(session);
        self.stale = true;
        Ok(())
    }

    /// Sends the settings, which clears the interrupt and starts a measurement.
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

    /// A measurement, and the time at which it was ready. Continues a measurement that is in
    /// progress because an earlier call was dropped, or starts one.
    pub(crate) async fn histogram(&mut self) -> Result<(Instant, Reading), ChipError<I::Error>> {
        // One more than the repetitions, because the first histogram after a start is empty.
        for _ in 0..=REPETITIONS + 1 {
            // A measurement that was not read in time is too old.
            if self.stale || self.port.now() > self.due + self.config.period / 4 {
                // A chip that has lost its power no longer answers at this address.
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
