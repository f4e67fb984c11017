//! State as bytes: whatever a component was told before, it goes on from its bytes as if nothing had happened.
//!
//! Every component runs for a while on input that varies with a fixed seed, is written with postcard and read back. Then
//! both run on, and at every step their outputs and their bytes have to be the same.

mod controllers;
mod estimators;
mod messages;
mod modes;
mod vehicle;

use core::fmt::Debug;
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;
use serde::{Serialize, de::DeserializeOwned};
use stampfly_types::{Duration, Instant, Vec3};

/// One step of the flight loop.
const STEP: Duration = Duration::from_micros(2_500);

fn at(step: u64) -> Instant {
    Instant::ZERO + STEP * step
}

/// Numbers that vary, the same in every run.
#[derive(Clone)]
struct Numbers(TestRunner);

impl Numbers {
    fn new() -> Self {
        Self(TestRunner::deterministic())
    }

    fn any<S: Strategy>(&mut self, strategy: S) -> S::Value {
        strategy.new_tree(&mut self.0).expect("a value").current()
    }

    /// Within ± `most`.
    fn number(&mut self, most: f32) -> f32 {
        self.any(-most..most)
    }

    fn vector(&mut self, most: f32) -> Vec3 {
        Vec3::from_fn(|_| self.number(most))
    }

    /// True once in so many times.
    fn once_in(&mut self, times: u32) -> bool {
        self.any(0..times) == 0
    }
}

fn bytes(state: &impl Serialize) -> Vec<u8> {
    let mut buffer = vec![0; 1 << 14];
    postcard::to_slice(state, &mut buffer).expect("room").to_vec()
}

fn restored<T: DeserializeOwned>(bytes: &[u8]) -> T {
    let (state, rest) = postcard::take_from_bytes(bytes).expect("it was written a moment ago");
    assert!(rest.is_empty());
    state
}

/// Runs a component for `steps`, restores it from its bytes, and runs both for as long again. A step gets the numbers
/// its input is made of; both get the same. Returns how it ended.
fn goes_on<T, O>(mut component: T, steps: u64, mut step: impl FnMut(&mut T, u64, &mut Numbers) -> O) -> T
where
    T: Serialize + DeserializeOwned + PartialEq + Debug,
    O: Serialize,
{
    let fresh = bytes(&component);
    let mut numbers = Numbers::new();
    for k in 1..=steps {
        step(&mut component, k, &mut numbers);
    }
    let mut same_numbers = numbers.clone();
    let saved = bytes(&component);
    assert_ne!(saved, fresh, "nothing happened");
    let mut again: T = restored(&saved);
    assert_eq!(again, component);
    let mut outputs = Vec::new();
    for k in steps + 1..=2 * steps {
        let output = bytes(&step(&mut component, k, &mut numbers));
        assert_eq!(bytes(&step(&mut again, k, &mut same_numbers)), output, "output of step {k}");
        assert_eq!(bytes(&again), bytes(&component), "state after step {k}");
        outputs.push(output);
    }
    assert_ne!(bytes(&component), saved, "nothing happened after it was restored");
    outputs.dedup();
    assert!(outputs.len() > 1, "the output never changed");
    component
}
