//! An MPU-6000 that answers at once, and a clock that goes when it is told to.

use core::cell::Cell;
use core::convert::Infallible;
use core::future::poll_fn;
use core::task::Poll;
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};
use stampfly_drivers::Timebase;
use stampfly_types::Instant;

/// Time since power-on, µs.
#[derive(Clone, Copy)]
pub struct Clock<'c>(pub &'c Cell<u64>);

impl DelayNs for Clock<'_> {
    async fn delay_ns(&mut self, ns: u32) {
        let until = self.0.get() + u64::from(ns.div_ceil(1_000));
        poll_fn(|_| if self.0.get() >= until { Poll::Ready(()) } else { Poll::Pending }).await;
    }
}

impl Timebase for Clock<'_> {
    fn now(&self) -> Instant {
        Instant::from_micros(self.0.get())
    }
}

/// Registers, and what the two sensors measure: acceleration, temperature, rates, as the chip has them.
pub struct Chip<'c> {
    registers: [u8; 128],
    measured: &'c Cell<[i16; 7]>,
}

const DATA: usize = 0x3B;
const WHO_AM_I: usize = 0x75;

impl<'c> Chip<'c> {
    pub fn new(measured: &'c Cell<[i16; 7]>) -> Self {
        let mut registers = [0; 128];
        registers[WHO_AM_I] = 0x68;
        Self { registers, measured }
    }
}

impl ErrorType for Chip<'_> {
    type Error = Infallible;
}

impl SpiDevice for Chip<'_> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let mut place = None;
        for operation in operations {
            match operation {
                Operation::Write(bytes) => {
                    for byte in *bytes {
                        match &mut place {
                            None => place = Some(usize::from(*byte & 0x7F)),
                            Some(place) => {
                                // A reset is over before anybody asks.
                                let byte = if *byte == 0x80 { 0 } else { *byte };
                                self.registers[*place & 0x7F] = byte;
                                *place += 1;
                            }
                        }
                    }
                }
                Operation::Read(into) => {
                    let at = place.unwrap_or_default();
                    if at == DATA {
                        let measured = self.measured.get();
                        for (to, from) in into.iter_mut().zip(measured.iter().flat_map(|count| count.to_be_bytes())) {
                            *to = from;
                        }
                    } else {
                        into.iter_mut().zip(&self.registers[at..]).for_each(|(to, from)| *to = *from);
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }
}
