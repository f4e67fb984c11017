//! Which way a sensor is soldered, from what it feels in known poses.

/// Where each axis of the sensor points: rows of the body's axes, each 1, −1 or 0.
pub type Mounting = [[i8; 3]; 3];

/// Soldered as the driver has it.
pub const STRAIGHT: Mounting = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

/// An axis dominates when it has this share of the whole: 45° of a hand that is not steady.
const DOMINATES: f64 = 0.7;

/// The mounting of an accelerometer from what it felt, m/s²: level, right side down, nose up. `None` when a pose was not
/// held, or what was felt fits no mounting.
#[must_use]
pub fn mounting(level: [f64; 3], right_down: [f64; 3], nose_up: [f64; 3]) -> Option<Mounting> {
    // Level the weight is felt along −z, right side down along −y, nose up along +x.
    let along_x = main_axis(nose_up)?;
    let along_y = main_axis(right_down)?.map(|part| -part);
    let along_z = main_axis(level)?.map(|part| -part);
    let rows: Mounting = core::array::from_fn(|axis| [along_x[axis], along_y[axis], along_z[axis]]);
    rows.iter().all(|row| row.iter().filter(|part| **part != 0).count() == 1).then_some(rows)
}

/// The axis along which most of it is, with its sign.
fn main_axis(felt: [f64; 3]) -> Option<[i8; 3]> {
    let size = felt.iter().map(|part| part * part).sum::<f64>().sqrt();
    if size < 5.0 {
        return None;
    }
    let axis = felt.map(|part| if part.abs() >= DOMINATES * size { part.signum() as i8 } else { 0 });
    (axis.iter().filter(|part| **part != 0).count() == 1).then_some(axis)
}

/// What is wrong with a mounting, as the end of a finding's name; `None` when it is straight.
#[must_use]
pub fn wrong(rows: Mounting) -> Option<&'static str> {
    if rows == STRAIGHT {
        return None;
    }
    let diagonal = [rows[0][0], rows[1][1], rows[2][2]];
    Some(match diagonal {
        [-1, 1, 1] => "x-reversed",
        [1, -1, 1] => "y-reversed",
        [1, 1, -1] => "z-reversed",
        [-1, -1, 1] => "turned-180",
        [_, _, -1] if diagonal[0] != 0 => "upside-down",
        [0, 0, 1] if rows[0][1] == -rows[1][0] => "turned-90",
        [0, 0, 1] => "axes-swapped",
        _ => "turned-otherwise",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mounting_has_its_name() {
        let g = 9.81;
        let felt = |rows: Mounting| {
            let turn = |body: [f64; 3]| rows.map(|row| (0..3).map(|i| f64::from(row[i]) * body[i]).sum::<f64>());
            mounting(turn([0.5, 0.0, -g]), turn([0.0, -g, 1.0]), turn([g, 1.0, -2.0]))
        };
        for (rows, name) in [
            (STRAIGHT, None),
            ([[-1, 0, 0], [0, 1, 0], [0, 0, 1]], Some("x-reversed")),
            ([[-1, 0, 0], [0, -1, 0], [0, 0, 1]], Some("turned-180")),
            ([[1, 0, 0], [0, -1, 0], [0, 0, -1]], Some("upside-down")),
            ([[-1, 0, 0], [0, 1, 0], [0, 0, -1]], Some("upside-down")),
            ([[0, 1, 0], [-1, 0, 0], [0, 0, 1]], Some("turned-90")),
            ([[0, -1, 0], [1, 0, 0], [0, 0, 1]], Some("turned-90")),
            ([[0, 1, 0], [1, 0, 0], [0, 0, 1]], Some("axes-swapped")),
            ([[0, 0, 1], [1, 0, 0], [0, 1, 0]], Some("turned-otherwise")),
        ] {
            assert_eq!(felt(rows), Some(rows));
            assert_eq!(wrong(rows), name, "{rows:?}");
        }
        assert_eq!(mounting([0.0, 0.0, -g], [0.0, 0.0, -g], [g, 0.0, 0.0]), None, "it was not tilted");
        assert_eq!(mounting([0.0; 3], [0.0; 3], [0.0; 3]), None);
    }
}
