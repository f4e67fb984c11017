//! Who is not in the table's list of readers has no end to read from.
use stampfly_bus::topics;
use stampfly_types::messages::TofData;

topics! {
    /// One topic.
    pub mod wiring;
    /// Range to the ground.
    range: TofData = latest @ 30 Hz from tof => [landing];
}

fn main() {
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports: wiring::Ports { range }, .. } = bus.split(None);
    let _reader = range.telemetry;
}
