//! Layout of the page about a flight: plots, states over time, and the vehicle's body.
//!
//! Data only: it names topics and columns. Topics that a flight does not contain are skipped.
//! Topics not named here get a plot per unit, so a page is never empty.

use stampfly_types::messages::CalibrationKind;

/// Layout of the page.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Page {
    /// Topics with the vehicle's position, the main one first.
    pub observers: &'static [Observer],
    /// Topic with the position setpoint; its column `axes` masks inactive axes.
    pub setpoint: Option<&'static str>,
    /// Plots in addition to those of position, velocity and attitude.
    pub panels: &'static [PanelSpec],
    /// State bands over time: topic, column with named values, title.
    pub bands: &'static [(&'static str, &'static str, &'static str)],
    /// Topic and column of the alert set.
    pub alerts: Option<(&'static str, &'static str)>,
    /// Calibrations offered, and the console line that starts each.
    pub calibrations: &'static [(CalibrationKind, &'static str)],
    /// Shape of the vehicle.
    pub body: Body,
}

impl Page {
    /// No layout: a plot per topic and unit.
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

/// A topic with the vehicle's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer {
    /// The topic.
    pub topic: &'static str,
    /// Name of the colour: `estimate`, `truth`, `device`.
    pub role: &'static str,
    /// Name in the legend.
    pub name: &'static str,
    /// Format of its columns.
    pub motion: Motion,
}

/// Format of a position topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Columns `position`, `velocity` (north, east, down) and `attitude` (body to earth).
    Space,
    /// Motion on level ground: columns `x` forward of the start, `y` left of it, `yaw`
    /// counter-clockwise.
    Plane,
}

/// One plot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanelSpec {
    /// Heading of its group.
    pub group: &'static str,
    /// Title.
    pub title: &'static str,
    /// Unit after multiplication by `factor`.
    pub unit: &'static str,
    /// Topic of its lines.
    pub topic: &'static str,
    /// Column and name of each line.
    pub lines: &'static [(&'static str, &'static str)],
    /// Factor on all values.
    pub factor: f64,
    /// Reduction of several samples to one point.
    pub pick: Pick,
    /// Limit line. With a limit the plot is logarithmic.
    pub limit: Option<f64>,
}

impl PanelSpec {
    /// A plot of these columns of a topic: newest values, factor 1.
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

    /// Multiplies the values by a factor.
    #[must_use]
    pub const fn times(self, factor: f64) -> Self {
        Self { factor, ..self }
    }

    /// Sets the reduction of samples.
    #[must_use]
    pub const fn picking(self, pick: Pick) -> Self {
        Self { pick, ..self }
    }

    /// Makes the plot logarithmic with a limit line.
    #[must_use]
    pub const fn limited(self, limit: f64) -> Self {
        Self { limit: Some(limit), ..self }
    }
}

/// Reduction of the samples between two points of a plot to one value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pick {
    /// The newest sample if it is fresh.
    Newest,
    /// The newest sample regardless of age: for states published on change.
    Latched,
    /// The mean: for fast and noisy signals.
    Mean,
    /// The sample farthest from zero: for peaks that must remain visible.
    Peak,
}

/// Shape of the vehicle in the body frame (forward, right, down), m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// Centres of rotors or wheels, drawn as rings.
    pub rings: &'static [[f32; 3]],
    /// Radius of a ring.
    pub radius: f32,
    /// Outline of the fuselage, forward and right.
    pub outline: &'static [[f32; 2]],
    /// Down coordinate of outline and rings: negative above the origin.
    pub down: f32,
    /// Length of the line that marks the nose.
    pub nose: f32,
    /// Half of the overall size; it scales the drawing.
    pub reach: f32,
}

impl Body {
    /// Nothing to draw.
    pub const NONE: Self = Self { rings: &[], radius: 0.0, outline: &[], down: 0.0, nose: 0.0, reach: 0.1 };
}
