//! PX4's EKF2 replay recordings: how far from the receiver and the magnetometer the filter is, and how far EKF2 was.

use stampfly_lab::dataset;
use stampfly_lab::estimate;
use std::error::Error;
use std::path::PathBuf;

/// Set by the build script.
const FOLDER: &str = env!("STAMPFLY_DATA_FOLDER");

/// Prints a table over every recording of the folder.
pub fn table() -> Result<(), Box<dyn Error>> {
    println!("PX4 EKF2 replay, RMS differences after ten seconds (of EKF2 in brackets; its log has no position):");
    let Ok(entries) = std::fs::read_dir(PathBuf::from(FOLDER).join("px4_ekf2_replay")) else {
        println!("  px4_ekf2_replay is not there");
        return Ok(());
    };
    let mut files = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, std::io::Error>>()?;
    files.retain(|file| file.file_name().is_some_and(|name| name.to_string_lossy().starts_with("replay_data")));
    files.sort();
    for file in files {
        let recording = dataset::load(&file)?;
        let figures = estimate::run(&recording, &estimate::suite(recording.kind)).figures;
        let Some(receiver) = figures.receiver else { continue };
        let value = |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{value:.2}"));
        println!("  {} ({} fixes, {} resets):", recording.name, receiver.fixes, figures.resets);
        let rows = [
            ("position less receiver's, m", receiver.position_m, receiver.device_position_m),
            ("velocity less receiver's, m/s", receiver.velocity_mps, receiver.device_velocity_mps),
            ("heading less magnetometer's, deg", receiver.heading_deg, receiver.device_heading_deg),
        ];
        for (name, ours, device) in rows {
            println!("    {name:<34} {:>6} ({})", value(ours), value(device));
        }
        println!("    {:<34} {:>6}", "velocity less EKF2's, m/s", value(receiver.velocity_to_device_mps));
        println!("    {:<34} {:>6}", "heading less EKF2's, deg", value(receiver.heading_to_device_deg));
        println!("    {:<34} {:>6}", "tilt against EKF2's, deg", value(receiver.tilt_to_device_deg));
    }
    Ok(())
}
