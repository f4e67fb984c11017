//! A topic has one line.
use stampfly_types::messages::TofData;

stampfly_bus::topics! {
    /// Range.
    range: TofData = latest @ 30 Hz from tof => [landing];
    /// Range.
    range: TofData = latest @ 30 Hz from front => [landing];
}

fn main() {}
