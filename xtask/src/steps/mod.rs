//! One file a step.

pub mod bars;
pub mod budget;
pub mod clippy;
pub mod constants;
pub mod consumers;
pub mod cortex_m4f;
pub mod determinism;
pub mod doc;
pub mod docs;
pub mod esp32;
pub mod examples;
pub mod figures;
pub mod files;
pub mod fmt;
pub mod golden;
pub mod loom;
pub mod machine;
pub mod memory;
pub mod no_std;
pub mod package;
pub mod panic_calls;
pub mod panic_proof;
pub mod peers;
pub mod qemu;
pub mod test;
pub mod ulog;
