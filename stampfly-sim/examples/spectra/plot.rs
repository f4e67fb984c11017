//! The picture: one panel per axis and situation, recorded and simulated, both axes logarithmic.

use crate::AXES;
use crate::spectrum::Spectrum;
use std::fmt::Write;

const RECORDED: &str = "#1b6ca8";
const SIMULATED: &str = "#e07b00";
const PANEL: (f64, f64) = (250.0, 170.0);
const GAP: (f64, f64) = (28.0, 52.0);
const MARGIN: (f64, f64) = (72.0, 84.0);
const FREQUENCIES: (f64, f64) = (4.0, 200.0);

/// `spectra[case] = [recorded, simulated]`, six axes each.
pub fn draw(cases: &[&str], spectra: &[[[Spectrum; 6]; 2]]) -> String {
    let (width, height) = (MARGIN.0 + 3.0 * (PANEL.0 + GAP.0), MARGIN.1 + 4.0 * (PANEL.1 + GAP.1));
    let mut svg = String::new();
    let mut put = |line: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(svg, "{line}");
    };
    put(format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="Helvetica, Arial, sans-serif" font-size="12" fill="#333">"##
    ));
    put(format!(r##"<rect width="{width}" height="{height}" fill="#fff"/>"##));
    put(format!(
        r#"<text x="{x}" y="26" font-size="17" font-weight="bold">Inertial noise of the StampFly, recorded and simulated</text>"#,
        x = MARGIN.0
    ));
    for (number, (colour, label)) in [(RECORDED, "recorded"), (SIMULATED, "simulated")].into_iter().enumerate() {
        let x = MARGIN.0 + 110.0 * number as f64;
        put(format!(r#"<line x1="{x}" y1="46" x2="{}" y2="46" stroke="{colour}" stroke-width="3"/>"#, x + 22.0));
        put(format!(r#"<text x="{}" y="50">{label}</text>"#, x + 28.0));
    }
    for (row, (sensor, case)) in [(0, 0), (0, 1), (1, 0), (1, 1)].into_iter().enumerate() {
        let lines = |axis: usize| spectra[case].iter().map(move |set| &set[3 * sensor + axis]);
        // One scale per row, whole decades.
        let levels: Vec<f64> = (0..3).flat_map(lines).flat_map(visible).map(|(_, level)| level).collect();
        let decades = (
            levels.iter().copied().fold(f64::MAX, f64::min).log10().floor(),
            levels.iter().copied().fold(0.0, f64::max).log10().ceil(),
        );
        let top = MARGIN.1 + row as f64 * (PANEL.1 + GAP.1);
        let unit = ["rad/s/√Hz", "m/s²/√Hz"][sensor];
        put(format!(
            r#"<text transform="translate(16 {y}) rotate(-90)" text-anchor="middle">{unit}</text>"#,
            y = top + 0.5 * PANEL.1
        ));
        for axis in 0..3 {
            let left = MARGIN.0 + axis as f64 * (PANEL.0 + GAP.0);
            let x = |f: f64| left + PANEL.0 * (f / FREQUENCIES.0).ln() / (FREQUENCIES.1 / FREQUENCIES.0).ln();
            let y = |level: f64| top + PANEL.1 * (decades.1 - level.log10()) / (decades.1 - decades.0);
            put(format!(
                r#"<text x="{left}" y="{}" font-weight="bold">{}, {}</text>"#,
                top - 12.0,
                AXES[3 * sensor + axis],
                cases[case]
            ));
            for f in [5.0, 10.0, 20.0, 50.0, 100.0, 200.0] {
                let x = x(f);
                put(format!(r##"<line x1="{x:.1}" y1="{top}" x2="{x:.1}" y2="{}" stroke="#e4e4e4"/>"##, top + PANEL.1));
                put(format!(r#"<text x="{x:.1}" y="{}" text-anchor="middle">{f}</text>"#, top + PANEL.1 + 15.0));
            }
            for decade in decades.0 as i32..=decades.1 as i32 {
                let y = y(10f64.powi(decade));
                put(format!(
                    r##"<line x1="{left}" y1="{y:.1}" x2="{}" y2="{y:.1}" stroke="#e4e4e4"/>"##,
                    left + PANEL.0
                ));
                if axis == 0 {
                    put(format!(
                        r#"<text x="{}" y="{:.1}" text-anchor="end">10<tspan dy="-5" font-size="9">{}</tspan></text>"#,
                        left - 6.0,
                        y + 5.0,
                        decade.to_string().replace('-', "−")
                    ));
                }
            }
            put(format!(
                r##"<rect x="{left}" y="{top}" width="{}" height="{}" fill="none" stroke="#999"/>"##,
                PANEL.0, PANEL.1
            ));
            for (spectrum, colour) in lines(axis).zip([RECORDED, SIMULATED]) {
                let points: Vec<String> =
                    visible(spectrum).map(|(f, level)| format!("{:.1},{:.1}", x(f), y(level))).collect();
                put(format!(
                    r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="1.3" stroke-linejoin="round"/>"#,
                    points.join(" ")
                ));
            }
        }
    }
    put(format!(
        r#"<text x="{}" y="{}" text-anchor="middle">frequency, Hz</text>"#,
        MARGIN.0 + 1.5 * PANEL.0 + GAP.0,
        height - 14.0
    ));
    put("</svg>".to_owned());
    svg
}

/// The part of a spectrum inside the panel.
fn visible(spectrum: &Spectrum) -> impl Iterator<Item = (f64, f64)> + '_ {
    spectrum.amplitudes().filter(|(f, _)| (FREQUENCIES.0..FREQUENCIES.1).contains(f))
}
