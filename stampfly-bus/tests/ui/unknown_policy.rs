//! Policies are `latest`, `ring(N)` and `queue(N)`.
use stampfly_types::messages::TofData;

stampfly_bus::topics! {
    /// Range.
    range: TofData = stack(4) @ 30 Hz from tof => [landing];
}

fn main() {}
