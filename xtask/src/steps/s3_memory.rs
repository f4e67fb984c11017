//! How much of the ESP32-S3's memory the firmware leaves to its first core's stack. No compiler makes the S3's program here,
//! so the answer is put together from three others.
//!
//! | part | taken from |
//! |---|---|
//! | variables, stacks, the heap beside the data cache, the hardware layer's code in RAM | the ESP32-C6's program, which is the same code |
//! | the radio | Espressif's libraries for the S3, linked for it ([`esp32_link`](super::esp32_link)) |
//! | our code in RAM (`in_ram.txt`) | the emulated Xtensa's program: that core's code is the larger one |
//!
//! What it has to suffice for is asked by the step `memory`.

use super::cache::in_ram;
use super::esp32_link::S3Scripts;
use super::{core1, esp32_link, qemu};
use crate::elf::{C, Names, Place, Program};
use crate::repository::{Failure, Repository};
use object::{Object, ObjectSection};
use std::fs;
use std::ops::Range;
use std::path::Path;

/// What the firmware sets aside: on the S3 the flight core's stack comes on top, and a part of the heap lies elsewhere.
#[path = "../../../stampfly-board/esp32s3/src/sizes.rs"]
pub mod sizes;

/// The S3's data memory, which code in RAM shares (esp-hal's `ld/esp32s3/memory.x`: from 0x3FC88000 to 0x3FCDB700).
const S3_MEMORY: u64 = 0x3FCD_B700 - 0x3FC8_8000;
/// The C6's memory, as its program's sections see it.
const C6_MEMORY: Range<u64> = 0x4080_0000..0x4088_0000;

/// Bytes for the stack of the first core, from the C6's program.
pub fn stack(repository: &Repository, c6: &Path, scripts: &S3Scripts) -> Result<u64, Failure> {
    let patterns = in_ram(repository)?;
    let patterns: Vec<&str> = patterns.iter().map(String::as_str).collect();
    let kept = kept(c6)?;
    let program = Program::read(c6)?;
    let of_c = || program.symbols.values().filter(|symbol| symbol.owner == C);
    let radio = of_c().filter(|symbol| symbol.place != Place::Flash).map(|symbol| symbol.size).sum::<u64>();
    let listed = |names: &Names, place: Range<u64>| -> u64 {
        let ranges = names.fitting(&patterns).into_iter().filter(|range| place.contains(&range.start));
        ranges.map(|range| range.end - range.start).sum()
    };
    let code = listed(&Names::read(c6)?, C6_MEMORY);
    let rest = kept.checked_sub(radio + code).ok_or("parts of the C6's memory are more than all of it")?;

    let wanted: Vec<&str> = of_c().map(|symbol| symbol.name.as_str()).collect();
    let s3_radio = esp32_link::radio(repository, scripts, &wanted)?;
    let (script, _) = core1::record(repository)?;
    let xtensa = Names::read(&core1::program(repository, &qemu::XTENSA, &script)?)?;
    let s3_code = listed(&xtensa, 0..u64::MAX);

    let stack = sizes::FLIGHT_STACK as u64;
    println!("bytes of memory        {:>9} {:>9}", "ESP32-C6", "ESP32-S3");
    println!("radio's libraries      {radio:>9} {s3_radio:>9}");
    println!("code of ours in RAM    {code:>9} {s3_code:>9}");
    println!("second core's stack    {:>9} {stack:>9}", "");
    println!("all else               {rest:>9} {rest:>9}");
    let used = s3_radio + s3_code + stack + rest;
    let left = (S3_MEMORY + sizes::SECOND_HEAP as u64).checked_sub(used);
    let left = left.ok_or_else(|| format!("{used} bytes are more than the S3 has"))?;
    println!("left to the first core's stack   {left:>9}");
    Ok(left)
}

/// Bytes of memory that a program of the C6 keeps, its stack apart.
fn kept(c6: &Path) -> Result<u64, Failure> {
    let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", c6.display());
    let bytes = fs::read(c6).map_err(|e| fail(&e))?;
    let file = object::File::parse(&*bytes).map_err(|e| fail(&e))?;
    // What is left over is the stack's, and the boot loader's memory is another region on the S3, too.
    let kept = file.sections().filter(|section| !matches!(section.name(), Ok(".stack" | ".dram2_uninit")));
    Ok(kept.filter(|section| C6_MEMORY.contains(&section.address())).map(|section| section.size()).sum())
}
