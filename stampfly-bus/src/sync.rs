//! The atomics the bus is built on: `core`'s in every build, loom's when its models are checked.
//!
//! Loom's atomics cannot be created in a constant, which is the only reason for [`unless_loom_const`]. Under loom they
//! come with a switch that [weakens](weaken) them, so that every model can show that it would find the error it is
//! there to find.

#[cfg(not(loom))]
pub(crate) use core::{
    hint::spin_loop,
    sync::atomic::{AtomicU32, Ordering, fence},
};
#[cfg(loom)]
pub(crate) use loom::{hint::spin_loop, sync::atomic::Ordering};
#[cfg(loom)]
pub(crate) use weaken::{AtomicU32, fence};

#[cfg(loom)]
#[allow(missing_docs, reason = "exists in the build of loom's models only")]
pub mod weaken {
    use core::cell::Cell;
    use loom::sync::atomic::{self, Ordering};

    /// One kind of ordering that can be taken out of the bus.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum Without {
        /// The fence between the odd sequence number and the words.
        ReleaseFence,
        /// The fence between the words and the second look at the sequence number.
        AcquireFence,
        /// "Complete" as the writer says it.
        ReleaseStore,
        /// "Complete" as the reader hears it.
        AcquireLoad,
    }

    std::thread_local! {
        // Loom runs the threads of a model on one thread of the system, so this reaches all of them.
        static WITHOUT: Cell<Option<Without>> = const { Cell::new(None) };
    }

    /// Takes an ordering out of everything this thread does with the bus from now on.
    pub fn set(without: Option<Without>) {
        WITHOUT.set(without);
    }

    fn unless(without: Without, ordering: Ordering) -> Ordering {
        if WITHOUT.get() == Some(without) { Ordering::Relaxed } else { ordering }
    }

    pub(crate) fn fence(ordering: Ordering) {
        let without = if ordering == Ordering::Release { Without::ReleaseFence } else { Without::AcquireFence };
        if WITHOUT.get() != Some(without) {
            atomic::fence(ordering);
        }
    }

    #[derive(Debug)]
    pub(crate) struct AtomicU32(atomic::AtomicU32);

    impl AtomicU32 {
        pub(crate) fn new(value: u32) -> Self {
            Self(atomic::AtomicU32::new(value))
        }

        pub(crate) fn load(&self, ordering: Ordering) -> u32 {
            let weakened =
                if ordering == Ordering::Acquire { unless(Without::AcquireLoad, ordering) } else { ordering };
            self.0.load(weakened)
        }

        pub(crate) fn store(&self, value: u32, ordering: Ordering) {
            let weakened =
                if ordering == Ordering::Release { unless(Without::ReleaseStore, ordering) } else { ordering };
            self.0.store(value, weakened);
        }
    }
}

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
