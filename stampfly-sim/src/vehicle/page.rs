//! What a page about a flight shows of a vehicle: its plots, its states over time, and its body in space.
//!
//! All of it is data that names topics and columns. What a flight does not have is left out; topics that no line of this
//! names get a plot per unit, so that a page is never empty.

use stampfly_types::messages::CalibrationKind;

/// What a page shows of a vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Page {
    /// Topics that say where the vehicle is, the main one first.
    pub observers: &'static [Observer],
    /// The topic that says where it should be; its column `axes` masks the others.
    pub setpoint: Option<&'static str>,
    /// The plots beside those of position, velocity and attitude.
    pub panels: &'static [PanelSpec],
    /// States over time: topic, column with named values, title.
    pub bands: &'static [(&'static str, &'static str, &'static str)],
    /// The topic and column of a set of alerts.
    pub alerts: Option<(&'static str, &'static str)>,
    /// Calibrations that it offers, and the console line that begins each.
    pub calibrations: &'static [(CalibrationKind, &'static str)],
    /// What the vehicle looks like.
    pub body: Body,
}

impl Page {
    /// A plot per topic and unit.
    pub const EMPTY: Self = Self {
        observers: &[],
        setpoint: None,
        panels: &[],
        bands: &[],
        alerts: None,
        calibrations: &[],
        body: Body::NONE,
    };
}

/// A topic that says where the vehicle is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer {
    /// The topic.
    pub topic: &'static str,
    /// The colour's name: `estimate`, `truth`, `device`.
    pub role: &'static str,
    /// For the legend.
    pub name: &'static str,
    /// How its columns say it.
    pub motion: Motion,
}

/// How a topic says where the vehicle is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Columns `position`, `velocity` (north, east, down) and `attitude` (body to earth).
    Space,
    /// A vehicle on level ground: columns `x` forward of the start, `y` left of it, `yaw` counter-clockwise.
    Plane,
}

/// One plot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanelSpec {
    /// Heading under which it stands.
    pub group: &'static str,
    /// Title.
    pub title: &'static str,
    /// Unit after the lines' factors.
    pub unit: &'static str,
    /// The topic of its lines.
    pub topic: &'static str,
    /// Column and name of each line.
    pub lines: &'static [(&'static str, &'static str)],
    /// What the values are multiplied by.
    pub factor: f64,
    /// How several samples become one point.
    pub pick: Pick,
    /// A line that should not be crossed; the plot is logarithmic then.
    pub limit: Option<f64>,
}

impl PanelSpec {
    /// A plot of these columns of a topic: newest values, as they are.
    #[must_use]
    pub const fn new(
        group: &'static str,
        title: &'static str,
        unit: &'static str,
        topic: &'static str,
        lines: &'static [(&'static str, &'static str)],
    ) -> Self {
        Self { group, title, unit, topic, lines, factor: 1.0, pick: Pick::Newest, limit: None }
    }

    /// The same with values in another unit.
    #[must_use]
    pub const fn times(self, factor: f64) -> Self {
        Self { factor, ..self }
    }

    /// The same with another way to make one point of several samples.
    #[must_use]
    pub const fn picking(self, pick: Pick) -> Self {
        Self { pick, ..self }
    }

    /// The same, logarithmic, with a line at the limit.
    #[must_use]
    pub const fn limited(self, limit: f64) -> Self {
        Self { limit: Some(limit), ..self }
    }
}

/// How several samples, or none, between two points of a plot become one value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pick {
    /// The newest one, as long as it is fresh.
    Newest,
    /// The newest one, however old: for states that are published when they change.
    Latched,
    /// The mean, for fast and noisy signals.
    Mean,
    /// The one farthest from zero: for what must not be overlooked.
    Peak,
}

/// The vehicle in space: body frame forward, right, down, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// Centres of rotors or wheels, drawn as rings.
    pub rings: &'static [[f32; 3]],
    /// Radius of a ring.
    pub radius: f32,
    /// Outline of the middle, forward and right.
    pub outline: &'static [[f32; 2]],
    /// Height of outline and rings above the origin, as a negative number.
    pub down: f32,
    /// How far the line that points forward reaches.
    pub nose: f32,
    /// Half the size of it all: how large it is drawn.
    pub reach: f32,
}

impl Body {
    /// Nothing to draw.
    pub const NONE: Self = Self { rings: &[], radius: 0.0, outline: &[], down: 0.0, nose: 0.0, reach: 0.1 };
}
