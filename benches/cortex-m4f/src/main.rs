//! Instructions of a 400 Hz step of the estimator on a Cortex-M4F, counted, not timed: `cargo xtask cortex-m4f`.
//!
//! QEMU is told that an instruction takes 128 ns of its time ([`INSTRUCTION`]), so the core's timer counts instructions,
//! exactly and the same on every host. Instructions are not cycles: a Cortex-M4F needs more than one for a load, a branch
//! or a division. The stream is that of the benchmark `estimators`; the first pass lets the filter settle, the second is
//! counted. The hash is over the bits of all estimates, to compare with the host's.
#![no_std]
#![no_main]

#[path = "../../src/stream.rs"]
mod stream;

use core::hint::black_box;
use cortex_m::Peripherals;
use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use panic_semihosting as _;
use stampfly_eskf::{Eskf, Estimator};

/// What an instruction takes of the emulator's time (`-icount shift=7`), ns.
const INSTRUCTION: u64 = 128;
/// A tick of the core's timer: the board runs at 25 MHz, ns.
const TICK: u64 = 40;
/// The timer counts down from here.
const RELOAD: u32 = 0x00ff_ffff;

#[entry]
fn main() -> ! {
    let mut timer = Peripherals::take().expect("the first to ask").SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(RELOAD);
    timer.clear_current();
    timer.enable_counter();

    let steps: [stream::Step; stream::STEPS] = core::array::from_fn(stream::step);
    let looking = ticks(|| ());
    for (name, configuration) in stream::configurations() {
        let mut filter = Eskf::new(configuration);
        filter.initialize(stream::START, &stream::calibration());
        let mut hash = stream::HASH;
        let (mut sum, mut most) = (0, 0);
        for k in 0..2 * stream::STEPS {
            let (at, step) = (stream::end_of(k as u64), &steps[k % stream::STEPS]);
            let mut estimate = None;
            let taken = ticks(|| {
                black_box(stream::advance(&mut filter, black_box(at), black_box(step)));
                estimate = Some(black_box(filter.estimate()));
            });
            hash = estimate.iter().fold(hash, stream::hash);
            if k >= stream::STEPS {
                sum += u64::from(taken - looking);
                most = most.max(taken - looking);
            }
        }
        let [mean, most] = [instructions(sum) / stream::STEPS as u64, instructions(u64::from(most))];
        hprintln!("{}: mean {} most {} hash {:016x}", name, mean, most, hash);
    }
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}

/// Ticks of the timer while `work` is done.
#[inline(always)]
fn ticks(work: impl FnOnce()) -> u32 {
    let before = SYST::get_current();
    work();
    before.wrapping_sub(SYST::get_current()) & RELOAD
}

fn instructions(ticks: u64) -> u64 {
    (ticks * TICK + INSTRUCTION / 2) / INSTRUCTION
}
