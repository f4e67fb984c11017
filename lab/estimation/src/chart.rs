//! Charts for documents: lines, bands, points and bars on panels in a grid, as SVG.
//!
//! For pictures that a command draws and a document shows: the same numbers give the same bytes. No scripts, no fonts of
//! its own, a white ground, so that it reads the same on a light page and on a dark one. For looking into a flight use
//! the interactive report of the program `stampfly`.

use std::fmt::Write;

/// Colours that keep apart in print and for most eyes.
pub const BLUE: &str = "#1b6ca8";
/// See [`BLUE`].
pub const ORANGE: &str = "#e07b00";
/// See [`BLUE`].
pub const GREEN: &str = "#2e8b57";
/// For what is there to compare with.
pub const GREY: &str = "#9a9a9a";
/// For limits.
pub const RED: &str = "#b8322a";

/// Room around the panels: left, top, right, bottom.
const MARGIN: [f64; 4] = [70.0, 76.0, 20.0, 46.0];
/// Room between them.
const GAP: [f64; 2] = [76.0, 78.0];
/// No axis has more than this many intervals.
const MOST_TICKS: f64 = 6.0;

/// How values become places on an axis.
#[derive(Clone, Debug, PartialEq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By their logarithm. The range must be above zero.
    Logarithmic,
    /// Evenly, with these names at these places in place of numbers.
    Named(Vec<(f64, String)>),
}

/// One axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Lowest and highest value shown.
    pub range: [f64; 2],
    /// How values become places.
    pub scale: Scale,
}

/// What is drawn for some values.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A line through points; one that is not finite breaks it.
    Line(Vec<[f64; 2]>),
    /// The same, dashed.
    Dashes(Vec<[f64; 2]>),
    /// An area: x, low, high.
    Band(Vec<[f64; 3]>),
    /// Separate points.
    Dots(Vec<[f64; 2]>),
    /// Open circles, to point something out.
    Rings(Vec<[f64; 2]>),
    /// Bars from zero to each point, this wide.
    Bars(f64, Vec<[f64; 2]>),
}

/// Some values, their colour and their name in the legend. The same name in several panels shows once.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// For the legend; empty for none.
    pub name: &'static str,
    /// As SVG writes it.
    pub colour: &'static str,
    /// What is drawn.
    pub shape: Shape,
}

/// One panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Above it.
    pub title: String,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// In the order they are drawn.
    pub marks: Vec<Mark>,
}

/// A chart.
///
/// ```
/// use stampfly_lab::chart::{Axis, BLUE, Chart, Mark, Panel, Shape};
///
/// let line = Mark { name: "parabola", colour: BLUE, shape: Shape::Line(vec![[0.0, 0.0], [1.0, 1.0], [2.0, 4.0]]) };
/// let panel = Panel {
///     title: "Squares".to_owned(),
///     x: Axis::linear("x, m", [0.0, 2.0]),
///     y: Axis::linear("x², m²", [0.0, 4.0]),
///     marks: vec![line],
/// };
/// let chart = Chart { title: "Growth".to_owned(), columns: 1, size: [300.0, 200.0], panels: vec![panel] };
/// let svg = chart.to_svg();
/// assert!(svg.starts_with("<svg") && svg.contains("parabola") && svg.contains("<polyline"));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Above everything.
    pub title: String,
    /// Panels in a row.
    pub columns: usize,
    /// Width and height of a panel, pixels.
    pub size: [f64; 2],
    /// Row by row.
    pub panels: Vec<Panel>,
}

impl Axis {
    /// An axis with numbers at even distances.
    #[must_use]
    pub fn linear(label: impl Into<String>, range: [f64; 2]) -> Self {
        Self { label: label.into(), range, scale: Scale::Linear }
    }

