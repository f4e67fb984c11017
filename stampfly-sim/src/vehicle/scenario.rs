//! Scenarios: timed commands and checks as text, for any pair of messages.
//!
//! ```text
//! # seconds  what
//! 0.0  throttle 0.6  steer 0.2     # fields of the command; they stay until they are changed
//! 3.0  check v > 1.5               # a field of the log, < <= > >= ==, a number or the name of an enumerator
//! 4.0  estop on
//! 6.0  end
//! ```
//!
//! Times are seconds from the start, in ascending order. A check is evaluated on the first line of
//! the log at or after its time. A command acts after its time, so a check at the same time sees
//! the state before it. For vehicles driven by direct commands; a vehicle that flies to positions
//! uses a mission.

use core::marker::PhantomData;
use stampfly_types::{FieldInfo, FieldKind, Message, text};

type Comparison = fn(&f64, &f64) -> bool;

const COMPARISONS: [(&str, Comparison); 5] =
    [("<", f64::lt), ("<=", f64::le), (">", f64::gt), (">=", f64::ge), ("==", f64::eq)];

/// A condition on the log at a time.
#[derive(Clone, Debug)]
struct Check {
    time: f32,
    /// As written, for the report.
    text: String,
    field: usize,
    comparison: Comparison,
    value: f64,
}

/// Commands `C` by time, checks on the log's lines `L`, and the end.
///
/// ```
/// use stampfly_sim::vehicle::Scenario;
/// use stampfly_types::messages::{CommandSetpoint, PowerData};
///
/// let text = "0 throttle 0.5\n1 check voltage > 3.5\n2 throttle 1\n3 end";
/// let scenario = Scenario::<CommandSetpoint, PowerData>::parse(text, |command| command.throttle <= 1.0)?;
/// assert_eq!((scenario.command(0.5).throttle, scenario.command(2.5).throttle, scenario.end()), (0.5, 1.0, 3.0));
/// let flat = PowerData { voltage: 3.0, ..PowerData::default() };
/// assert_eq!(scenario.failures([(1.0, flat)].into_iter()), ["1 s: voltage > 3.5"]);
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug)]
pub struct Scenario<C, L> {
    commands: Vec<(f32, C)>,
    checks: Vec<Check>,
    end: f32,
    lines: PhantomData<fn(L)>,
}

impl<C: Message + Default, L: Message> Scenario<C, L> {
    /// Parses a scenario. `is_valid` accepts commands.
    ///
    /// # Errors
    /// The line number and the reason.
    pub fn parse(text: &str, is_valid: fn(&C) -> bool) -> Result<Self, String> {
        let mut scenario = Self { commands: Vec::new(), checks: Vec::new(), end: 0.0, lines: PhantomData };
        let (mut last, mut ended) = (0.0, false);
        for (number, line) in text.lines().enumerate() {
            let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
            let [time, what @ ..] = words.as_slice() else { continue };
            let at = |error: String| format!("line {}: {error}", number + 1);
            let time: f32 = time.parse().map_err(|_| at(format!("'{time}' is no time")))?;
            // NaN is in no range, so it is refused, too.
            if ended || !(last..f32::INFINITY).contains(&time) {
                return Err(at("times ascend, and nothing comes after the end".into()));
            }
            last = time;
            match what {
                ["end"] => (scenario.end, ended) = (time, true),
                ["check", check @ ..] => scenario.checks.push(parse_check::<L>(time, check).map_err(at)?),
                words => {
                    // Fields that a line does not name keep their values.
                    let before = scenario.commands.last().map_or_else(C::default, |(_, command)| *command);
                    let command = changed(&before, words).filter(is_valid);
                    let command = command.ok_or_else(|| at(format!("'{}' is no command", words.join(" "))))?;
                    scenario.commands.push((time, command));
                }
            }
        }
        if ended { Ok(scenario) } else { Err("the scenario has no end".into()) }
    }

    /// End of the scenario, s.
    #[must_use]
    pub fn end(&self) -> f32 {
        self.end
    }

    /// The command at this time; the default before the first.
    #[must_use]
    pub fn command(&self, time: f32) -> C {
        let command = self.commands.iter().rev().find(|(since, _)| *since < time);
        command.map_or_else(C::default, |(_, command)| *command)
    }

    /// The checks that fail, as written. `lines` is the log with times, s. A check after the end of
    /// the log fails.
    pub fn failures(&self, lines: impl Iterator<Item = (f32, L)>) -> Vec<String> {
        let mut lines = lines.peekable();
        let mut failures = Vec::new();
        for check in &self.checks {
            // Both sequences ascend, so each line is skipped once.
            while lines.next_if(|(time, _)| *time < check.time).is_some() {}
            let value = lines.peek().and_then(|(_, line)| {
                let words = line.to_words();
                let (field, words) = text::fields::<L>(&words).nth(check.field)?;
                let word = *words.first()?;
                Some(if field.kind == FieldKind::F32 { f32::from_bits(word).into() } else { f64::from(word) })
            });
            if !value.is_some_and(|value| (check.comparison)(&value, &check.value)) {
                failures.push(check.text.clone());
            }
        }
        failures
    }
}

fn parse_check<L: Message>(time: f32, words: &[&str]) -> Result<Check, String> {
    let refused = || format!("'check {}' is none: field, comparison, value", words.join(" "));
    let [name, sign, value] = words else { return Err(refused()) };
    let field = L::FIELDS.iter().position(|field| field.name == *name).ok_or_else(refused)?;
    let named = match L::FIELDS[field].kind {
        FieldKind::Enum(names) => names.iter().find(|(known, _)| known == value),
        _ => None,
    };
    let value = named.map(|(_, number)| f64::from(*number)).or_else(|| value.parse().ok()).ok_or_else(refused)?;
    let (_, comparison) = *COMPARISONS.iter().find(|(known, _)| known == sign).ok_or_else(refused)?;
    Ok(Check { time, text: format!("{time} s: {}", words.join(" ")), field, comparison, value })
}

/// The command with fields changed by pairs of name and value.
fn changed<C: Message>(command: &C, words: &[&str]) -> Option<C> {
    let written = |(field, words): (&FieldInfo, &[u32])| {
        let mut text = String::new();
        text::write(field, words, text::Style::Names, &mut text).ok().map(|()| text)
    };
    let mut texts: Vec<String> = text::fields::<C>(&command.to_words()).map(written).collect::<Option<_>>()?;
    let pairs = words.chunks_exact(2);
    if words.is_empty() || !pairs.remainder().is_empty() {
        return None;
    }
    for pair in pairs {
        let place = C::FIELDS.iter().position(|field| field.name == pair[0])?;
        texts[place] = match (pair[1], C::FIELDS[place].kind) {
            ("on", FieldKind::Bool) => "true".into(),
            ("off", FieldKind::Bool) => "false".into(),
            (value, FieldKind::Enum(_)) => format!("\"{value}\""),
            (value, _) => value.into(),
        };
    }
    let mut texts = texts.iter();
    text::read(|_| texts.next().map(String::as_str).ok_or(())).ok()?
}
