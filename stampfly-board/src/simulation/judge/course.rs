//! The commanded path: the mission's, in the world as it was at the start.

use crate::simulation::mission::{Mission, Step};
use stampfly_types::Vec3;
use stampfly_types::messages::FlightMode;
use std::vec::Vec;

/// The vehicle has been at a place of the mission that it came as near as this, m.
pub(super) const VISITED: f32 = 1.0;

/// The path of a mission, and which of its places the vehicle has been at.
pub(super) struct Course {
    steps: Vec<Step>,
    /// How far a flip rises, m.
    flip_room: f32,
    places: Vec<([f32; 2], bool)>,
}

impl Course {
    /// Of this mission, of a vehicle whose flips rise by this, m.
    pub fn new(mission: &Mission, flip_room: f32) -> Self {
        let places = mission.steps.iter().filter_map(|step| match *step {
            Step::GoTo { place: [north, east, _], .. } => Some(([north, east], false)),
            _ => None,
        });
        Self { steps: mission.steps.clone(), flip_room, places: places.collect() }
    }

    /// Does the mission ask for landing, or for nothing any more, when so many steps are done?
    pub fn asks_to_land(&self, done: usize) -> bool {
        self.steps.get(done).is_none_or(|step| *step == Step::Land)
    }

    /// Does the mission ever ask to take off?
    pub fn asks_to_rise(&self) -> bool {
        self.steps.iter().any(|step| matches!(step, Step::TakeOff { .. }))
    }

    /// Does the mission ask for this mode? On the way from one that holds height to a manual one
    /// the height is held, and so it is after a flip, in which no floor is seen, until the place is
    /// known again.
    pub fn asks_for(&self, mode: FlightMode) -> bool {
        let holds = mode == FlightMode::AltHold;
        let flips = self.steps.iter().any(|step| matches!(step, Step::Flip { .. }));
        (flips && holds) || self.modes().any(|asked| asked == mode || (asked.is_manual() && holds))
    }

    /// The modes that the mission asks for.
    pub fn modes(&self) -> impl Iterator<Item = FlightMode> {
        self.steps.iter().filter_map(|step| if let Step::Mode { mode } = step { Some(*mode) } else { None })
    }

    /// The vehicle is here.
    pub fn visit(&mut self, position: &Vec3) {
        for ([north, east], visited) in &mut self.places {
            let away = position.horizontal() - Vec3::new(*north, *east, 0.0).horizontal();
            *visited |= away.norm() < VISITED;
        }
    }

    /// Has it been at every place?
    pub fn is_visited(&self) -> bool {
        self.places.iter().all(|(_, visited)| *visited)
    }

    /// The highest height commanded until this step, and the distance of a place from the path until there.
    pub fn commanded(&self, done: usize, place: &Vec3) -> (f32, f32) {
        let (mut top, mut corner, mut up) = (0.0_f32, [0.0, 0.0], 0.0);
        let mut beside = place.horizontal().norm();
        for step in self.steps.iter().take(done + 1) {
            match *step {
                Step::TakeOff { height } => (up, top) = (height, top.max(height)),
                Step::Flip { .. } => top = top.max(up + self.flip_room),
                Step::GoTo { place: [north, east, height], .. } => {
                    (up, top) = (height, top.max(height));
                    beside = beside.min(distance([place.x, place.y], corner, [north, east]));
                    corner = [north, east];
                }
                _ => {}
            }
        }
        (top, beside)
    }
}

/// Distance of a place from a leg.
fn distance([x, y]: [f32; 2], [from_x, from_y]: [f32; 2], [to_x, to_y]: [f32; 2]) -> f32 {
    let (leg_x, leg_y) = (to_x - from_x, to_y - from_y);
    let square = leg_x * leg_x + leg_y * leg_y;
    let along = if square > 0.0 { ((x - from_x) * leg_x + (y - from_y) * leg_y) / square } else { 0.0 };
    let along = along.clamp(0.0, 1.0);
    let (dx, dy) = (x - from_x - along * leg_x, y - from_y - along * leg_y);
    stampfly_types::math::sqrt(dx * dx + dy * dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_from_the_legs_that_are_flown() {
        let course = Course::new(&Mission::parse("arm\ntakeoff 0.5\ngoto 1 0 0.8\nland\n").expect("a mission"), 0.0);
        let place = Vec3::new(0.5, 0.3, 0.0);
        let (top, beside) = course.commanded(1, &place);
        assert!(top == 0.5 && (beside - place.horizontal().norm()).abs() < 1e-6);
        let (top, beside) = course.commanded(2, &place);
        assert!(top == 0.8 && (beside - 0.3).abs() < 1e-6);
        assert_eq!(distance([2.0, 0.0], [0.0, 0.0], [1.0, 0.0]), 1.0, "beyond its end");
        assert_eq!(distance([0.0, 2.0], [0.0, 0.0], [0.0, 0.0]), 2.0, "of no length");
    }

    #[test]
    fn a_flip_may_rise_and_the_mission_may_ask_for_another_mode() {
        let course = |text| Course::new(&Mission::parse(text).expect("a mission"), 0.6);
        let flip = course("arm; takeoff 1.5; hover 2; flip left; land");
        assert_eq!([1, 2, 3].map(|done| flip.commanded(done, &Vec3::zeros()).0), [1.5, 1.5, 2.1]);
        assert!(flip.asks_for(FlightMode::AltHold) && !flip.asks_for(FlightMode::Stabilize));
        let manual = course("arm; takeoff 1; mode acro; land");
        assert!(manual.asks_for(FlightMode::Acro) && manual.asks_for(FlightMode::AltHold));
        let none = course("arm; takeoff 1; land");
        assert!(!none.asks_for(FlightMode::AltHold) && none.modes().next().is_none());
    }

    #[test]
    fn a_place_is_visited_from_within_a_metre() {
        let mut course =
            Course::new(&Mission::parse("arm\ntakeoff 0.5\ngoto 2 0 0.8\nland\n").expect("a mission"), 0.0);
        course.visit(&Vec3::new(0.9, 0.0, -0.8));
        assert!(!course.is_visited());
        course.visit(&Vec3::new(1.1, 0.0, -0.8));
        assert!(course.is_visited());
    }
}
