//! Hardware in the loop: the simulated world flies a vehicle at the other end of a line.
//!
//! | module | what it is |
//! |---|---|
//! | [`fly()`] | one flight, on any [`Port`](stampfly_sim::vehicle::Port) |
//! | [`emulated`] | a vehicle's end in a thread of this program |
//! | [`program`] | one in a program that speaks over its standard input and output, such as an emulator |
//! | [`serial`] | one at a serial port |
//!
//! The conversation is [`stampfly_sim::vehicle::Remote`]'s. Not for examining a vehicle's sensors or motors: they have no part
//! in such a flight; the [doctor](crate::doctor) looks at those.

pub mod emulated;
pub mod program;
pub mod serial;

use crate::flown::Flown;
use stampfly_sim::vehicle::{Ended, Figures, Remote, RemoteError, Vehicle, Witness};
use std::fmt;
use std::time::{Duration, Instant};

/// Flies once: greets the vehicle, gives it the parameters of the setup, and lets it fly. `report` as in
/// [`fly`](crate::flown::fly).
///
/// ```
/// use stampfly_board::{schedule::Runnables, simulation::StampFly};
/// use stampfly_host::hil::emulated::{Pipe, start};
/// use stampfly_host::hil::fly;
/// use stampfly_sim::vehicle::{Options, Remote, Settings, Vehicle, Verdict};
///
/// let [mut here, there] = Pipe::pair();
/// start::<Runnables>(there);
/// let hop = Options { mission: Some("arm; takeoff 0.2; land".into()), ..Options::default() };
/// let setup = StampFly::setup(&hop, 1)?;
/// let mut remote = Remote::new(&mut here, Settings::default());
/// let flown = fly::<StampFly>(&setup, &mut remote, &mut (), &mut |_, _| {})?;
/// assert!(flown.outcome.succeeded());
/// assert!(remote.figures().round_trips.len() > 1_000);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the vehicle refuses something, or is lost.
pub fn fly<V: Vehicle>(
    setup: &V::Setup,
    remote: &mut Remote<'_>,
    witness: &mut dyn Witness<V::Runnables>,
    report: &mut dyn FnMut(f32, &'static str),
) -> Result<Flown<V::Outcome>, RemoteError> {
    remote.greet::<V::Runnables>()?;
    for setting in V::parameters(V::config(setup)) {
        remote.parameter(setting.name, setting.value as f32)?;
    }
    let begun = Instant::now();
    let Ended { outcome, duration, log_lost } = V::fly_remote(setup, remote, witness, report)?;
    let realtime_factor = duration.seconds_f64() / begun.elapsed().as_secs_f64();
    Ok(Flown { outcome, duration, realtime_factor, log_lost: log_lost + remote.figures().lost })
}

/// How the conversation went, for people: round trips, and in real time how late answers came.
#[derive(Clone, Copy, Debug)]
pub struct Conversation<'f> {
    /// As they were counted.
    pub figures: &'f Figures,
    /// An answer that comes later than this after its time is late: the flight band's period.
    pub period: Duration,
}

impl Conversation<'_> {
    /// Answers that came late.
    #[must_use]
    pub fn late(&self) -> usize {
        self.figures.behind.iter().filter(|behind| **behind > self.period).count()
    }
}

/// The value below which this share of them is. Zero when there are none.
#[must_use]
pub fn quantile(values: &[Duration], share: f64) -> Duration {
    let mut sorted = values.to_vec();
    sorted.sort_unstable();
    let place = (share * sorted.len() as f64) as usize;
    sorted.get(place).or(sorted.last()).copied().unwrap_or_default()
}

impl fmt::Display for Conversation<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Figures { round_trips, behind, longest, total, again, garbled: [here, there], lost } = self.figures;
        let us = |time: Duration| time.as_secs_f64() * 1e6;
        let steps = round_trips.len();
        let [median, most] = [0.5, 1.0].map(|share| us(quantile(round_trips, share)));
        let nearly = us(quantile(round_trips, 0.99));
        writeln!(
            f,
            "steps       {steps}, round trip {median:.0} us, 99 % within {nearly:.0} us, at most {most:.0} us"
        )?;
        let mean = us(*total) / steps.max(1) as f64;
        writeln!(f, "vehicle     {mean:.0} us a step by its own clock, at most {:.0} us", us(*longest))?;
        writeln!(
            f,
            "line        asked again {again} times, garbled {here} here and {there} there, {lost} samples lost"
        )?;
        if !behind.is_empty() {
            let most = us(quantile(behind, 1.0));
            let (late, period) = (self.late(), us(self.period));
            writeln!(f, "real time   {late} of {steps} answers later than {period:.0} us, at most {most:.0} us")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_conversation_is_summed_up() {
        let ms = Duration::from_millis;
        let round_trips: Vec<_> = (1..=100).map(ms).collect();
        assert_eq!([0.0, 0.5, 0.99, 1.0].map(|share| quantile(&round_trips, share)), [1, 51, 100, 100].map(ms));
        assert_eq!(quantile(&[], 0.5), Duration::ZERO);
        let figures = Figures { behind: vec![ms(1), ms(2), ms(3)], round_trips, again: 2, ..Figures::default() };
        let conversation = Conversation { figures: &figures, period: ms(2) };
        assert_eq!(conversation.late(), 1);
        let text = conversation.to_string();
        assert!(text.contains("1 of 100 answers later than 2000 us, at most 3000 us"), "{text}");
        let unhurried = Figures { behind: Vec::new(), ..figures };
        assert!(!Conversation { figures: &unhurried, period: ms(2) }.to_string().contains("real time"));
    }
}
