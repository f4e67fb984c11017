//! Converts throttle between vehicles.
//!
//! In manual modes throttle is thrust, and the stick position for hover depends on the vehicle; a
//! recording may come from another one. In modes that hold height the centre holds it on every
//! vehicle.

use super::file::StickFile;
use stampfly_types::messages::FlightMode;

/// Least distance of a measured hover throttle from either end of the stick, so that both sides
/// keep a range.
const ROOM: f32 = 0.1;
/// Throttle below which the vehicle stands, falls or coasts, so that the row does not count for
/// hover.
const AT_REST: f32 = -0.95;

/// Throttle stick of a vehicle, and that of the file's vehicle.
///
/// | mode in the file | mode flown | throttle sent |
/// |---|---|---|
/// | holds height | holds height | unchanged |
/// | manual | manual | unchanged; if the file's hover is known: lowest → no thrust, hover → hover, highest → highest |
/// | manual | holds height | no thrust → lowest, hover → centre, highest → highest |
/// | holds height | manual | lowest → no thrust, centre → hover, highest → highest |
///
/// ```
/// use stampfly_sim::sticks::Throttle;
/// use stampfly_types::messages::FlightMode::{Acro, AltHold, Stabilize};
/// // The vehicle hovers at 0.6, and below the centre has no thrust; the one of the file hovered at -0.5.
/// let throttle = Throttle { rest: 0.0, hover: 0.6, of_file: Some(-0.5) };
/// let sent = [-1.0, -0.75, -0.5, 1.0].map(|stick| throttle.sent(stick, Acro, Stabilize));
/// assert_eq!(sent, [0.0, 0.3, 0.6, 1.0]);
/// assert_eq!([-1.0, -0.5, 1.0].map(|stick| throttle.sent(stick, Acro, AltHold)), [-1.0, 0.0, 1.0]);
/// assert_eq!(Throttle { of_file: None, ..throttle }.sent(-0.75, Acro, Stabilize), -0.75);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Throttle {
    /// Highest stick position without thrust in the vehicle's manual modes.
    pub rest: f32,
    /// Stick position for hover in the vehicle's manual modes.
    pub hover: f32,
    /// Stick position at which the file's vehicle hovered; `None` for a file made for this vehicle.
    pub of_file: Option<f32>,
}

impl Throttle {
    /// Converts the stick of a row with mode `of` that is flown in mode `flown`.
    #[must_use]
    pub fn sent(&self, stick: f32, of: FlightMode, flown: FlightMode) -> f32 {
        let own = [self.rest, self.hover, 1.0];
        let centred = [-1.0, 0.0, 1.0];
        let recorded = self.of_file.map_or(own, |hover| [-1.0, hover, 1.0]);
        match (of.is_manual(), flown.is_manual()) {
            (false, false) => stick,
            (true, true) if self.of_file.is_none() => stick,
            (true, true) => between(stick, recorded, own),
            (true, false) => between(stick, recorded, centred),
            (false, true) => between(stick, centred, own),
        }
    }
}

/// Piecewise linear map from one triple to the other, limited to its ends.
fn between(stick: f32, [low, middle, high]: [f32; 3], [to_low, to_middle, to_high]: [f32; 3]) -> f32 {
    let share = |from: f32, to: f32| ((stick - from) / (to - from)).clamp(0.0, 1.0);
    if stick < middle {
        to_low + (to_middle - to_low) * share(low, middle)
    } else {
        to_middle + (to_high - to_middle) * share(middle, high)
    }
}

/// Estimates the hover throttle of a file: the time-weighted median over its armed rows in manual
/// modes with raised throttle, since over a whole flight the mean thrust equals the weight. `None`
/// without such rows.
pub(super) fn median(file: &StickFile) -> Option<f32> {
    let flies = |throttle: f32, arm: bool, mode: FlightMode| arm && mode.is_manual() && throttle > AT_REST;
    let mut spans: Vec<(f32, u64)> = file
        .spans()
        .filter(|(row, _)| flies(row.input.throttle, row.input.arm, row.input.mode))
        .map(|(row, span)| (row.input.throttle, span.as_micros()))
        .collect();
    spans.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    let half = spans.iter().map(|(_, span)| span).sum::<u64>() / 2;
    let mut passed = 0;
    let middle = spans.iter().find(|(_, span)| {
        passed += span;
        passed >= half
    });
    middle.map(|(throttle, _)| throttle.clamp(ROOM - 1.0, 1.0 - ROOM))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_by_time_and_of_what_flies() {
        let hover = |rows: &str| {
            let text = format!("t,throttle,roll,pitch,yaw,mode,arm\n{rows}");
            median(&StickFile::parse(text.as_bytes()).expect("a file"))
        };
        let manual = "0,0.9,0,0,0,acro,0\n5,-1,0,0,0,acro,1\n20,0.8,0,0,0,acro,1\n21,-0.4,0,0,0,acro,1\n";
        assert_eq!(
            hover(&format!("{manual}24,0.9,0,0,0,stabilize,1\n25,-0.7,0,0,0,althold,1\n99,0,0,0,0,althold,1")),
            Some(-0.4)
        );
        assert_eq!(hover("0,0.5,0,0,0,poshold,1\n9,0,0,0,0,poshold,1"), None);
        assert_eq!(hover("0,1,0,0,0,acro,1\n9,0,0,0,0,acro,1"), Some(0.9));
    }

    #[test]
    fn a_file_without_its_own_hover_is_this_vehicles() {
        let throttle = Throttle { rest: 0.0, hover: 0.6, of_file: None };
        let to = |stick, flown| throttle.sent(stick, FlightMode::Stabilize, flown);
        assert_eq!([-1.0, 0.0, 0.6, 1.0].map(|stick| to(stick, FlightMode::PosHold)), [-1.0, -1.0, 0.0, 1.0]);
        let back = |stick| throttle.sent(stick, FlightMode::AltHold, FlightMode::Acro);
        assert_eq!([-1.0, -0.5, 0.0, 1.0].map(back), [0.0, 0.3, 0.6, 1.0]);
    }
}
