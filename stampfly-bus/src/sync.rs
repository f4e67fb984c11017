//! The atomics the bus is built on: `core`'s in every build, loom's when its models are checked.
//!
//! Loom's atomics cannot be created in a constant, which is the only reason for [`unless_loom_const`].

#[cfg(not(loom))]
pub(crate) use core::sync::atomic::{AtomicU32, Ordering, fence};
#[cfg(loom)]
pub(crate) use loom::sync::atomic::{AtomicU32, Ordering, fence};

/// `const fn` in every build except loom's.
macro_rules! unless_loom_const {
    ($(#[$meta:meta])* $vis:vis fn $name:ident() -> Self { $constant:expr, $loom:expr }) => {
        $(#[$meta])*
        #[cfg(not(loom))]
        $vis const fn $name() -> Self { $constant }
        $(#[$meta])*
        #[cfg(loom)]
        $vis fn $name() -> Self { $loom }
    };
}
pub(crate) use unless_loom_const;
