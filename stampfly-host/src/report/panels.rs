//! What there is to see: which topics and columns make which plot, band and path.
//!
//! Everything that depends on the flight is decided here; the script of the page only draws.

use super::grid::{Channel, Grid};
use crate::flight::{Column, Flight, Series};
use serde::Serialize;
use stampfly_log::trace::TOPIC_PREFIX;
use stampfly_sim::vehicle::{Motion, Observer, Page, PanelSpec, Pick};
use stampfly_types::messages::SetpointAxes;
use stampfly_types::{Quat, frame, math};

/// One plot.
#[derive(Serialize)]
pub(super) struct Panel {
    group: &'static str,
    title: String,
    unit: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<f64>,
    logarithmic: bool,
    lines: Vec<Line>,
}

/// One line of a plot.
#[derive(Serialize)]
pub(super) struct Line {
    name: String,
    /// Names the colour: `estimate`, `truth`, `setpoint`, `device` or a number.
    role: String,
    channel: usize,
}

/// A state over time, as coloured stretches with names.
#[derive(Serialize)]
pub(super) struct Band {
    title: String,
    /// Alerts are red, states have a colour each.
    alert: bool,
    /// From, to, name, number.
    stretches: Vec<(f64, f64, String, u32)>,
}

/// Something that moves through space: channels of position and attitude.
#[derive(Serialize)]
pub(super) struct Actor {
    role: &'static str,
    position: Option<[usize; 3]>,
    attitude: Option<[usize; 4]>,
}

/// Collects channels while the page is put together.
pub(super) struct Builder<'a> {
    flight: &'a Flight,
    grid: Grid,
    pub(super) channels: Vec<Channel>,
    pub(super) panels: Vec<Panel>,
    page: &'static Page,
}

const DEGREES: f64 = 180.0 / std::f64::consts::PI;
/// The column that numbers a topic's samples.
const GENERATION: &str = "generation";

impl<'a> Builder<'a> {
    pub(super) fn new(flight: &'a Flight, page: &'static Page, grid: Grid) -> Self {
        Self { flight, grid, channels: Vec::new(), panels: Vec::new(), page }
    }

