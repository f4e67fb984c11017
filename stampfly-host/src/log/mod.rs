//! Tools for logs: what is in one, a part of one, and other formats of it.
//!
//! | module | command | what it does |
//! |---|---|---|
//! | [`info`] | `stampfly log info` | vehicle, length, topics with their rates, what is missing |
//! | [`csv`] | `stampfly log csv` | a table a topic |
//! | [`mcap`] | `stampfly log mcap` | for Foxglove and PlotJuggler, with every topic's units |
//! | [`cut`] | `stampfly log cut` | a part of a flight, which still replays |
//! | [`record`] | `stampfly log ulog` | a [compact record](stampfly_flight::compact) as a log |
//! | [`refly`] | `stampfly log refly` | a simulated flight again, with other parameters from an instant on |
//!
//! They read what is whole of a log, and say how far that is with the sentence of
//! [`End`](stampfly_log::ulog::End). They read any ULog, and compact records of the vehicles here; `refly` reads logs of the simulator. `stampfly replay`
//! repeats what the flight stack computed in one of ours.

pub mod csv;
pub mod cut;
pub mod info;
pub mod mcap;
pub mod record;
pub mod refly;

/// A number with the digits that it needs: most in a log are single-precision.
fn shown(value: f64) -> String {
    let single = value as f32;
    if value.is_nan() {
        String::new()
    } else if f64::from(single) == value && single.abs() < 1e7 {
        single.to_string()
    } else {
        value.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::shown;

    #[test]
    fn a_number_has_the_digits_that_it_needs() {
        let shown = [f64::from(0.1_f32), 0.1, 12_345_678_901.0, f64::from(f32::MIN_POSITIVE), f64::NAN].map(shown);
        assert_eq!(shown[..3], ["0.1", "0.1", "12345678901"]);
        assert_eq!(shown[3].parse(), Ok(f32::MIN_POSITIVE));
        assert_eq!(shown[4], "", "an empty cell");
    }
}
