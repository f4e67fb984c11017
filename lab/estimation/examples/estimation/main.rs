//! The pictures of `docs/explain/estimation.md`: how the estimator does, on simulated and on recorded flights.
//!
//! ```sh
//! cargo run --release --manifest-path lab/Cargo.toml --example estimation
//! ```
//!
//! Draws `docs/images/estimation_*.svg` and prints the figures that the document quotes. The recorded ones need the
//! recordings (`STAMPFLY_DATA`, default `../shared/data`) and are left as they are without them. The same sources and
//! recordings give the same bytes.

mod flown;
mod receiver;
mod recorded;
mod simulated;

use stampfly_lab::chart::Chart;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    simulated::consistency()?;
    simulated::late()?;
    recorded::innovations()?;
    recorded::paths()?;
    recorded::attitude()?;
    receiver::table()
}

/// Writes a picture.
fn draw(name: &str, chart: &Chart) -> Result<(), Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/images").join(name);
    std::fs::write(&path, chart.to_svg()).map_err(|error| format!("{}: {error}", path.display()))?;
    println!("  drawn: docs/images/{name}");
    Ok(())
}

/// Lowest and highest of some values and zero, with a little room.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = values.fold([0.0f64; 2], |[low, high], value| [low.min(value), high.max(value)]);
    let room = 0.05 * (high - low).max(1e-3);
    [low - room, high + room]
}
