//! A publisher knows what it published.
use stampfly_types::messages::TofData;

stampfly_bus::topics! {
    /// Range.
    range: TofData = latest @ 30 Hz from tof => [landing, tof];
}

fn main() {}
