//! A depth is a power of two.
use stampfly_types::messages::TofData;

stampfly_bus::topics! {
    outside tof, landing;
    /// Range.
    range: TofData = ring(3) @ 30 Hz from tof => [landing];
}

fn main() {
    let mut bus = Bus::new();
    bus.split(None).outside.tof.range.publish(stampfly_bus::Instant::ZERO, &TofData::default());
}
