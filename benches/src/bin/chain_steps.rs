//! Flies so many steps of a recorded flight and nothing else: `cargo xtask budget` counts its instructions.

use stampfly_benches::flight::{Recording, STEPS};
use stampfly_board::topics;

fn main() {
    let steps = std::env::args().nth(1).and_then(|argument| argument.parse().ok());
    let Some(steps) = steps.filter(|steps| (1..=STEPS).contains(steps)) else {
        eprintln!("usage: chain_steps STEPS, from 1 to {STEPS}");
        std::process::exit(2);
    };
    let recording = Recording::new();
    let mut bus = topics::Bus::new();
    let mut replay = recording.replay(&mut bus);
    replay.skip(steps);
    replay.check();
    println!("{steps} steps");
}
