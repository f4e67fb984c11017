//! Lines of a [`status`](super::Vehicle::status) that vehicles have in common. They end with a carriage return and a line feed.

use core::fmt;
use stampfly_types::Instant;
use stampfly_types::messages::ArmRefusals;

/// The last time the vehicle did not arm although it was asked to, and why; `at` is when it was told.
///
/// # Errors
/// When `reply` does not take it.
pub fn refused(reply: &mut dyn fmt::Write, now: Instant, at: Instant, refusals: &ArmRefusals) -> fmt::Result {
    write!(reply, "refused  {} times to arm, last {} s ago\r\n", refusals.attempts, now.since(at).as_millis() / 1_000)?;
    let entries = refusals.check.iter().zip(&refusals.value).zip(&refusals.limit).zip(&refusals.since);
    for (((check, value), limit), since) in entries.filter(|(((check, ..), _), _)| !check.is_empty()) {
        reply.write_str("        ")?;
        for name in check.names() {
            write!(reply, " {name}")?;
        }
        if *limit != 0.0 {
            write!(reply, " {value:.2}, limit {limit:.2},")?;
        }
        write!(reply, " for {} ms\r\n", at.since(*since).as_millis())?;
    }
    Ok(())
}

/// A line of names, or none.
///
/// # Errors
/// When `reply` does not take it.
pub fn list(reply: &mut dyn fmt::Write, what: &str, mut names: impl Iterator<Item = &'static str>) -> fmt::Result {
    write!(reply, "{what:<9}{}", names.next().unwrap_or("none"))?;
    names.try_for_each(|name| write!(reply, " {name}"))?;
    reply.write_str("\r\n")
}
