//! Hashes what our estimator says to the stream of the benchmark `estimators`: `cargo xtask cortex-m4f` compares it with
//! what the same code says on a Cortex-M4F.

use stampfly_benches::stream;
use stampfly_eskf::{Eskf, Estimator};

fn main() {
    for (name, configuration) in stream::configurations() {
        let mut filter = Eskf::new(configuration);
        filter.initialize(stream::START, &stream::calibration());
        let hash = (0..2 * stream::STEPS).fold(stream::HASH, |hash, k| {
            stream::advance(&mut filter, stream::end_of(k as u64), &stream::step(k % stream::STEPS));
            stream::hash(hash, &filter.estimate())
        });
        println!("{name}: hash {hash:016x}");
    }
}
