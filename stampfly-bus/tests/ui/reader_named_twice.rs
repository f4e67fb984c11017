//! A reader has one cursor a topic.
use stampfly_types::messages::TofData;

stampfly_bus::topics! {
    /// Range.
    range: TofData = latest @ 30 Hz from tof => [landing, landing];
}

fn main() {}
