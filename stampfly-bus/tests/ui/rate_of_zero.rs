//! A rate is above zero.
use stampfly_types::messages::TofData;

stampfly_bus::topics! {
    /// Range.
    range: TofData = latest @ 0 Hz from tof => [landing];
}

fn main() {}
