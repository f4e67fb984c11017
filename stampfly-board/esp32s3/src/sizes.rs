//! Memory that is set aside for good, bytes. Apart from what uses it, because `cargo xtask memory` reads it, too.

/// The flight core's stack.
pub const FLIGHT_STACK: usize = 12 * 1024;
/// The part of the heap that lies in memory of the S3's boot loader.
pub const FIRST_HEAP: usize = 72 * 1024;
/// The part of the heap that lies beside the S3's data cache.
pub const SECOND_HEAP: usize = 32 * 1024;
