//! Only a named reader has an end.
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
    let end = split.runnables.control.range;
}
