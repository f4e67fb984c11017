//! Every check that a vehicle can do by itself: drivers, self test, execution times, and what refuses to arm.

use super::finding::{Finding, Verdict};
use crate::console::{SensorLine, Vehicle};
use crate::newest::message;
use crate::profile::{CLASSES, Rows};
use core::fmt;
use stampfly_types::Instant;
use stampfly_types::messages::{FlightStatus, SelfTest, SelfTestVerdict};

/// A sample that is so many periods old is not followed by another.
const SILENT_PERIODS: u64 = 10;
/// So many errors are normal while chips start.
const STARTING_ERRORS: u32 = 20;
/// One error in so many samples is a loose contact.
const SAMPLES_AN_ERROR: u32 = 50;
/// One activation in so many may take up to twice its budget: an interrupt came.
const PASSES_A_LATE_ONE: u64 = 1_000;

/// Writes a line for every check. They end with a carriage return and a line feed.
///
/// # Errors
/// When `reply` does not take it.
pub fn examine<V: Vehicle>(vehicle: &V, now: Instant, reply: &mut dyn fmt::Write) -> fmt::Result {
    let topic = |name: &str| {
        let place = V::TOPICS.iter().position(|info| info.name == name)?;
        vehicle.newest(place)
    };
    say(reply, "version", Verdict::Pass, &vehicle.version(), "")?;
    say(reply, "awake", Verdict::Pass, &format_args!("{} us", now.as_micros()), "")?;
    for line in vehicle.sensors() {
        let info = V::TOPICS.iter().position(|info| info.name.strip_prefix("sensor_") == Some(line.name));
        let newest = info.and_then(|place| Some((V::TOPICS.get(place)?, vehicle.newest(place)?.0)));
        let silent =
            newest.is_none_or(|(info, at)| info.period.is_some_and(|period| now.since(at) > period * SILENT_PERIODS));
        sensor(line, newest.map(|(_, at)| now.since(at).as_millis()), silent, reply)?;
    }
    if let Some(test) = topic("self_test").and_then(|(_, words)| message::<SelfTest>(words)) {
        let (verdict, advice) = match test.verdict {
            SelfTestVerdict::Identical => (Verdict::Pass, ""),
            SelfTestVerdict::WithinTolerance => (Verdict::Look, "this chip computes other bits: please report it"),
            _ => (Verdict::Fail, "it must not fly: please report it"),
        };
        let (name, worst) = (test.verdict.name(), test.worst);
        say(reply, "self_test", verdict, &format_args!("{name}, worst deviation {worst}"), advice)?;
    }
    passes(vehicle.profile(), reply)?;
    if let Some(status) = topic("flight_status").and_then(|(_, words)| message::<FlightStatus>(words)) {
        let verdict = if status.blocks.is_empty() { Verdict::Pass } else { Verdict::Look };
        say(reply, "arming", verdict, &Names(|| status.blocks.names()), "")?;
    }
    let facts = vehicle.facts().iter();
    facts.copied().try_for_each(|Finding { name, verdict, value, advice }| say(reply, name, verdict, value, advice))
}

/// Not inlined, nor for each kind of value: flash is scarce, and nobody waits for this.
#[inline(never)]
fn say(
    reply: &mut dyn fmt::Write,
    name: &str,
    verdict: Verdict,
    value: &dyn fmt::Display,
    advice: &str,
) -> fmt::Result {
    write!(reply, "{}\r\n", Finding { name, verdict, value, advice })
}

#[inline(never)]
fn sensor(line: &SensorLine<'_>, age: Option<u64>, silent: bool, reply: &mut dyn fmt::Write) -> fmt::Result {
    let SensorLine { name, samples, errors, last_error } = *line;
    let (verdict, advice) = match () {
        () if samples == 0 => (Verdict::Fail, "it never measured: its chip, its wires, its supply"),
        () if silent => (Verdict::Fail, "it has fallen silent"),
        () if errors > STARTING_ERRORS && errors > samples / SAMPLES_AN_ERROR => {
            (Verdict::Look, "many errors: a loose contact?")
        }
        () => (Verdict::Pass, ""),
    };
    let last: &dyn fmt::Display = last_error.unwrap_or(&"none");
    let age = age.unwrap_or(u64::MAX);
    say(reply, name, verdict, &format_args!("samples {samples} errors {errors} age_ms {age} last_error {last}"), advice)
}

#[inline(never)]
fn passes(rows: Rows<'_>, reply: &mut dyn fmt::Write) -> fmt::Result {
    let (mut all, mut twice, mut longer, mut worst) = (0u64, 0u64, 0u64, None);
    for row in rows {
        let [first @ .., double, more]: [u32; CLASSES] = row.classes;
        all += first.iter().map(|count| u64::from(*count)).sum::<u64>() + u64::from(double) + u64::from(more);
        (twice, longer) = (twice + u64::from(double), longer + u64::from(more));
        let share = row.longest.as_micros() * 100 / row.budget.as_micros().max(1);
        if worst.is_none_or(|(most, _)| share > most) {
            worst = Some((share, row.name));
        }
    }
    let (share, name) = worst.unwrap_or((0, "none"));
    let (verdict, advice) = match () {
        () if longer + twice > all / PASSES_A_LATE_ONE => (Verdict::Fail, "too slow to fly: please report it"),
        () if longer + twice > 0 => (Verdict::Look, "some were late: please report it"),
        () => (Verdict::Pass, ""),
    };
    say(
        reply,
        "passes",
        verdict,
        &format_args!("all {all} twice {twice} longer {longer} worst {name} {share} per cent of its budget"),
        advice,
    )
}

/// Names with spaces between them, or none.
struct Names<F>(F);

impl<I: Iterator<Item = &'static str>, F: Fn() -> I> fmt::Display for Names<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut names = (self.0)();
        f.write_str(names.next().unwrap_or("none"))?;
        names.try_for_each(|name| write!(f, " {name}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::String;

    fn line(samples: u32, errors: u32, age: Option<u64>, silent: bool) -> String {
        let line = SensorLine { name: "imu", samples, errors, last_error: Some(&"no chip answered") };
        let mut reply = String::new();
        sensor(&line, age, silent, &mut reply).expect("a String takes everything");
        reply
    }

    #[test]
    fn a_sensor_passes_when_it_measures_and_hardly_fails() {
        let verdict = |text: &str| Finding::parse(text).map(|finding| finding.verdict);
        assert_eq!(verdict(&line(4_000, 3, Some(2), false)), Some(Verdict::Pass));
        assert_eq!(verdict(&line(0, 0, None, true)), Some(Verdict::Fail));
        assert_eq!(verdict(&line(4_000, 3, Some(900), true)), Some(Verdict::Fail));
        assert_eq!(verdict(&line(4_000, 81, Some(2), false)), Some(Verdict::Look));
        assert!(
            line(0, 7, None, true).contains("errors 7 age_ms 18446744073709551615 last_error no chip answered -- it")
        );
    }
}
