//! States of PX4's EKF2 as its replay test writes them: a time in µs, then `state[0]`, `state[1]` … and as many variances.
//!
//! | states | what |
//! |---|---|
//! | 0–3 | attitude, body FRD → NED |
//! | 4–6 | velocity NED, m/s |
//! | 7–9 | position NED, m |
//!
//! The states are those of EKF2's fusion horizon, which lies in the past by the delay of its latest sensor, and have two
//! significant digits. Since 2025 EKF2 keeps latitude and longitude beside the state, whose horizontal position is zero
//! throughout and whose vertical one is the altitude: such a log has no position. Its header then names fewer columns
//! than there are, so columns are counted, not looked up.

use super::csv::rows;
use super::error::DatasetErrorKind;
use super::recording::{DevicePoint, attitude};
use stampfly_types::{Instant, Vec3};
use std::path::{Path, PathBuf};

/// The folder, or prefix of the name, of inputs and of states.
const INPUT: &str = "replay_data";
const STATES: &str = "change_indication";

/// The file of states that belongs to a file of inputs, if it is there.
pub(super) fn beside(input: &Path) -> Option<PathBuf> {
    let name = input.file_name()?.to_str()?;
    let folder = input.parent().unwrap_or(Path::new(""));
    let renamed = name.strip_prefix(INPUT).map(|rest| folder.join(format!("{STATES}{rest}")));
    let moved = (folder.file_name()? == INPUT).then(|| folder.with_file_name(STATES).join(name));
    renamed.into_iter().chain(moved).find(|path| path.is_file())
}

/// Reads the states. Rows that are no attitude are left out: the filter had not started.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<DevicePoint>, DatasetErrorKind> {
    let mut points: Vec<DevicePoint> = Vec::new();
    let mut newest = Instant::ZERO;
    for row in rows(bytes).skip(1) {
        let row = row?;
        let at = row.micros(0, "Timestamp", 1.0)?;
        let mut states = [0.0; 10];
        for (place, state) in states.iter_mut().enumerate() {
            *state = row.number(place + 1, "state")?;
        }
        let [w, x, y, z, velocity @ .., north, east, down] = states;
        let vector = |[x, y, z]: [f64; 3]| Vec3::new(x as f32, y as f32, z as f32);
        let (velocity, position) = (vector(velocity), vector([north, east, down]));
        let finite = velocity.iter().chain(position.iter()).all(|value| value.is_finite());
        if let Some(attitude) = attitude(w, x, y, z).filter(|_| finite && at >= newest) {
            points.push(DevicePoint { at, attitude, position: Some(position), velocity });
            newest = at;
        }
    }
    let places = points.iter().any(|point| point.position.is_some_and(|p| p.x != 0.0 || p.y != 0.0));
    if !places {
        points.iter_mut().for_each(|point| point.position = None);
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(time: u32, place: &str, count: usize) -> String {
        format!("{time},0.6,0,0,0.8,1.5,-2,0.1,{place},-4.9e+02{}\n", ",0".repeat(count - 10))
    }

    #[test]
    fn states_are_read_whatever_their_number() {
        // 24 states and variances, as the header says, and 25 and 24.
        for count in [48, 49] {
            let text = format!("Timestamp,state[0],…\n{}{}", row(10_000, "0,0", count), row(90_000, "0,0", count));
            let points = read(text.as_bytes()).unwrap();
            assert_eq!(points.len(), 2);
            assert_eq!((points[1].at, points[1].velocity), (Instant::from_millis(90), Vec3::new(1.5, -2.0, 0.1)));
            assert!(points.iter().all(|point| point.position.is_none()), "no horizontal position is kept");
        }
    }

    #[test]
    fn a_position_that_moves_is_one() {
        let text = format!("Timestamp\n{}{}", row(10_000, "0,0", 48), row(90_000, "1.5,-2", 48));
        let points = read(text.as_bytes()).unwrap();
        assert_eq!(points[1].position, Some(Vec3::new(1.5, -2.0, -490.0)));
    }

    #[test]
    fn broken_rows_are_errors_and_rows_without_an_attitude_are_not() {
        let row = |cells: &str| read(format!("Timestamp\n{cells}\n").as_bytes());
        assert!(row("10000,0,0,0,0,0,0,0,0,0,0").is_ok_and(|points| points.is_empty()));
        assert!(row("10000,1,0,0,0,nan,0,0,0,0,0").is_ok_and(|points| points.is_empty()));
        assert!(row("10000,1,0,0").is_err() && row("10000,1,0,0,0,x,0,0,0,0,0").is_err());
    }

    #[test]
    fn the_states_lie_where_px4_has_them_or_beside() {
        let folder = std::env::temp_dir().join(format!("stampfly-ekf2-{}", std::process::id()));
        for inner in [INPUT, STATES] {
            std::fs::create_dir_all(folder.join(inner)).unwrap();
        }
        let (moved, renamed) = (folder.join(STATES).join("a.csv"), folder.join("change_indication__a.csv"));
        let found = [folder.join(INPUT).join("a.csv"), folder.join("replay_data__a.csv")].map(|input| {
            let before = beside(&input);
            (before, input)
        });
        assert!(found.iter().all(|(before, _)| before.is_none()), "there are none");
        std::fs::write(&moved, "").unwrap();
        std::fs::write(&renamed, "").unwrap();
        let [(_, first), (_, second)] = found;
        let after = [beside(&first), beside(&second)];
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(after, [Some(moved), Some(renamed)]);
    }
}
