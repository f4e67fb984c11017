//! Makes a page of a logged flight, or of an invented one if no file is given:
//!
//! ```sh
//! cargo run -p stampfly-host --example report -- out.html [LOG]
//! ```

use stampfly_host::{Flight, Report, flight_log, report::Metric};

#[path = "../tests/host/made_up.rs"]
mod made_up;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().unwrap_or_else(|| "flight.html".to_owned());
    let (title, subtitle, flight) = match arguments.next() {
        None => ("Figure eight".to_owned(), "a made-up flight of one minute".to_owned(), made_up::flight()),
        Some(file) => {
            let log = flight_log::load(&file)?;
            (file, format!("{} places left out", log.omissions.len()), log.flight)
        }
    };
    let metrics = metrics(&flight);
    Report { title, subtitle, metrics, page: &stampfly_board::simulation::PAGE, flight: &flight }.write(&out)?;
    println!("{out}");
    Ok(())
}

/// What any flight can be measured by, and what one with an estimate and a reference can.
fn metrics(flight: &Flight) -> Vec<Metric> {
    let (start, end) = flight.span().unwrap_or_default();
    let samples: usize = flight.topics.values().map(|series| series.at.len()).sum();
    let mut metrics = vec![
        Metric::new("Duration", format!("{:.1}", end.since(start).seconds()), "s"),
        Metric::new("Topics", flight.topics.len(), ""),
        Metric::new("Samples", samples, ""),
    ];
    if let Some([mean, largest]) = position_error(flight) {
        metrics.push(Metric::new("Position error, RMS", format!("{mean:.3}"), "m").judged(mean < 0.1));
        metrics.push(Metric::new("Position error, largest", format!("{largest:.3}"), "m"));
    }
    metrics
}

/// Root mean square and largest distance of the estimated from the true position.
fn position_error(flight: &Flight) -> Option<[f64; 2]> {
    let (estimate, truth) = (flight.topics.get("estimate_state")?, flight.topics.get("truth")?);
    let (guess, place) = (estimate.columns_of::<3>("position")?, truth.columns_of::<3>("position")?);
    let squares = estimate.at.iter().enumerate().filter_map(|(row, at)| {
        let seen = truth.index_at(*at)?;
        Some((0..3).map(|axis| (guess[axis][row] - place[axis][seen]).powi(2)).sum::<f64>())
    });
    let squares: Vec<f64> = squares.filter(|square| square.is_finite()).collect();
    let largest = squares.iter().copied().reduce(f64::max)?.sqrt();
    Some([(squares.iter().sum::<f64>() / squares.len() as f64).sqrt(), largest])
}
