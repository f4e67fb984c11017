//! A log in memory: for tests and short drives on a PC, whose log is replayed at once. Not for long ones; a file is a sink as well.

use alloc::vec::Vec;
use core::convert::Infallible;
use stampfly_log::ulog::Sink;

/// The bytes of a log so far.
///
/// ```
/// use stampfly_flight::replay::Memory;
/// use stampfly_log::ulog::Definitions;
/// use stampfly_types::Instant;
///
/// let mut log = Memory::default();
/// Definitions::start(&mut log, Instant::ZERO)?.info("sys_name", "robot")?;
/// assert!(log.0.starts_with(b"ULog"));
/// # Ok::<(), stampfly_log::ulog::WriteError<core::convert::Infallible>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Memory(pub Vec<u8>);

impl Sink for Memory {
    type Error = Infallible;

    fn write(&mut self, bytes: &[u8]) -> Result<(), Infallible> {
        self.0.extend_from_slice(bytes);
        Ok(())
    }
}
