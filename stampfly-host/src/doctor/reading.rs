//! The vehicle's answers as numbers.

use super::visit::{Lost, Visit};
use std::collections::BTreeMap;
use std::time::Duration;

/// Pause between two samples of a mean.
const PAUSE: Duration = Duration::from_millis(60);

/// The newest sample of a topic: `topic NAME` at the console.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reading {
    /// Its age, ms; `None` when there was none yet.
    pub age: Option<u64>,
    fields: BTreeMap<String, Vec<f64>>,
}

impl Reading {
    /// Reads an answer of the console. Booleans are one and zero; names of alternatives are left out.
    ///
    /// ```
    /// use stampfly_host::doctor::reading::Reading;
    /// let reading = Reading::parse("2 ms old\r\n  accel 0.1 -0.2 -9.8 m/s^2\r\n  valid true\r\n");
    /// assert_eq!((reading.age, reading.get("accel"), reading.is("valid")), (Some(2), &[0.1, -0.2, -9.8][..], true));
    /// ```
    #[must_use]
    pub fn parse(answer: &str) -> Self {
        let mut reading = Self::default();
        for line in answer.lines() {
            let mut words = line.split_whitespace();
            let Some(first) = words.next() else { continue };
            if line.trim_end().ends_with("ms old") {
                reading.age = first.parse().ok();
                continue;
            }
            let numbers = words.map_while(|word| match word {
                "true" => Some(1.0),
                "false" => Some(0.0),
                number => number.parse().ok(),
            });
            reading.fields.insert(first.to_owned(), numbers.collect());
        }
        reading
    }

    /// The values of a field; none when there is no such field.
    #[must_use]
    pub fn get(&self, field: &str) -> &[f64] {
        self.fields.get(field).map_or(&[], Vec::as_slice)
    }

    /// The only value of a field.
    #[must_use]
    pub fn number(&self, field: &str) -> Option<f64> {
        self.get(field).first().copied()
    }

    /// Is this field true?
    #[must_use]
    pub fn is(&self, field: &str) -> bool {
        self.number(field) == Some(1.0)
    }
}

/// The newest sample of a topic.
///
/// # Errors
/// When the vehicle does not answer.
pub fn newest(visit: &mut impl Visit, topic: &str) -> Result<Reading, Lost> {
    Ok(Reading::parse(&visit.ask(&format!("topic {topic}"))?))
}

/// So many samples of a topic, one after the other.
///
/// # Errors
/// When the vehicle does not answer.
pub fn several(visit: &mut impl Visit, topic: &str, count: usize) -> Result<Vec<Reading>, Lost> {
    (0..count)
        .map(|_| {
            visit.wait(PAUSE);
            newest(visit, topic)
        })
        .collect()
}

/// The mean of a field of numbers over these samples; `None` where a sample has other numbers of it.
#[must_use]
pub fn mean<const N: usize>(readings: &[Reading], field: &str) -> Option<[f64; N]> {
    let mut sum = [0.0; N];
    for reading in readings {
        let values: [f64; N] = reading.get(field).try_into().ok()?;
        sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }
    (!readings.is_empty()).then(|| sum.map(|sum| sum / readings.len() as f64))
}
