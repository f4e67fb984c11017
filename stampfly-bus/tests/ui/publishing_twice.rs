//! A topic has one publisher: its end can be moved, not copied.
mod topics {
    use stampfly_types::messages::TofData;

    stampfly_bus::topics! {
        outside tof;
        /// Range to the ground.
        range: TofData = latest @ 30 Hz from tof => [landing];
    }
}

fn main() {
    let mut bus = topics::Bus::new();
    let split = bus.split(None);
    let (first, second) = (split.outside.tof, split.outside.tof);
}
