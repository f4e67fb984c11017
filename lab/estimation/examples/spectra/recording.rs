//! Reading the recordings: comma-separated, one header line, columns by name.

use std::path::Path;

/// The six inertial columns of a recording, one row per distinct sample.
pub struct Recording(Vec<[f64; 6]>);

const COLUMNS: [&str; 6] = ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"];

impl Recording {
    pub fn read(path: &Path) -> Result<Self, String> {
        let fail = |what: String| format!("{}: {what}", path.display());
        let text = std::fs::read_to_string(path).map_err(|e| fail(e.to_string()))?;
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next().unwrap_or_default().split(',').map(str::trim).collect();
        let mut places = [0; 6];
        for (place, name) in places.iter_mut().zip(COLUMNS) {
            *place = header.iter().position(|h| *h == name).ok_or_else(|| fail(format!("no column {name}")))?;
        }
        let mut rows: Vec<[f64; 6]> = Vec::new();
        for (number, line) in lines.enumerate() {
            let cells: Vec<&str> = line.split(',').collect();
            let mut row = [0.0; 6];
            for (value, place) in row.iter_mut().zip(places) {
                let cell = cells.get(place).and_then(|cell| cell.trim().parse::<f64>().ok());
                *value = cell.ok_or_else(|| fail(format!("line {} is no sample", number + 2)))?;
            }
            // Some recorders repeat a sample until the next one arrives.
            if rows.last() != Some(&row) {
                rows.push(row);
            }
        }
        Ok(Self(rows))
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The columns from `begin` seconds on, at `rate` rows per second. The time stamps are the radio's, in bursts,
    /// and say nothing about the samples.
    pub fn axes(&self, begin: f64, rate: f64) -> [Vec<f64>; 6] {
        let rows = &self.0[((begin * rate) as usize).min(self.0.len())..];
        core::array::from_fn(|axis| rows.iter().map(|row| row[axis]).collect())
    }
}
