//! Everybody outside gets their ends.
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
    let topics::Outside {} = bus.split(None).outside;
}
