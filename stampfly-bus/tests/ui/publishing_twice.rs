//! A topic has one publisher: whoever takes it has taken it.
use stampfly_bus::topics;
use stampfly_types::messages::TofData;

topics! {
    /// One topic.
    pub mod wiring;
    /// Range to the ground.
    range: TofData = latest @ 30 Hz from tof => [landing];
}

struct Driver<'b>(wiring::range::Tx<'b>);

fn main() {
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports: wiring::Ports { range }, .. } = bus.split(None);
    let _driver = Driver(range.tx);
    let _other = Driver(range.tx);
}
