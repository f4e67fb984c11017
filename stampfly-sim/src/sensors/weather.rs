//! Air pressure in a room: wander, and doors.
//!
//! **Wander.** In four recordings of StampFlys at rest (20 to 30 s each) the 1-s means span 0.20 to
//! 0.34 m within 20 s and change by 0.16 to 0.19 m within 2 s. The table gives standard deviations
//! of differences between conversions, Pa. The model is white noise of 0.35 Pa plus two first-order
//! processes: 0.75 Pa over 0.4 s (draughts in the room, after the chip's filter) and 0.9 Pa over 6
//! s (the building).
//!
//! | interval, s | 0.07 | 0.5 | 1 | 4 | 8 |
//! |---|---:|---:|---:|---:|---:|
//! | recorded | 0.59–0.70 | 1.04–1.12 | 1.19–1.32 | 1.33–1.71 | 1.49–2.47 |
//! | model | 0.7 | 1.1 | 1.2 | 1.5 | 1.6 |
//!
//! **Doors.** The pressure in a closed room differs from that outside by some pascals, due to wind,
//! ventilation and the swing of the door itself. When a door is opened or closed, the pressure
//! changes within a second and stays, or returns some seconds later. Doors belong to the world: all
//! barometers of one seed see the same ones.

use crate::conditions::Conditions;
use crate::noise::{Noise, Stream};
use stampfly_types::Instant;

/// White noise of a conversion with the wander enabled, relative to that without: 0.35 Pa.
const WHITE: f64 = 0.5;
/// Standard deviations, Pa, and correlation times, s.
const PROCESSES: [(f64, f64); 2] = [(0.75, 0.4), (0.9, 6.0)];
/// Ranges of the duration of a swing, and of the time until a door closes again, s.
const SWING: [f64; 2] = [0.3, 1.0];
const OPEN: [f64; 2] = [1.0, 5.0];
/// Smallest step as a share of the largest.
const SMALLEST: f64 = 0.3;

/// Pressure wander at one barometer.
#[derive(Debug)]
pub(super) struct Wander {
    noise: Noise,
    strength: f64,
    values: [f64; 2],
}

impl Wander {
    /// `None` if the conditions have no wander.
    pub fn new(conditions: &Conditions, seed: u64) -> Option<Self> {
        let strength = conditions.baro_wander;
        let mut noise = Noise::stream(seed, Stream::PressureWander);
        let values = PROCESSES.map(|(deviation, _)| strength * deviation * noise.normal());
        (strength > 0.0).then_some(Self { noise, strength, values })
    }

    /// Standard deviation of the white noise with the wander enabled; `deviation` is that without.
    pub fn white(deviation: f64) -> f64 {
        WHITE * deviation
    }

    /// Advances by `seconds` and returns the pressure, Pa.
    pub fn after(&mut self, seconds: f64) -> f64 {
        for (value, (deviation, time)) in self.values.iter_mut().zip(PROCESSES) {
            let keep = libm::exp(-seconds / time);
            *value = *value * keep + self.strength * deviation * (1.0 - keep * keep).sqrt() * self.noise.normal();
        }
        self.values.iter().sum()
    }
}

/// Movement of one door.
#[derive(Clone, Copy, Debug, Default)]
struct Swing {
    /// Begin, s.
    at: f64,
    /// Duration, s.
    within: f64,
    /// Time from the begin until it closes again, s; `None` if it stays open.
    back: Option<f64>,
    /// Change of pressure, Pa.
    step: f64,
}

impl Swing {
    /// Share of the step present at `time`, s after the start.
    fn share(&self, time: f64) -> f64 {
        let moved = |since: f64| (since / self.within).clamp(0.0, 1.0);
        moved(time - self.at) - self.back.map_or(0.0, |back| moved(time - self.at - back))
    }

    /// True when the movement is complete.
    fn is_over(&self, time: f64) -> bool {
        time > self.at + self.back.unwrap_or(0.0) + self.within
    }
}

/// The doors of a building.
#[derive(Debug)]
pub(super) struct Doors {
    noise: Noise,
    /// Rate, 1/s, and largest step, Pa.
    often: f64,
    largest: f64,
    next: Swing,
    /// Sum of permanent steps, Pa.
    stayed: f64,
    start: Instant,
}

impl Doors {
    /// `None` if the conditions have no doors.
    pub fn new(conditions: &Conditions, start: Instant, seed: u64) -> Option<Self> {
        let Conditions { baro_doors: often, baro_door: largest, .. } = *conditions;
        let noise = Noise::stream(seed, Stream::Doors);
        let mut doors = Self { noise, often, largest, next: Swing::default(), stayed: 0.0, start };
        if often == 0.0 {
            return None;
        }
        doors.next = doors.draw(0.0);
        Some(doors)
    }

