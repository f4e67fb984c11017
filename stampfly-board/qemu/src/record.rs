//! The flight record, as the vehicle writes it: a ULog with every sample of every topic and every activation.

use stampfly_board::VehicleConfig;
use stampfly_board::schedule::Runnables;
use stampfly_flight::{Recorder, black_box};
use stampfly_log::ulog::Ram;
use stampfly_types::Instant;

/// A flight record that is being written into memory.
pub type Record<'t> = Recorder<Runnables, Ram<'t>>;

/// Facts, parameters and formats. `None` when there is no room for them.
pub fn begin(memory: &mut [u8]) -> Option<Record<'_>> {
    let log = black_box::open(Ram::new(memory), Instant::ZERO, "stampfly", &VehicleConfig::default(), "golden flight");
    log.ok().map(Recorder::new)
}
