//! A campaign of sound vehicles: anything that may be flown, under anything that may be met.
//!
//! Each flight draws from its seed, in the harsh world:
//!
//! | drawn | from |
//! |---|---|
//! | who flies | a program or a pilot by a mission, or sticks: a file, or [drawn ones](stampfly_sim::sticks::DRAWN) |
//! | mode | all of the vehicle's |
//! | height where sticks begin in the air | 0.3 to 8 m |
//! | gusts | a standard deviation of up to a third of 5 m/s; up to 0.8 m/s for a pilot by sight, who steers as well as the simulator's pilot does |
//! | vibration | half to twice of what was recorded |
//! | executor | late, in one of four |
//! | drivers | over emulated chips, in one of ten |
//!
//! Battery, room, floor, light, specimen are the harsh world's. Nothing is broken, so a flight that
//! does not end well, or in which the vehicle does something by itself, is a defect of the vehicle
//! or a limit of its physics.

use super::case::Dice;
use super::sticks::Cell;
use serde::{Deserialize, Serialize};
use stampfly_sim::Noise;
use stampfly_sim::sticks::{DRAWN, StickOptions};
use stampfly_sim::vehicle::{Options, SetupError, Vehicle, WorldKind};

/// Random number stream of envelopes; that of fault campaigns is another.
const STREAM: u64 = 1_300;
/// Gusts reach three standard deviations: 5 m/s.
const GUST: f64 = 5.0 / 3.0;
/// The same for a pilot who holds a place by sight.
const GUST_BY_SIGHT: f64 = 0.8;
/// Of what was recorded. Recorded specimens differ by as much.
const VIBRATION: [f64; 2] = [0.5, 2.0];
/// Where sticks begin in the air, m.
const HEIGHT: [f64; 2] = [0.3, 8.0];
/// Shares of flights by a program, by a pilot with a mission, and by stick files; the rest are drawn.
const PROGRAM: f64 = 0.25;
const PILOT: f64 = 0.25;
const FILES: f64 = 0.25;

/// Which flights there are.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Envelope {
    /// Seed of the first flight; the others count up.
    pub seed: u64,
    /// Stick files, and how they are flown. The mode is drawn, and the height where they say none.
    pub sticks: Vec<StickOptions>,
    /// Options of all flights.
    pub options: Options,
}

impl Envelope {
    /// Flight number `index`: what it is, and its seed.
    ///
    /// # Errors
    /// When a stick file is none, or the vehicle has no such flight.
    pub fn flight<V: Vehicle>(&self, index: u64) -> Result<(Cell, u64), SetupError> {
        let seed = self.seed.wrapping_add(index);
        let mut dice = Dice(Noise::new(seed, STREAM));
        let mut options = Options { world: WorldKind::Harsh, ..self.options.clone() };
        let (gust, calmer) = (dice.round(0.0, GUST), dice.round(0.0, GUST_BY_SIGHT));
        options.vibration = options.vibration.or(Some(dice.round(VIBRATION[0], VIBRATION[1])));
        options.jitter = options.jitter.or(dice.0.chance(0.25).then_some(seed));
        options.chips |= dice.0.chance(0.1) && V::VARIETY.chips;
        let mode = dice.one(V::VARIETY.modes).map(|mode| (*mode).to_owned());
        let missions: Vec<_> = V::VARIETY.missions.iter().chain(V::VARIETY.occasions).collect();
        let mission = dice.one(&missions).map(|mission| (**mission).to_owned());
        let height = dice.round(HEIGHT[0], HEIGHT[1]) as f32;
        let file = dice.one(&self.sticks).cloned();
        let share = dice.0.unit();
        let (name, mode) = if share < PROGRAM || mode.is_none() {
            options.mission.clone_from(&mission);
            (mission.unwrap_or_default(), None)
        } else if share < PROGRAM + PILOT {
            options.mission.clone_from(&mission);
            options.pilot.clone_from(&mode);
            options.gust = options.gust.or(Some(calmer as f32));
            (mission.unwrap_or_default(), mode)
        } else {
            let file = file.filter(|_| share < PROGRAM + PILOT + FILES);
            let name = file.as_ref().map_or_else(|| "drawn sticks".to_owned(), |sticks| sticks.file.clone());
            let drawn = || StickOptions { file: format!("{DRAWN}{seed}"), ..StickOptions::default() };
            let mut sticks = file.unwrap_or_else(drawn);
            sticks.from_height = sticks.from_height.or(Some(height));
            // A file that changes the mode is about that.
            let mode = mode.filter(|_| sticks.file().is_ok_and(|file| file.modes().len() == 1));
            sticks.mode.clone_from(&mode);
            options.sticks = Some(sticks);
            (name, mode)
        };
        options.gust = options.gust.or(Some(gust as f32));
        V::setup(&options, seed)?;
        Ok((Cell { file: name.into(), mode, options }, seed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_board::simulation::StampFly;

    #[test]
    fn flights_are_of_every_kind_and_the_same_again() {
        let envelope = Envelope { seed: 1, sticks: Vec::new(), options: Options::default() };
        let flights: Vec<_> = (0..200).map(|index| envelope.flight::<StampFly>(index).expect("a flight")).collect();
        let (cell, seed) = envelope.flight::<StampFly>(7).expect("a flight");
        let text = |options| serde_json::to_string(options).expect("JSON");
        assert_eq!((seed, text(&cell.options)), (8, text(&flights[7].0.options)));
        let count = |is: fn(&Options) -> bool| flights.iter().filter(|(cell, _)| is(&cell.options)).count();
        assert!(
            flights.iter().all(|(cell, _)| cell.options.world == WorldKind::Harsh && cell.options.fault.is_empty())
        );
        assert!(count(|options| options.pilot.is_some()) > 20);
        assert!(count(|options| options.sticks.is_some()) > 60);
        assert!(count(|options| options.pilot.is_none() && options.sticks.is_none()) > 20);
    }

    #[test]
    fn a_file_is_flown_as_its_options_say() {
        let file = "t,throttle,roll,pitch,yaw,mode,arm\n0,0.2,0,0,0,acro,1\n1,0.2,0,0,0,acro,1\n";
        let (file, hover_throttle) = (file.to_owned(), Some("median".to_owned()));
        let sticks = StickOptions { file, hover_throttle, when_ready: true, ..StickOptions::default() };
        let envelope = Envelope { seed: 1, sticks: vec![sticks.clone()], options: Options::default() };
        let flights = (0..100).map(|index| envelope.flight::<StampFly>(index).expect("a flight").0);
        let flown: Vec<_> =
            flights.filter_map(|cell| cell.options.sticks).filter(|it| it.file == sticks.file).collect();
        assert!(flown.len() > 10);
        assert!(flown.iter().all(|it| it.when_ready && it.hover_throttle == sticks.hover_throttle));
        assert!(flown.iter().all(|it| it.from_height.is_some() && it.mode.is_some()), "drawn");
    }
}
