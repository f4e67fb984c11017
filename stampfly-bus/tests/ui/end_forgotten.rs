//! An assembly that takes the ports apart without `..` cannot forget a topic.
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
    let wiring::Split { ports, .. } = bus.split(None);
    let wiring::Ports {} = ports;
}
