//! A ring has a depth.
use stampfly_types::messages::TofData;

stampfly_bus::topics! {
    /// Range.
    range: TofData = ring @ 30 Hz from tof => [landing];
}

fn main() {}