    fn series(&self, topic: &str) -> Option<&'a Series> {
        self.flight.topics.get(topic)
    }

    fn channel(&mut self, values: &[f64]) -> Option<usize> {
        self.channels.push(Channel::pack(values)?);
        Some(self.channels.len() - 1)
    }

    /// A line of these values, if there are any.
    fn line(&mut self, name: impl Into<String>, role: impl ToString, values: &[f64]) -> Option<Line> {
        Some(Line { name: name.into(), role: role.to_string(), channel: self.channel(values)? })
    }

    /// A line of one column, times a factor.
    fn column(
        &mut self,
        (topic, column): (&str, &str),
        name: &str,
        role: impl ToString,
        factor: f64,
        pick: Pick,
    ) -> Option<Line> {
        let series = self.series(topic)?;
        let values = self.grid.resample(series, series.column(column)?, pick);
        let values: Vec<f64> = values.into_iter().map(|value| value * factor).collect();
        self.line(name, role, &values)
    }

    /// A plot of the lines there are; none if there are none.
    fn panel(
        &mut self,
        group: &'static str,
        title: impl Into<String>,
        unit: impl Into<String>,
        lines: Vec<Option<Line>>,
    ) {
        let lines: Vec<Line> = lines.into_iter().flatten().collect();
        if !lines.is_empty() {
            let (title, unit) = (title.into(), unit.into());
            self.panels.push(Panel { group, title, unit, limit: None, logarithmic: false, lines });
        }
    }

    /// A plot as the vehicle wants it, numbered colours.
    fn spec(&mut self, spec: &PanelSpec) {
        let lines = spec.lines.iter().enumerate();
        let lines =
            lines.map(|(role, (column, name))| self.column((spec.topic, column), name, role, spec.factor, spec.pick));
        let lines = lines.collect();
        let before = self.panels.len();
        self.panel(spec.group, spec.title, spec.unit, lines);
        if let Some(panel) = self.panels.get_mut(before) {
            panel.limit = spec.limit;
            panel.logarithmic = spec.limit.is_some();
        }
    }

    /// A plot per topic and unit of everything that the vehicle's page does not mention. What only a replay needs is left
    /// out: the records of activations, and the number of each sample.
    fn unmentioned(&mut self) {
        let page = self.page;
        let mentioned = |topic: &str| {
            page.observers.iter().any(|observer| observer.topic == topic)
                || page.setpoint == Some(topic)
                || page.panels.iter().any(|panel| panel.topic == topic)
                || page.bands.iter().any(|(of, ..)| *of == topic)
                || page.alerts.is_some_and(|(of, _)| of == topic)
        };
        let flight = self.flight;
        let unmentioned = |topic: &str| !mentioned(topic) && !topic.starts_with(TOPIC_PREFIX);
        for (topic, series) in flight.topics.iter().filter(|(topic, _)| unmentioned(topic)) {
            let columns = || series.columns.iter().filter(|column| column.name != GENERATION);
            let mut units: Vec<String> = columns().map(|column| unit_of(series, column)).collect();
            units.sort();
            units.dedup();
            for unit in units {
                let columns = columns().filter(|column| unit_of(series, column) == unit).enumerate();
                let columns: Vec<_> = columns.map(|(role, column)| (role, column.name.clone())).collect();
                let lines = columns
                    .into_iter()
                    .map(|(role, name)| self.column((topic, &name), &name, role, 1.0, Pick::Latched))
                    .collect();
                self.panel("Topics", topic.replace('_', " "), unit, lines);
            }
        }
    }

    /// Roll, pitch and yaw of a topic's attitude on the grid, degrees.
    fn angles(&self, topic: &str) -> Option<[Vec<f64>; 3]> {
        let series = self.series(topic)?;
        let parts = series.columns_of::<4>("attitude")?;
        let [w, x, y, z] = parts.map(|column| self.grid.resample(series, column, Pick::Newest));
        let mut angles = [const { Vec::new() }; 3];
        for (((w, x), y), z) in w.into_iter().zip(x).zip(y).zip(z) {
            let attitude = Quat::try_from([w, x, y, z].map(|value| value as f32));
            let euler = attitude.map_or([f32::NAN; 3], |attitude| frame::roll_pitch_yaw(&attitude));
            angles.iter_mut().zip(euler).for_each(|(values, angle)| values.push(f64::from(angle) * DEGREES));
        }
        Some(angles)
    }

    /// A vector of the set-point on the grid, where its axes are commanded.
    fn commanded(&self, field: &str, axes: [SetpointAxes; 3]) -> Option<[Vec<f64>; 3]> {
        let series = self.series(self.page.setpoint?)?;
        let mask = series.column("axes")?;
        let columns = series.columns_of::<3>(field)?;
        let mut columns = columns.into_iter().zip(axes);
        Some(std::array::from_fn(|_| {
            let Some((values, axis)) = columns.next() else { return Vec::new() };
            let masked = values.iter().zip(mask);
            let masked = masked.map(|(value, bits)| if *bits as u32 & axis.bits() != 0 { *value } else { f64::NAN });
            self.grid.resample(series, &masked.collect::<Vec<_>>(), Pick::Newest)
        }))
    }

    fn attitude_panels(&mut self) {
        let observers = self.page.observers.iter();
        let observed: Vec<_> =
            observers.filter_map(|observer| Some((observer, self.angles(observer.topic)?))).collect();
        let heading = self.page.setpoint.and_then(|topic| self.series(topic)).and_then(|series| {
            let masked = series.column("yaw")?.iter().zip(series.column("axes")?);
            let masked = masked.map(|(yaw, bits)| match *bits as u32 & SetpointAxes::YAW.bits() {
                0 => f64::NAN,
                _ => yaw * DEGREES,
            });
            Some(self.grid.resample(series, &masked.collect::<Vec<_>>(), Pick::Newest))
        });
        for (axis, title) in ["Roll", "Pitch", "Yaw"].into_iter().enumerate() {
            let mut lines = Vec::new();
            for (observer, angles) in &observed {
                lines.push(self.line(observer.name, observer.role, &angles[axis]));
            }
            if let (2, Some(heading)) = (axis, &heading) {
                lines.push(self.line("set-point", "setpoint", heading));
            }
            self.panel("Attitude", title, "°", lines);
        }
    }

    /// Position or velocity: one plot per axis, height positive.
    fn vector_panels(&mut self, group: &'static str, unit: &'static str, field: &str, axes: [SetpointAxes; 3]) {
        let commanded = self.commanded(field, axes);
        for (axis, title) in ["North", "East", "Up"].into_iter().enumerate() {
            let factor = if axis == 2 { -1.0 } else { 1.0 };
            let mut lines = Vec::new();
            for Observer { topic, role, name, .. } in self.page.observers {
                lines.push(self.column((topic, &format!("{field}[{axis}]")), name, role, factor, Pick::Newest));
            }
            if let Some(commanded) = &commanded {
                let values: Vec<f64> = commanded[axis].iter().map(|value| value * factor).collect();
                lines.push(self.line("set-point", "setpoint", &values));
            }
            self.panel(group, title, unit, lines);
        }
    }

    /// Every plot there can be, in the order of the page.
    pub(super) fn all_panels(&mut self) {
        self.attitude_panels();
        let (xy, z) = (SetpointAxes::POSITION_XY, SetpointAxes::POSITION_Z);
        self.vector_panels("Position", "m", "position", [xy, xy, z]);
        let (xy, z) = (xy | SetpointAxes::VELOCITY_XY, z | SetpointAxes::VELOCITY_Z);
        self.vector_panels("Velocity", "m/s", "velocity", [xy, xy, z]);

        self.page.panels.iter().for_each(|spec| self.spec(spec));
        self.unmentioned();
    }

    /// Who moves through space, the estimate first.
    pub(super) fn scene(&mut self) -> Vec<Actor> {
        let mut actors = Vec::new();
        for Observer { topic, role, motion, .. } in self.page.observers {
            let Some(series) = self.series(topic) else { continue };
            let (position, attitude) = match motion {
                Motion::Space => {
                    let resampled = |column| self.grid.resample(series, column, Pick::Newest);
                    let position = series.columns_of::<3>("position").map(|columns| columns.map(resampled));
                    (position, series.columns_of::<4>("attitude").map(|columns| columns.map(resampled)))
                }
                Motion::Plane => self.in_plane(series).unzip(),
            };
            let position = position.and_then(|columns| self.all(columns));
            let attitude = attitude.and_then(|columns| self.all(columns));
            if position.is_some() || attitude.is_some() {
                actors.push(Actor { role, position, attitude });
            }
        }
        let (xy, z) = (SetpointAxes::POSITION_XY, SetpointAxes::POSITION_Z);
        if let Some(position) = self.commanded("position", [xy, xy, z]).and_then(|columns| self.all(columns)) {
            actors.push(Actor { role: "setpoint", position: Some(position), attitude: None });
        }
        actors
    }

    /// Position and attitude, as a vehicle in space would have them, of one that moves in a plane.
    fn in_plane(&self, series: &Series) -> Option<([Vec<f64>; 3], [Vec<f64>; 4])> {
        let column = |name| Some(self.grid.resample(series, series.column(name)?, Pick::Newest));
        let (x, y, yaw) = (column("x")?, column("y")?, column("yaw")?);
        // Left and counter-clockwise are positive there, right and clockwise here.
        let right = y.iter().map(|y| -y).collect();
        let level = vec![0.0; x.len()];
        let (sin, cos) = yaw
            .iter()
            .map(|yaw| {
                let (sin, cos) = math::sin_cos((-0.5 * yaw) as f32);
                (f64::from(sin), f64::from(cos))
            })
            .unzip();
        Some(([x, right, level.clone()], [cos, level.clone(), level, sin]))
    }

    /// All of these channels, or none.
    fn all<const N: usize>(&mut self, columns: [Vec<f64>; N]) -> Option<[usize; N]> {
        let channels: Vec<usize> = columns.iter().map_while(|values| self.channel(values)).collect();
        channels.try_into().ok()
    }

    /// Stretches of one value of a column.
    fn stretches(&self, topic: &str, column: &str) -> Vec<(f64, f64, u32)> {
        let Some((series, values)) = self.series(topic).and_then(|s| Some((s, s.column(column)?))) else {
            return vec![];
        };
        let mut stretches: Vec<(f64, f64, u32)> = Vec::new();
        for (at, value) in series.at.iter().zip(values) {
            let (at, value) = (at.seconds_f64(), *value as u32);
            match stretches.last_mut() {
                Some((_, end, last)) if *last == value => *end = at,
                last => {
                    if let Some((_, end, _)) = last {
                        *end = at;
                    }
                    stretches.push((at, at, value));
                }
            }
        }
        // The last state lasts to the end of the flight.
        if let Some(last) = stretches.last_mut() {
            last.1 = last.1.max(self.grid.start.seconds_f64() + (self.grid.points * self.grid.step) as f64 * 1e-6);
        }
        stretches
    }

    pub(super) fn bands(&self) -> Vec<Band> {
        let mut bands = Vec::new();
        for (topic, column, title) in self.page.bands {
            let names = self.series(topic).map(|series| series.names(column)).unwrap_or_default();
            let name = |number: u32| {
                let known = names.iter().find(|(_, known)| *known == number);
                known.map_or_else(|| number.to_string(), |(name, _)| name.clone())
            };
            let stretches: Vec<_> =
                self.stretches(topic, column).into_iter().map(|(a, b, n)| (a, b, name(n), n)).collect();
            if !stretches.is_empty() {
                bands.push(Band { title: (*title).to_owned(), alert: false, stretches });
            }
        }
        let Some((topic, column)) = self.page.alerts else { return bands };
        let alerts = self.stretches(topic, column);
        let names = self.series(topic).map(|series| series.names(column)).unwrap_or_default();
        for (name, bit) in names {
            let mut stretches: Vec<(f64, f64, String, u32)> = Vec::new();
            for (from, to, bits) in alerts.iter().filter(|(.., bits)| bits & bit != 0) {
                match stretches.last_mut() {
                    Some((_, end, ..)) if *end >= *from => *end = *to,
                    _ => stretches.push((*from, *to, String::new(), *bits)),
                }
            }
            if !stretches.is_empty() {
                let words = name.to_lowercase().replace('_', " ");
                bands.push(Band { title: words, alert: true, stretches });
            }
        }
        bands
    }
}

/// The unit of a column, empty where there is none or it is not known.
fn unit_of(series: &Series, column: &Column) -> String {
    series.meanings.get(&column.field).map(|meaning| meaning.unit.clone()).unwrap_or_default()
}
