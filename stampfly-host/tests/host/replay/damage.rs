//! A log that was damaged anywhere: an error, a difference, an end or nothing, but never a panic.

use super::places::{Place, key_frame_parts, places};
use super::{record, replay, replay_from};
use crate::flown::hop;
use crate::thorough::thorough;
use proptest::prelude::*;
use stampfly_board::simulation::Setup;
use stampfly_flight::replay::ReplayError;
use stampfly_types::{Duration, Instant};
use std::ops::Range;
use std::sync::LazyLock;

/// The first second of a flight: small enough to be damaged many times.
static SECOND: LazyLock<Vec<u8>> =
    LazyLock::new(|| record(&Setup { limit: Duration::from_secs(1), ..hop(1, Some(1)) }));

/// What is whole is the same flight, wherever it ends.
#[test]
fn cut_off_anywhere_it_replays_up_to_there() {
    let (log, cuts) = (&*SECOND, thorough(60, 1_000));
    let mut before = 0;
    for cut in 0..cuts {
        let length = cut * log.len() / cuts;
        match replay(&log[..length]) {
            Ok(result) => {
                assert_eq!((&result.difference, result.gaps), (&None, 0), "cut at {length}");
                assert!(result.activations >= before, "cut at {length}: {result:?}");
                before = result.activations;
            }
            Err(error) => {
                assert!(
                    matches!(error, ReplayError::Log(_) | ReplayError::NoActivations | ReplayError::NoneLeft(_)),
                    "cut at {length}: {error}"
                );
                assert_eq!(before, 0, "cut at {length}: {error}");
            }
        }
    }
    assert!(before > 1_000, "{before}");
}

#[test]
fn bytes_turned_over_never_panic() {
    let (log, bytes) = (&*SECOND, thorough(20, 200));
    for place in (0..bytes).chain((0..bytes).map(|place| place * log.len() / bytes)) {
        let mut flipped = log.clone();
        flipped[place] ^= 0xff;
        let _ = replay(&flipped);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// Damage is an error, a difference or, where nothing depends on it, nothing. Never a panic.
    #[test]
    fn damage_never_panics(
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        keep in any::<prop::sample::Index>(),
        cut in any::<bool>(),
    ) {
        let mut log = SECOND.clone();
        for (index, byte) in damage {
            let index = index.index(log.len());
            log[index] = byte;
        }
        if cut {
            log.truncate(keep.index(log.len()));
        }
        let _ = replay(&log);
    }

    /// Damage inside samples, where the framing stays whole and everything is read.
    #[test]
    fn damaged_samples_never_panic(damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u64>()), 1..8)) {
        static PLACES: LazyLock<Vec<Place>> = LazyLock::new(|| places(&SECOND));
        let mut log = SECOND.clone();
        for (index, value) in damage {
            let payload = &mut log[PLACES[index.index(PLACES.len())].payload.clone()];
            let start = value as usize % payload.len();
            payload[start..].iter_mut().zip(value.to_le_bytes()).for_each(|(byte, new)| *byte = new);
        }
        let _ = replay(&log);
    }

    /// Damage inside key frames, from which the replay starts.
    #[test]
    fn damaged_key_frames_never_panic(damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u64>()), 1..8)) {
        static PARTS: LazyLock<Vec<Range<usize>>> = LazyLock::new(|| key_frame_parts(&SECOND));
        let mut log = SECOND.clone();
        for (index, value) in damage {
            // Behind the head of the message and the key.
            let part = PARTS[index.index(PARTS.len())].clone();
            let bytes = &mut log[part.start + 40..part.end];
            let start = value as usize % bytes.len();
            bytes[start..].iter_mut().zip(value.to_le_bytes()).for_each(|(byte, new)| *byte = new);
        }
        let _ = replay_from(&log, Some(Instant::ZERO));
    }
}
