//! Instructions of a 4 kHz pass of the quadcopter's flight band on an emulated Cortex-M4F: `vehicles/stm32-quad/cortex-m4f`.
//!
//! The count is exact and the same on every host. Instructions are not cycles.

use super::toolchain::{self, TARGET};
use crate::machine::{EMULATED_ARM, provide};
use crate::repository::{Failure, Repository, capture};

const PACKAGE: &str = "vehicles/stm32-quad/cortex-m4f";
const PROGRAM: &str = "stampfly-stm32-quad-cortex-m4f";
/// The most that a pass may take: 64 MHz are 16,000 cycles in a period, and an instruction takes one and a half of
/// them or less; the rest is for input and output.
const BAR: u64 = 8_000;
/// The same of a vehicle that stands on the ground with its motors off, where a pass that is late delays nothing.
const STANDING_BAR: u64 = 9_000;
/// What the pilot does in each line, its bar, and passes that are counted of each.
const LINES: [(&str, u64); 3] = [("angle", BAR), ("acro", BAR), ("calibrating", STANDING_BAR)];
const PASSES: u64 = 6_000;
/// A run takes seconds. One that faulted would never end.
const SECONDS: &str = "120";
/// The machine; an instruction takes 2^7 ns of its time, so its timer counts instructions.
const MACHINE: [&str; 14] = [
    "qemu-system-arm",
    "-M",
    "mps2-an386",
    "-cpu",
    "cortex-m4",
    "-nographic",
    "-monitor",
    "none",
    "-serial",
    "none",
    "-semihosting-config",
    "enable=on,target=native",
    "-icount",
    "shift=7",
];

pub fn count(repository: &Repository, debian: bool) -> Result<(), Failure> {
    provide(repository, &[&EMULATED_ARM])?;
    let place = repository.target("stm32-pass");
    toolchain::build(repository, PACKAGE, &place, debian)?;
    let mut emulated = repository.command("timeout");
    emulated.arg(SECONDS).args(MACHINE).arg("-kernel").arg(place.join(TARGET).join("release").join(PROGRAM));
    let (said, _) = capture(&mut emulated)?;
    print!("{said}");
    judge(&said)
}

/// Has every line been measured, and is none above the bar?
fn judge(said: &str) -> Result<(), Failure> {
    for (name, bar) in LINES {
        let line = said.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
        let words: Vec<&str> = line.unwrap_or_default().split(' ').collect();
        let ["passes", passes, "mean", mean, "most", most, ..] = words[..] else {
            return Err(format!("nothing is said of '{name}'"));
        };
        let number = |text: &str| text.parse::<u64>().map_err(|_| format!("{name}: what is '{text}'?"));
        if number(passes)? != PASSES || number(mean)? == 0 {
            return Err(format!("{name}: the vehicle has not done that in {PASSES} passes"));
        }
        if number(most)? > bar {
            return Err(format!("{name}: a pass takes {most} instructions; {bar} is the most"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::judge;

    #[test]
    fn a_pass_that_is_too_long_or_was_not_measured_fails() {
        let said = |passes: u64, most: u64| {
            let lines = ["angle", "acro", "calibrating"]
                .map(|name| format!("{name}: passes {passes} mean 3000 most {most} samples 1\n"));
            lines.concat()
        };
        assert_eq!(judge(&said(6_000, 8_000)), Ok(()));
        assert!(judge(&said(6_000, 8_001)).is_err());
        assert!(judge(&said(5_999, 3_000)).is_err());
        assert!(judge("angle: passes 6000 mean 1 most 1 samples 1").is_err());
    }
}
