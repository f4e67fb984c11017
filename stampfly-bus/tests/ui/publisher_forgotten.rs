//! A line names the publisher.
use stampfly_types::messages::TofData;

stampfly_bus::topics! {
    /// Range.
    range: TofData = latest @ 30 Hz => [landing];
}

fn main() {}
