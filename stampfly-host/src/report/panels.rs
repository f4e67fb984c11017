//! What there is to see: which topics and columns make which plot, band and path.
//!
//! Everything that depends on the flight is decided here; the script of the page only draws.

use super::grid::{Channel, Grid, Pick};
use serde::Serialize;
use stampfly_lab::flight::{Flight, Series};
use stampfly_types::messages::SetpointAxes;
use stampfly_types::{Quat, frame};

/// One plot.
#[derive(Serialize)]
pub(super) struct Panel {
    group: &'static str,
    title: String,
    unit: &'static str,
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
}

/// The three who may know where the vehicle is, and the one that says where it should be.
const OBSERVERS: [(&str, &str, &str); 3] =
    [("estimate_state", "estimate", "estimate"), ("truth", "truth", "truth"), ("device", "device", "on board")];

const DEGREES: f64 = 180.0 / std::f64::consts::PI;

impl<'a> Builder<'a> {
    pub(super) fn new(flight: &'a Flight, grid: Grid) -> Self {
        Self { flight, grid, channels: Vec::new(), panels: Vec::new() }
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
    fn panel(&mut self, group: &'static str, title: impl Into<String>, unit: &'static str, lines: Vec<Option<Line>>) {
        let lines: Vec<Line> = lines.into_iter().flatten().collect();
        if !lines.is_empty() {
            self.panels.push(Panel { group, title: title.into(), unit, limit: None, logarithmic: false, lines });
        }
    }

    /// Several columns of one topic in one plot, numbered colours.
    fn columns_panel(
        &mut self,
        group: &'static str,
        title: &str,
        unit: &'static str,
        topic: &str,
        columns: &[(&str, &str)],
        (factor, pick): (f64, Pick),
    ) {
        let lines = columns.iter().enumerate();
        let lines = lines.map(|(role, (column, name))| self.column((topic, column), name, role, factor, pick));
        let lines = lines.collect();
        self.panel(group, title, unit, lines);
    }

    /// Roll, pitch and yaw of a topic's attitude on the grid, degrees.
    fn angles(&self, topic: &str) -> Option<[Vec<f64>; 3]> {
        let series = self.series(topic)?;
        let parts = series.columns_of::<4>("attitude")?;
        let [w, x, y, z] = parts.map(|column| self.grid.resample(series, column, Pick::Newest));
        let mut angles = [const { Vec::new() }; 3];
        for (((w, x), y), z) in w.into_iter().zip(x).zip(y).zip(z) {
            let quaternion = nalgebra::Quaternion::new(w as f32, x as f32, y as f32, z as f32);
            let seen = quaternion.coords.iter().all(|value| value.is_finite());
            let attitude = Quat::new_unchecked(quaternion);
            let euler = if seen { frame::roll_pitch_yaw(&attitude) } else { [f32::NAN; 3] };
            angles.iter_mut().zip(euler).for_each(|(values, angle)| values.push(f64::from(angle) * DEGREES));
        }
        Some(angles)
    }

    /// A vector of the set-point on the grid, where its axes are commanded.
    fn commanded(&self, field: &str, axes: [SetpointAxes; 3]) -> Option<[Vec<f64>; 3]> {
        let series = self.series("setpoint")?;
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
        let observed: Vec<_> = OBSERVERS.iter().filter_map(|(topic, ..)| Some((*topic, self.angles(topic)?))).collect();
        let heading = self.series("setpoint").and_then(|series| {
            let masked = series.column("yaw")?.iter().zip(series.column("axes")?);
            let masked = masked.map(|(yaw, bits)| match *bits as u32 & SetpointAxes::YAW.bits() {
                0 => f64::NAN,
                _ => yaw * DEGREES,
            });
            Some(self.grid.resample(series, &masked.collect::<Vec<_>>(), Pick::Newest))
        });
        for (axis, title) in ["Roll", "Pitch", "Yaw"].into_iter().enumerate() {
            let mut lines = Vec::new();
            for (topic, angles) in &observed {
                let (_, role, name) = observer(topic);
                lines.push(self.line(name, role, &angles[axis]));
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
            for (topic, role, name) in OBSERVERS {
                lines.push(self.column((topic, &format!("{field}[{axis}]")), name, role, factor, Pick::Newest));
            }
            if let Some(commanded) = &commanded {
                let values: Vec<f64> = commanded[axis].iter().map(|value| value * factor).collect();
                lines.push(self.line("set-point", "setpoint", &values));
            }
            if axis == 2 && field == "position" {
                lines.push(self.column(("sensor_tof", "distance"), "range", "range", 1.0, Pick::Newest));
            }
            self.panel(group, title, unit, lines);
        }
    }

    /// Every plot there can be, in the order of the page.
    pub(super) fn all_panels(&mut self) {
        use Pick::{Mean, Newest, Peak};
        self.attitude_panels();
        let (xy, z) = (SetpointAxes::POSITION_XY, SetpointAxes::POSITION_Z);
        self.vector_panels("Position", "m", "position", [xy, xy, z]);
        let (xy, z) = (xy | SetpointAxes::VELOCITY_XY, z | SetpointAxes::VELOCITY_Z);
        self.vector_panels("Velocity", "m/s", "velocity", [xy, xy, z]);

        let motors = self.series("actuator_motor").and_then(|series| series.column("count")?.last().copied());
        let motors: Vec<_> = (0..motors.unwrap_or(0.0) as usize)
            .map(|motor| {
                self.column(
                    ("actuator_motor", &format!("duty[{motor}]")),
                    &format!("M{}", motor + 1),
                    motor,
                    100.0,
                    Mean,
                )
            })
            .collect();
        self.panel("Actuators", "Motor duty", "%", motors);
        let thrust = self.column(("control_output", "thrust"), "thrust", 0, 1.0, Mean);
        self.panel("Actuators", "Thrust demand", "N", vec![thrust]);
        let axes = [("torque[0]", "roll"), ("torque[1]", "pitch"), ("torque[2]", "yaw")];
        self.columns_panel("Actuators", "Torque demand", "mN·m", "control_output", &axes, (1e3, Mean));

        let ranges = [("tof_innovation", "range"), ("baro_innovation", "baro")];
        self.columns_panel("Estimator", "Innovation, height", "m", "estimate_status", &ranges, (1.0, Peak));
        let flows = [("flow_innovation[0]", "forward"), ("flow_innovation[1]", "right")];
        self.columns_panel("Estimator", "Innovation, flow", "m/s", "estimate_status", &flows, (1.0, Peak));
        let angles = [("mag_innovation", "heading"), ("accel_innovation", "gravity")];
        self.columns_panel("Estimator", "Innovation, angles", "°", "estimate_status", &angles, (DEGREES, Peak));
        let ratios = ["tof", "flow", "baro", "mag", "accel"].map(|sensor| (format!("{sensor}_ratio"), sensor));
        let ratios: Vec<_> = ratios.iter().map(|(column, name)| (column.as_str(), *name)).collect();
        let before = self.panels.len();
        self.columns_panel("Estimator", "Test ratio", "", "estimate_status", &ratios, (1.0, Peak));
        if let Some(panel) = self.panels.get_mut(before) {
            panel.limit = Some(1.0);
            panel.logarithmic = true;
        }

        let vector = |field: &str| ["x", "y", "z"].map(|axis| (field.to_owned(), axis));
        for (title, unit, field, factor) in
            [("Angular rate", "°/s", "gyro", DEGREES), ("Specific force", "m/s²", "accel", 1.0)]
        {
            let lines = vector(field).into_iter().enumerate();
            let lines = lines.map(|(axis, (field, name))| {
                self.column(("sensor_imu", &format!("{field}[{axis}]")), name, axis, factor, Mean)
            });
            let lines = lines.collect();
            self.panel("Sensors", title, unit, lines);
        }
        let axes = [("field[0]", "x"), ("field[1]", "y"), ("field[2]", "z")];
        self.columns_panel("Sensors", "Magnetic field", "µT", "sensor_mag", &axes, (1.0, Newest));
        let angles = [("delta_x", "forward"), ("delta_y", "right")];
        self.columns_panel("Sensors", "Flow per sample", "mrad", "sensor_flow", &angles, (1e3, Mean));
        self.columns_panel(
            "Sensors",
            "Barometric altitude",
            "m",
            "sensor_baro",
            &[("altitude", "baro")],
            (1.0, Newest),
        );
        self.columns_panel("Battery", "Voltage", "V", "sensor_power", &[("voltage", "voltage")], (1.0, Newest));
        self.columns_panel("Battery", "Current", "A", "sensor_power", &[("current", "current")], (1.0, Newest));
    }

    /// Who moves through space, the estimate first.
    pub(super) fn scene(&mut self) -> Vec<Actor> {
        let mut actors = Vec::new();
        for (topic, role, _) in OBSERVERS {
            let Some(series) = self.series(topic) else { continue };
            let position = series
                .columns_of::<3>("position")
                .map(|columns| columns.map(|c| self.grid.resample(series, c, Pick::Newest)));
            let attitude = series
                .columns_of::<4>("attitude")
                .map(|columns| columns.map(|c| self.grid.resample(series, c, Pick::Newest)));
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
        let states = [
            ("system_mode", "state", "State"),
            ("system_mode", "mode", "Mode"),
            ("command_setpoint", "source", "Command"),
        ];
        for (topic, column, title) in states {
            let names = self.series(topic).map(|series| series.names(column)).unwrap_or_default();
            let name = |number: u32| {
                let known = names.iter().find(|(_, known)| *known == number);
                known.map_or_else(|| number.to_string(), |(name, _)| name.clone())
            };
            let stretches: Vec<_> =
                self.stretches(topic, column).into_iter().map(|(a, b, n)| (a, b, name(n), n)).collect();
            if !stretches.is_empty() {
                bands.push(Band { title: title.to_owned(), alert: false, stretches });
            }
        }
        let alerts = self.stretches("system_alert", "active");
        let names = self.series("system_alert").map(|series| series.names("active")).unwrap_or_default();
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

/// The row of [`OBSERVERS`] with this topic.
fn observer(topic: &str) -> (&'static str, &'static str, &'static str) {
    OBSERVERS.into_iter().find(|(known, ..)| *known == topic).unwrap_or(("", "0", ""))
}
