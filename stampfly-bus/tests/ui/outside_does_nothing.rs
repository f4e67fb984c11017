//! Who is outside publishes or reads something.
use stampfly_types::messages::TofData;

stampfly_bus::topics! {
    outside tof, motors;
    /// Range.
    range: TofData = latest @ 30 Hz from tof => [landing];
}

fn main() {}
