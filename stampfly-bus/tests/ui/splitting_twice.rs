//! A bus cannot be split a second time to get a second publisher.
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
    let first = bus.split(None);
    let second = bus.split(None);
    drop((first, second));
}
