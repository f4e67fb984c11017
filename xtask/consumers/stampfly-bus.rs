//! A stranger's program: a bus of one topic.

mod topics {
    use stampfly_types::messages::TofData;

    stampfly_bus::topics! {
        outside tof, display;

        /// Range to the ground.
        range: TofData = latest @ 30 Hz from tof => [display];
    }
}

use stampfly_types::{Instant, messages::TofData};

fn main() {
    let mut bus = topics::Bus::new();
    let topics::Outside { mut tof, mut display } = bus.split(None).outside;
    tof.range.publish(Instant::from_micros(1), &TofData { distance: 0.4, ..Default::default() });
    assert_eq!(display.range.latest().map(|sample| sample.data.distance), Some(0.4));
}
