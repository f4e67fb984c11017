//! A flight as one HTML page: the path in space, plots on a shared time axis, events and figures.
//!
//! The page is a single file without any reference to the outside: it opens from a disk, offline, and can be sent by
//! mail. A minute of flight takes about a megabyte. Topics that a flight does not have leave their panels out.
//!
//! Samples are brought onto one time grid of at most 100 Hz and 16 bits, which is what a screen can show. For
//! numbers to calculate with, use the [`Flight`].

mod grid;
mod page;
mod panels;

pub(crate) use page::escape;

use stampfly_lab::Flight;
use stampfly_sim::vehicle::Page;

/// One line of the summary.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Metric {
    /// What was measured.
    pub name: String,
    /// The figure, formatted.
    pub value: String,
    /// Its unit, or nothing.
    pub unit: String,
    /// Did it meet its limit, if it has one?
    pub passed: Option<bool>,
}

impl Metric {
    /// A figure without a limit.
    pub fn new(name: impl Into<String>, value: impl ToString, unit: impl Into<String>) -> Self {
        Self { name: name.into(), value: value.to_string(), unit: unit.into(), passed: None }
    }

    /// The same figure, judged.
    #[must_use]
    pub fn judged(self, passed: bool) -> Self {
        Self { passed: Some(passed), ..self }
    }
}

/// What goes into a page.
///
/// ```
/// use stampfly_host::{Report, report::Metric};
/// use stampfly_lab::Flight;
/// use stampfly_board::simulation::PAGE;
/// use stampfly_types::{Instant, messages::StateEstimate};
///
/// let mut flight = Flight::default();
/// for step in 0..100 {
///     flight.push("estimate_state", Instant::from_millis(step * 10), &StateEstimate::default());
/// }
/// let report = Report {
///     title: "Hover".to_owned(),
///     subtitle: "one second on the ground".to_owned(),
///     metrics: vec![Metric::new("Drift", "0.00", "m").judged(true)],
///     page: &PAGE,
///     flight: &flight,
/// };
/// let html = report.html();
/// assert!(html.starts_with("<!doctype html>") && html.contains("Drift"));
/// ```
#[derive(Clone, Debug)]
pub struct Report<'a> {
    /// The page's heading.
    pub title: String,
    /// A line below it: where the flight comes from.
    pub subtitle: String,
    /// The summary, in order.
    pub metrics: Vec<Metric>,
    /// What the vehicle wants to be shown of it.
    pub page: &'static Page,
    /// The flight.
    pub flight: &'a Flight,
}