    /// Draws the next door after this time, s.
    fn draw(&mut self, after: f64) -> Swing {
        let mut between = |[low, high]: [f64; 2]| low + (high - low) * self.noise.unit();
        let within = between(SWING);
        let back = between(OPEN);
        let step = self.largest * between([SMALLEST, 1.0]);
        // Half of the steps are permanent, and half are negative.
        let (stays, falls) = (self.noise.chance(0.5), self.noise.chance(0.5));
        // Exponentially distributed, so that doors are a Poisson process.
        let pause = -libm::log(1.0 - self.noise.unit()) / self.often;
        Swing {
            at: after + pause,
            within,
            back: (!stays).then_some(within + back),
            step: if falls { -step } else { step },
        }
    }

    /// Pressure caused by doors, Pa. Call it with ascending instants.
    pub fn at(&mut self, instant: Instant) -> f64 {
        let time = instant.since(self.start).seconds_f64();
        // A permanent step is added to the sum before the next door is drawn.
        while self.next.is_over(time) {
            self.stayed += self.next.step * self.next.share(time);
            let end = self.next.at + self.next.back.unwrap_or(0.0) + self.next.within;
            self.next = self.draw(end);
        }
        self.stayed + self.next.step * self.next.share(time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pressure of wander and white noise at the chip's rate, Pa, for this duration.
    fn pressures(seed: u64, seconds: usize) -> Vec<f64> {
        let conditions = Conditions { baro_wander: 1.0, ..Conditions::GENTLE };
        let mut wander = Wander::new(&conditions, seed).expect("it wanders");
        let mut white = Noise::new(seed, 99);
        (0..seconds * 27 / 2).map(|_| wander.after(1.0 / 13.5) + Wander::white(0.7) * white.normal()).collect()
    }

    /// Limits: the four recordings of the module documentation, each widened by a tenth.
    #[test]
    fn neighbouring_pressures_differ_as_recorded() {
        let pressures = pressures(1, 4_000);
        for (apart, low, high) in
            [(1, 0.53, 0.77), (7, 0.94, 1.23), (14, 1.07, 1.45), (54, 1.2, 1.88), (108, 1.34, 2.7)]
        {
            let squares = pressures.windows(apart + 1).map(|window| (window[apart] - window[0]).powi(2));
            let deviation = (squares.sum::<f64>() / (pressures.len() - apart) as f64).sqrt();
            assert!((low..high).contains(&deviation), "{apart} conversions apart: {deviation} Pa");
        }
    }

    #[test]
    fn means_of_a_second_lie_as_far_apart_as_recorded() {
        // In metres, the unit of the recordings' figures.
        let mut ranges = Vec::new();
        let mut changes = Vec::new();
        for seed in 0..60 {
            let means: Vec<_> = pressures(seed, 20)
                .chunks(13)
                .map(|second| second.iter().sum::<f64>() / second.len() as f64 / 11.77)
                .collect();
            let (low, high) =
                means.iter().fold((f64::MAX, f64::MIN), |(low, high), mean| (low.min(*mean), high.max(*mean)));
            ranges.push(high - low);
            changes.push(means.windows(3).map(|three| (three[2] - three[0]).abs()).fold(0.0, f64::max));
        }
        ranges.sort_by(f64::total_cmp);
        changes.sort_by(f64::total_cmp);
        assert!((0.2..0.34).contains(&ranges[30]), "the median range {}", ranges[30]);
        assert!((0.14..0.21).contains(&changes[30]), "the median of the largest change in 2 s {}", changes[30]);
    }

    #[test]
    fn doors_step_within_a_second_and_stay_or_go() {
        let conditions = Conditions { baro_doors: 0.05, ..Conditions::GENTLE };
        let mut doors = Doors::new(&conditions, Instant::ZERO, 3).expect("doors");
        let pressures: Vec<_> = (0..40_000u64).map(|tenth| doors.at(Instant::from_millis(100 * tenth))).collect();
        let steps = pressures.windows(11).map(|second| second[10] - second[0]);
        let (falls, rises) = steps.fold((0.0f64, 0.0f64), |(low, high), step| (low.min(step), high.max(step)));
        assert!((-18.0..-14.0).contains(&falls) && (14.0..=18.0).contains(&rises), "{falls} {rises}");
        let still = pressures.windows(101).filter(|ten| ten.iter().all(|pressure| *pressure == ten[0])).count();
        assert!(still > 5_000, "between doors nothing changes: {still}");
        let levels = pressures.windows(101).filter(|ten| ten.iter().all(|p| *p == ten[0])).map(|ten| ten[0].to_bits());
        let levels: std::collections::BTreeSet<_> = levels.collect();
        assert!(levels.len() > 20, "half of them stay: {}", levels.len());
        let mut again = Doors::new(&conditions, Instant::ZERO, 3).expect("the same doors");
        assert_eq!(again.at(Instant::from_secs(3_999)), doors.at(Instant::from_secs(3_999)));
    }

    #[test]
    fn in_the_gentle_world_there_are_neither() {
        assert!(Wander::new(&Conditions::GENTLE, 1).is_none());
        assert!(Doors::new(&Conditions::GENTLE, Instant::ZERO, 1).is_none());
    }
}
