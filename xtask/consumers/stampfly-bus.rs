//! A stranger's program: a bus of one topic.

use stampfly_bus::topics;
use stampfly_types::{Instant, messages::TofData};

topics! {
    /// One topic.
    pub mod wiring;
    /// Range to the ground.
    range: TofData = latest @ 30 Hz from tof => [display];
}

fn main() {
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports: wiring::Ports { mut range }, .. } = bus.split(None);
    range.tx.publish(Instant::from_micros(1), &TofData { distance: 0.4, ..Default::default() });
    assert_eq!(range.display.latest().map(|sample| sample.data.distance), Some(0.4));
}
