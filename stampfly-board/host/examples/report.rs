//! Makes a page of a flight, or of a recording, or of a made-up flight if no file is given:
//!
//! ```sh
//! cargo run -p stampfly-host --example report -- out.html [FILE]
//! ```

use stampfly_host::report::Metric;
use stampfly_host::{Report, dataset, flight_log};

#[path = "../tests/made_up/mod.rs"]
mod made_up;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().unwrap_or_else(|| "flight.html".to_owned());
    let (title, subtitle, flight) = match arguments.next() {
        None => ("Figure eight".to_owned(), "a made-up flight of one minute".to_owned(), made_up::flight()),
        Some(file) => match flight_log::load(&file) {
            Ok(log) => (file, format!("{} places left out", log.omissions.len()), log.flight),
            Err(_) => {
                let recording = dataset::load(&file)?;
                (recording.name.clone(), recording.kind.to_string(), recording.to_flight())
            }
        },
    };
    let metrics = vec![
        Metric::new("Flight time", "52.4", "s"),
        Metric::new("Position error, RMS", "0.041", "m").judged(true),
        Metric::new("Position error, largest", "0.118", "m").judged(true),
        Metric::new("Attitude error, RMS", "0.62", "°").judged(true),
        Metric::new("Tracking error, RMS", "0.087", "m"),
        Metric::new("Touchdown speed", "0.31", "m/s").judged(false),
        Metric::new("Battery used", "31", "%"),
        Metric::new("Control deadline misses", "0", "").judged(true),
    ];
    Report { title, subtitle, metrics, flight: &flight }.write(&out)?;
    println!("{out}");
    Ok(())
}
