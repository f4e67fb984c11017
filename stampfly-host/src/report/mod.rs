//! A flight as one HTML page: the path in space, plots on a shared time axis, events and figures.
//!
//! The page is a single file without any reference to the outside. A minute of flight takes about a megabyte. Topics that a flight does not have leave their panels out.
//!
//! Samples are brought onto one time grid of at most 100 Hz and 16 bits, which is what a screen can show. For
//! numbers to calculate with, use the [`Flight`].

mod grid;
mod page;
mod panels;

pub use crate::page::Metric;

use crate::Flight;
use stampfly_sim::vehicle::Page;

/// What goes into a page.
///
/// ```
/// use stampfly_host::{Report, report::Metric};
/// use stampfly_host::Flight;
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