    /// Place of a value on an axis that is `length` long.
    fn place(&self, value: f64, length: f64) -> f64 {
        let [low, high] = self.range;
        match self.scale {
            Scale::Logarithmic => length * libm::log(value / low) / libm::log(high / low),
            _ => length * (value - low) / (high - low),
        }
    }

    /// Values with a number or a name, and that.
    fn ticks(&self) -> Vec<(f64, String)> {
        let [low, high] = self.range;
        match &self.scale {
            Scale::Named(names) => names.clone(),
            Scale::Logarithmic => {
                let few = high / low > 150.0;
                steps(1e-9)
                    .skip_while(|(step, ..)| *step < low * 0.999)
                    .take_while(|(step, ..)| *step <= high * 1.001)
                    .filter(|(_, first, _)| *first || !few)
                    .map(|(step, _, decimals)| (step, magnitude(step, decimals)))
                    .collect()
            }
            Scale::Linear => {
                let Some((step, _, decimals)) = steps(1e-9).find(|(step, ..)| (high - low) / step <= MOST_TICKS) else {
                    return Vec::new();
                };
                let first = (low / step - 1e-6).ceil() as i64;
                let last = (high / step + 1e-6).floor() as i64;
                (first..=last).map(|n| (n as f64 * step, number(n as f64 * step, decimals))).collect()
            }
        }
    }
}

/// 1, 2, 5, 10, …, from a power of ten on, each with whether it is a power of ten and the decimals it needs.
fn steps(from: f64) -> impl Iterator<Item = (f64, bool, usize)> {
    let decimals = |power: i32| usize::try_from(-power).unwrap_or(0);
    let first = libm::round(libm::log10(from)) as i32;
    (first..=12).flat_map(move |power| {
        [1.0, 2.0, 5.0].map(|digit| (digit * libm::pow(10.0, f64::from(power)), digit == 1.0, decimals(power)))
    })
}

fn number(value: f64, decimals: usize) -> String {
    // Minus zero is zero.
    format!("{:.decimals$}", value + 0.0).replace('-', "−")
}

