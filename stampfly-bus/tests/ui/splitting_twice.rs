//! A bus is split once.
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
    let first = bus.split(None);
    let second = bus.split(None);
    drop(first.outside.tof);
}
