//! A rate has a unit.
use stampfly_types::messages::TofData;

stampfly_bus::topics! {
    /// Range.
    range: TofData = latest @ 30 from tof => [landing];
}

fn main() {}