/// A number above zero with one digit that is not zero, short.
fn magnitude(value: f64, decimals: usize) -> String {
    if decimals < 4 {
        return number(value, decimals);
    }
    let power: String =
        decimals.to_string().chars().filter_map(|c| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(c.to_digit(10)? as usize)).collect();
    match libm::round(value * libm::pow(10.0, decimals as f64)) as u8 {
        1 => format!("10⁻{power}"),
        digit => format!("{digit}·10⁻{power}"),
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

impl Chart {
    /// The picture.
    #[must_use]
    pub fn to_svg(&self) -> String {
        let columns = self.columns.max(1);
        let rows = self.panels.len().div_ceil(columns);
        let span = |count: usize, axis: usize| count as f64 * (self.size[axis] + GAP[axis]) - GAP[axis];
        let [left, top, right, bottom] = MARGIN;
        let (width, height) = (left + span(columns, 0) + right, top + span(rows, 1) + bottom);
        let mut svg = String::new();
        let mut put = |line: String| {
            // Writing to a string cannot fail.
            let _ = writeln!(svg, "{line}");
        };
        put(format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" font-family="Helvetica, Arial, sans-serif" font-size="12" fill="#333">"##
        ));
        put(format!("<title>{}</title>", escape(&self.title)));
        put(format!(r##"<rect width="{width}" height="{height}" fill="#fff"/>"##));
        put(format!(r#"<text x="{left}" y="24" font-size="16" font-weight="bold">{}</text>"#, escape(&self.title)));
        self.legend(&mut put);
        for (index, panel) in self.panels.iter().enumerate() {
            let x = left + (index % columns) as f64 * (self.size[0] + GAP[0]);
            let y = top + (index / columns) as f64 * (self.size[1] + GAP[1]);
            put(format!(r#"<g transform="translate({x} {y})">"#));
            panel.draw(self.size, index, &mut put);
            put("</g>".to_owned());
        }
        put("</svg>".to_owned());
        svg
    }

    fn legend(&self, put: &mut impl FnMut(String)) {
        let mut shown: Vec<&str> = Vec::new();
        let mut x = MARGIN[0];
        for mark in self.panels.iter().flat_map(|panel| &panel.marks) {
            if mark.name.is_empty() || shown.contains(&mark.name) {
                continue;
            }
            shown.push(mark.name);
            let colour = mark.colour;
            put(match mark.shape {
                Shape::Line(_) => format!(r#"<path d="M{x} 42h20" stroke="{colour}" stroke-width="2.5"/>"#),
                Shape::Dashes(_) => {
                    format!(r#"<path d="M{x} 42h20" stroke="{colour}" stroke-width="2" stroke-dasharray="5 3"/>"#)
                }
                Shape::Dots(_) => format!(r#"<circle cx="{}" cy="42" r="3" fill="{colour}"/>"#, x + 10.0),
                Shape::Rings(_) => {
                    format!(
                        r#"<circle cx="{}" cy="42" r="5" fill="none" stroke="{colour}" stroke-width="2"/>"#,
                        x + 10.0
                    )
                }
                Shape::Band(_) => {
                    format!(r#"<rect x="{x}" y="37" width="20" height="10" fill="{colour}" fill-opacity="0.25"/>"#)
                }
                Shape::Bars(..) => format!(r#"<rect x="{x}" y="37" width="20" height="10" fill="{colour}"/>"#),
            });
            put(format!(r#"<text x="{}" y="46">{}</text>"#, x + 26.0, escape(mark.name)));
            // Some pixels a letter: text cannot be measured here.
            x += 46.0 + 6.2 * mark.name.chars().count() as f64;
        }
    }
}

impl Panel {
    fn draw(&self, [width, height]: [f64; 2], index: usize, put: &mut impl FnMut(String)) {
        let x = |value: f64| self.x.place(value, width);
        let y = |value: f64| height - self.y.place(value, height);
        put(format!(r#"<text x="0" y="-8" font-weight="bold">{}</text>"#, escape(&self.title)));
        for (value, name) in self.x.ticks() {
            let x = x(value);
            if !matches!(self.x.scale, Scale::Named(_)) {
                put(format!(r##"<path d="M{x:.1} 0v{height}" stroke="#e4e4e4"/>"##));
            }
            put(format!(r#"<text x="{x:.1}" y="{}" text-anchor="middle">{}</text>"#, height + 16.0, escape(&name)));
        }
        for (value, name) in self.y.ticks() {
            let y = y(value);
            put(format!(r##"<path d="M0 {y:.1}h{width}" stroke="#e4e4e4"/>"##));
            put(format!(r#"<text x="-6" y="{:.1}" text-anchor="end">{}</text>"#, y + 4.0, escape(&name)));
        }
        put(format!(r#"<clipPath id="panel{index}"><rect width="{width}" height="{height}"/></clipPath>"#));
        put(format!(r#"<g clip-path="url(#panel{index})">"#));
        for mark in &self.marks {
            mark.draw(&x, &y, put);
        }
        put("</g>".to_owned());
        put(format!(r##"<rect width="{width}" height="{height}" fill="none" stroke="#999"/>"##));
        put(format!(
            r#"<text x="{}" y="{}" text-anchor="middle">{}</text>"#,
            0.5 * width,
            height + 34.0,
            escape(&self.x.label)
        ));
        put(format!(
            r#"<text transform="translate(-52 {}) rotate(-90)" text-anchor="middle">{}</text>"#,
            0.5 * height,
            escape(&self.y.label)
        ));
    }
}

impl Mark {
    fn draw(&self, x: &impl Fn(f64) -> f64, y: &impl Fn(f64) -> f64, put: &mut impl FnMut(String)) {
        let colour = self.colour;
        let pairs = |points: &[[f64; 2]]| {
            let pairs: Vec<String> = points.iter().map(|[a, b]| format!("{:.1},{:.1}", x(*a), y(*b))).collect();
            pairs.join(" ")
        };
        match &self.shape {
            Shape::Line(points) | Shape::Dashes(points) => {
                let dashes = if matches!(self.shape, Shape::Dashes(_)) {
                    r#" stroke-dasharray="5 3""#
                } else {
                    Default::default()
                };
                for part in points.split(|point| !point.iter().all(|value| value.is_finite())) {
                    if !part.is_empty() {
                        put(format!(
                            r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="1.4" stroke-linejoin="round"{dashes}/>"#,
                            pairs(part)
                        ));
                    }
                }
            }
            Shape::Band(band) => {
                let low = band.iter().map(|[x, low, _]| [*x, *low]);
                let high = band.iter().rev().map(|[x, _, high]| [*x, *high]);
                let around: Vec<[f64; 2]> = low.chain(high).collect();
                put(format!(r#"<polygon points="{}" fill="{colour}" fill-opacity="0.25"/>"#, pairs(&around)));
            }
            Shape::Dots(points) => {
                for [a, b] in points {
                    put(format!(r#"<circle cx="{:.1}" cy="{:.1}" r="1.6" fill="{colour}"/>"#, x(*a), y(*b)));
                }
            }
            Shape::Rings(points) => {
                for [a, b] in points {
                    put(format!(
                        r#"<circle cx="{:.1}" cy="{:.1}" r="5" fill="none" stroke="{colour}" stroke-width="2"/>"#,
                        x(*a),
                        y(*b)
                    ));
                }
            }
            Shape::Bars(wide, points) => {
                for [a, b] in points {
                    let (begin, end, top, foot) = (x(a - 0.5 * wide), x(a + 0.5 * wide), y(*b), y(0.0));
                    put(format!(
                        r#"<rect x="{begin:.1}" y="{top:.1}" width="{:.1}" height="{:.1}" fill="{colour}"/>"#,
                        end - begin,
                        foot - top
                    ));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.ticks().into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_round_numbers_inside_the_range() {
        assert_eq!(labels(&Axis::linear("", [-0.11, 0.1])), ["−0.10", "−0.05", "0.00", "0.05", "0.10"]);
        assert_eq!(labels(&Axis::linear("", [0.0, 31.0])), ["0", "10", "20", "30"]);
        let frequency = Axis { scale: Scale::Logarithmic, ..Axis::linear("Hz", [4.0, 200.0]) };
        assert_eq!(labels(&frequency), ["5", "10", "20", "50", "100", "200"]);
        assert_eq!(labels(&Axis { range: [1e-5, 1e-4], ..frequency.clone() }), ["10⁻⁵", "2·10⁻⁵", "5·10⁻⁵", "10⁻⁴"]);
        let wide = Axis { range: [0.001, 1.0], ..frequency };
        assert_eq!(labels(&wide), ["0.001", "0.01", "0.1", "1"]);
        assert!((wide.place(0.1, 300.0) - 200.0).abs() < 1e-9);
    }

    #[test]
    fn a_gap_breaks_a_line_and_text_is_escaped() {
        let shape = Shape::Line(vec![[0.0, 0.0], [1.0, f64::NAN], [2.0, 1.0], [3.0, 1.0]]);
        let panel = Panel {
            title: "a < b".to_owned(),
            x: Axis::linear("", [0.0, 3.0]),
            y: Axis::linear("", [0.0, 1.0]),
            marks: vec![Mark { name: "", colour: RED, shape }],
        };
        let chart = Chart { title: String::new(), columns: 1, size: [90.0, 90.0], panels: vec![panel] };
        let svg = chart.to_svg();
        assert!(svg.contains("a &lt; b") && !svg.contains("NaN"));
        assert_eq!(svg.matches("<polyline").count(), 2);
        assert_eq!(svg, chart.to_svg());
    }
}
