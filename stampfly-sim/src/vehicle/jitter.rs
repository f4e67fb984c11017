//! An executor that is late: seeded delays, as on a processor with other work to do.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use stampfly_types::Duration;

/// How late the executor is, drawn from a seed; never late without one.
pub(super) struct Jitter {
    random: Option<ChaCha8Rng>,
}

impl Jitter {
    pub(super) fn new(seed: Option<u64>) -> Self {
        Self { random: seed.map(ChaCha8Rng::seed_from_u64) }
    }

    /// Delay of the flight band: mostly some 100 µs, one time in twenty several milliseconds.
    pub(super) fn flight(&mut self) -> Duration {
        let Some(random) = &mut self.random else { return Duration::ZERO };
        let draw = u64::from(random.next_u32());
        Duration::from_micros(match draw % 20 {
            0 => 2_000 + draw / 20 % 6_000,
            1..=3 => 300 + draw / 20 % 1_700,
            _ => draw / 20 % 300,
        })
    }

    /// Time between reading and publishing of a background activation.
    pub(super) fn background(&mut self) -> Duration {
        let Some(random) = &mut self.random else { return Duration::ZERO };
        let draw = u64::from(random.next_u32());
        Duration::from_micros(if draw % 10 == 0 { draw / 10 % 10_000 } else { draw / 10 % 500 })
    }
}
