//! Plays the golden flight on emulated cores: are its bits the same there, and what does it cost? `cargo xtask qemu`.
//!
//! One source for a Cortex-M4F, an RV32IMAFC, an Xtensa core with FPU, and for the PC they are compared with. The whole
//! flight stack runs as in flight: bus, estimator, failsafe, modes, guidance, control, mixer, and the flight record in
//! memory. Everything published goes into one hash, every byte of the flight record into another.
//!
//! Instructions are counted by the emulator, exactly and the same on every host; see [`machine`]. They are not cycles:
//! a real core needs more than one for many a load, branch or division, and an ESP32-S3's Xtensa has other instructions
//! than any of these.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg_attr(target_arch = "arm", path = "machine/arm.rs")]
#[cfg_attr(target_arch = "riscv32", path = "machine/riscv.rs")]
#[cfg_attr(target_arch = "xtensa", path = "machine/xtensa.rs")]
#[cfg_attr(not(any(target_arch = "arm", target_arch = "riscv32", target_arch = "xtensa")), path = "machine/host.rs")]
mod machine;

/// `println!` on whatever the machine has.
macro_rules! outln {
    ($($text:tt)*) => { crate::machine::line(format_args!($($text)*)) };
}

mod marks;
mod memory;
mod profile;
mod record;

use profile::Profile;
use stampfly_board::golden;
use stampfly_board::schedule::{ACTIVATIONS, Runnables};
use stampfly_board::topics::Bus;
use stampfly_flight::golden::{Verdict, stack_size};

#[cfg(not(target_arch = "xtensa"))]
#[cfg_attr(any(target_arch = "arm", target_arch = "riscv32"), machine::entry)]
fn main() -> ! {
    machine::start();
    machine::end(run())
}

#[cfg(target_arch = "xtensa")]
#[unsafe(no_mangle)]
#[expect(unsafe_code, reason = "xtensa/start.S calls it by its name")]
extern "C" fn main() -> ! {
    machine::start();
    machine::end(run())
}

/// Plays the flight and says what came of it. Was every bit as recorded?
fn run() -> bool {
    let mut memory = [0; memory::SIZE];
    let Some(record) = record::begin(&mut memory) else {
        outln!("no room for a flight record");
        return false;
    };
    let mut profile = Profile::new(record);
    let report = match golden::play(&mut Bus::new(), &mut profile) {
        Ok(report) => report,
        Err(error) => {
            outln!("{error}");
            return false;
        }
    };
    match report.verdict {
        Verdict::Identical => outln!("duties deviate by 0"),
        Verdict::WithinTolerance { worst } => outln!("duties deviate by {worst}, which is within tolerance"),
        Verdict::Beyond { worst, since } => outln!("duties deviate by {worst}, beyond tolerance since {since}"),
    }
    outln!("published: {} messages, hash {:016x}", report.messages, report.hash);
    let lost = profile.record.lost();
    let written = profile.record.into_sink();
    let bytes = written.written();
    outln!("recorded: {} bytes, {lost} messages lost, hash {:016x}", bytes.len(), memory::hash(bytes));
    outln!("stack: {} bytes of a vehicle and its bus", stack_size::<Runnables>());
    for (info, tally) in ACTIVATIONS.iter().zip(&profile.runnables) {
        tally.print(format_args!("{}, budget {} us", info.name, info.budget.as_micros()));
    }
    profile.chain.print("chain");
    profile.everything.print("chain, every sensor new");
    profile.recording.print("flight record");
    report.verdict == Verdict::Identical
}
