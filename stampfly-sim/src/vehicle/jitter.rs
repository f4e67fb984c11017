//! Seeded delays of the executor, as on a processor with other work.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use stampfly_types::Duration;

/// Source of delays; without a seed all are zero.
pub(super) struct Jitter {
    random: Option<ChaCha8Rng>,
}

impl Jitter {
    pub(super) fn new(seed: Option<u64>) -> Self {
        Self { random: seed.map(ChaCha8Rng::seed_from_u64) }
    }

    /// Delay of the flight band: usually up to 300 µs, in three cases of twenty up to 2 ms, in one
    /// of twenty 2 to 8 ms.
    pub(super) fn flight(&mut self) -> Duration {
        let Some(random) = &mut self.random else { return Duration::ZERO };
        let draw = u64::from(random.next_u32());
        Duration::from_micros(match draw % 20 {
            0 => 2_000 + draw / 20 % 6_000,
            1..=3 => 300 + draw / 20 % 1_700,
            _ => draw / 20 % 300,
        })
    }

    /// Time between reading and publishing of a background activation: up to 500 µs, one time in
    /// ten up to 10 ms.
    pub(super) fn background(&mut self) -> Duration {
        let Some(random) = &mut self.random else { return Duration::ZERO };
        let draw = u64::from(random.next_u32());
        Duration::from_micros(if draw % 10 == 0 { draw / 10 % 10_000 } else { draw / 10 % 500 })
    }
}
