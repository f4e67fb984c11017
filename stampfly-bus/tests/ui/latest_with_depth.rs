//! The depth of `latest` is not a choice.
use stampfly_types::messages::TofData;

stampfly_bus::topics! {
    /// Range.
    range: TofData = latest(4) @ 30 Hz from tof => [landing];
}

fn main() {}
