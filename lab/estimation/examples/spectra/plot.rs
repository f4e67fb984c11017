//! The picture: one panel per axis and situation, recorded and simulated, both axes logarithmic.

use crate::AXES;
use crate::spectrum::Spectrum;
use stampfly_lab::chart::{Axis, BLUE, Chart, Mark, ORANGE, Panel, Scale, Shape};

const FREQUENCIES: [f64; 2] = [4.0, 200.0];

/// `spectra[case] = [recorded, simulated]`, six axes each.
pub fn draw(cases: &[&str], spectra: &[[[Spectrum; 6]; 2]]) -> String {
    let mut panels = Vec::new();
    for (sensor, case) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let lines = |axis: usize| spectra[case].iter().map(move |set| &set[3 * sensor + axis]);
        // One scale per row, whole decades.
        let levels: Vec<f64> = (0..3).flat_map(lines).flat_map(visible).map(|[_, level]| level).collect();
        let lowest = libm::log10(levels.iter().copied().fold(f64::MAX, f64::min)).floor();
        let highest = libm::log10(levels.iter().copied().fold(0.0, f64::max)).ceil();
        let unit = ["rad/s/√Hz", "m/s²/√Hz"][sensor];
        for axis in 0..3 {
            let mark =
                |(spectrum, (name, colour))| Mark { name, colour, shape: Shape::Line(visible(spectrum).collect()) };
            panels.push(Panel {
                title: format!("{}, {}", AXES[3 * sensor + axis], cases[case]),
                x: logarithmic("frequency, Hz", FREQUENCIES),
                y: logarithmic(unit, [lowest, highest].map(|decade| libm::pow(10.0, decade))),
                marks: lines(axis).zip([("recorded", BLUE), ("simulated", ORANGE)]).map(mark).collect(),
            });
        }
    }
    let title = "Inertial noise of the StampFly, recorded and simulated".to_owned();
    Chart { title, columns: 3, size: [250.0, 170.0], panels }.to_svg()
}

fn logarithmic(label: &str, range: [f64; 2]) -> Axis {
    Axis { scale: Scale::Logarithmic, ..Axis::linear(label, range) }
}

/// The part of a spectrum inside the panel.
fn visible(spectrum: &Spectrum) -> impl Iterator<Item = [f64; 2]> + '_ {
    let within = FREQUENCIES[0]..FREQUENCIES[1];
    spectrum.amplitudes().filter(move |(f, _)| within.contains(f)).map(|(f, level)| [f, level])
}
