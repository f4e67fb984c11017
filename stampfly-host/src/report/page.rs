//! The page itself: elements, style, script and data become one file.

use super::Report;
use super::grid::{Channel, Grid};
use super::panels::{Actor, Band, Builder, Panel};
use crate::page;
use serde::Serialize;
use stampfly_sim::vehicle::Body;
use std::io;
use std::path::Path;

/// The page's script, in the order its parts need each other.
const SCRIPT: &str = concat!(
    "'use strict';\n(() => {\n",
    include_str!("../page/base.js"),
    include_str!("../page/canvas.js"),
    include_str!("../page/scene.js"),
    include_str!("data.js"),
    include_str!("plots.js"),
    include_str!("space.js"),
    include_str!("player.js"),
    "})();\n",
);

#[derive(Serialize)]
struct Page {
    /// Seconds of the first point.
    start: f64,
    /// Seconds between points.
    step: f64,
    points: u64,
    channels: Vec<Channel>,
    panels: Vec<Panel>,
    bands: Vec<Band>,
    events: Vec<(f64, String)>,
    scene: Vec<Actor>,
    body: BodyShape,
}

/// What the vehicle looks like, for the script.
#[derive(Serialize)]
struct BodyShape {
    rings: &'static [[f32; 3]],
    radius: f32,
    outline: &'static [[f32; 2]],
    down: f32,
    nose: f32,
    reach: f32,
}

impl Report<'_> {
    /// The page.
    #[must_use]
    pub fn html(&self) -> String {
        let span = self.flight.span().unwrap_or_default();
        let grid = Grid::new(span);
        let mut builder = Builder::new(self.flight, self.page, grid);
        builder.all_panels();
        let scene = builder.scene();
        let Body { rings, radius, outline, down, nose, reach } = self.page.body;
        let data = Page {
            start: grid.start.seconds_f64(),
            step: grid.step as f64 * 1e-6,
            points: grid.points,
            bands: builder.bands(),
            events: self.flight.events.iter().map(|event| (event.at.seconds_f64(), event.text.clone())).collect(),
            scene,
            body: BodyShape { rings, radius, outline, down, nose, reach },
            channels: builder.channels,
            panels: builder.panels,
        };
        // Numbers, strings and lists always have a JSON form; `<` could end the script element they stand in.
        let data = serde_json::to_string(&data).unwrap_or_default().replace('<', "\\u003c");
        let body = format!(include_str!("page.html"), script = SCRIPT, data = data);
        page::html(&self.title, &self.subtitle, &self.metrics, include_str!("page.css"), &body)
    }

    /// Writes the page to a file.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> io::Result<()> {
        std::fs::write(path, self.html())
    }
}
