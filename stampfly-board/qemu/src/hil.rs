//! The vehicle's end of hardware in the loop, on an emulated core and on this PC: `cargo xtask hil`.
//!
//! The code is the firmware's: [`serve`] from the greeting to the end of the flight. The line is the emulator's standard input
//! and output, by semihosting; the clock counts instructions, one a tick of 240 MHz, so a step's time is the same on every
//! host. For an RV32IMAFC core and for the PC it is compared with; the other machines have no way to read.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg_attr(target_arch = "riscv32", path = "line/riscv.rs")]
#[cfg_attr(not(target_os = "none"), path = "line/host.rs")]
mod line;
#[cfg_attr(target_arch = "riscv32", path = "machine/riscv.rs")]
#[cfg_attr(not(target_os = "none"), path = "machine/host.rs")]
#[allow(dead_code, reason = "what it says is frames")]
mod machine;

use core::cell::Cell;
use core::mem::MaybeUninit;
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use machine::Ticks;
use stampfly_board::VehicleConfig;
use stampfly_board::schedule::Runnables;
use stampfly_board::topics::Bus;
use stampfly_flight::hil::{LONGEST, LONGEST_FRAME, Line, Over, Served, Wire, serve};
use stampfly_types::Instant;

/// Clock of the ESP32-S3, ticks a microsecond.
const CLOCK: u64 = 240;

/// The line, and a clock that counts instructions.
struct Machine {
    since: Cell<Ticks>,
    instructions: Cell<u64>,
}

impl Wire for Machine {
    async fn receive(&mut self, buffer: &mut [u8]) -> usize {
        line::receive(buffer)
    }

    async fn send(&mut self, bytes: &[u8]) {
        line::send(bytes);
    }

    fn now(&self) -> Instant {
        let now = machine::ticks();
        let passed = self.since.replace(now).until(now);
        self.instructions.set(self.instructions.get() + machine::instructions(passed));
        Instant::from_micros(self.instructions.get() / CLOCK)
    }
}

#[cfg_attr(target_arch = "riscv32", machine::entry)]
fn main() -> ! {
    machine::start();
    machine::end(fly() == Some(Served::Over(Over::Ended)))
}

/// Flies once. `None` cannot be: nothing here is waited for.
fn fly() -> Option<Served> {
    let (mut incoming, mut happened, mut reply) = ([0; LONGEST], [0; LONGEST], [0; LONGEST_FRAME]);
    let mut line = Line::new(&mut incoming, &mut happened, &mut reply);
    let (mut place, mut bus) = (MaybeUninit::uninit(), Bus::new());
    let mut wire = Machine { since: Cell::new(machine::ticks()), instructions: Cell::new(0) };
    let mut config = VehicleConfig::default();
    let served = pin!(serve::<Runnables>(&mut wire, &mut line, &mut place, &mut bus, &mut config));
    match served.poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(served) => Some(served),
        Poll::Pending => None,
    }
}
