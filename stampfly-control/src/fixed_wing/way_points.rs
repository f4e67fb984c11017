//! The way-points of a flight, and which part of the way between them is flown.
//!
//! A leg leads from one way-point to the next. Where two legs meet, the aircraft leaves the first one early and flies an arc that touches both, so it never has to find its way back to a
//! line (Beard and McLain, chapter 11, algorithm 8). Behind the last way-point there is none: whoever flies holds there.
//!
//! The list is edited in flight by the way-points' own numbers, as a ground station does it: append, insert, update, delete. Not a multirotor's
//! [`Route`](crate::guidance::Route), which forgets what is behind and stops at what is ahead.

use super::track::Track;
use core::fmt;
use heapless::Vec;
use stampfly_types::math;

/// Legs that meet at a smaller angle than this have no arc, rad: 3°.
const STRAIGHT: f32 = 0.05;
/// It has turned to the first way-point when its course is so near to it, rad.
const FACES: f32 = 0.1;
/// Legs that lead back have no arc either, it would be without end: within 10° of a half turn.
const BACK: f32 = core::f32::consts::PI - 0.17;

/// A place to fly over.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WayPoint {
    /// Its number, by which it is edited.
    pub id: u32,
    /// m north and east of the origin.
    pub place: [f32; 2],
    /// m above the origin.
    pub height: f32,
}

/// Why a list was not edited. It is as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EditError {
    /// There is no room.
    Full,
    /// No way-point has this number.
    Unknown,
    /// One with this number is in the list.
    Known,
    /// A number of the way-point is none.
    NotFinite,
}

impl fmt::Display for EditError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Full => "no room for another way-point",
            Self::Unknown => "no such way-point",
            Self::Known => "the way-point is in the list already",
            Self::NotFinite => "not a finite number",
        })
    }
}

impl core::error::Error for EditError {}

/// The part of the way that is flown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Leg {
    /// The line to the way-point ahead.
    #[default]
    Line,
    /// The arc around it.
    Arc,
}

/// Where to fly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Followed {
    /// The path.
    pub track: Track,
    /// The way-point ahead, or the one that it turns at.
    pub way_point: WayPoint,
    /// Is it the last one?
    pub is_last: bool,
}

/// Way-points in their order, at most `N`.
///
/// ```
/// use stampfly_control::fixed_wing::{EditError, Follower, WayPoint, WayPoints};
/// let (mut list, mut follower) = (WayPoints::<4>::default(), Follower::default());
/// let point = |id, north, east| WayPoint { id, place: [north, east], height: 60.0 };
/// list.append(point(1, 300.0, 0.0))?;
/// list.append(point(3, 0.0, 300.0))?;
/// list.insert(3, point(2, 300.0, 300.0))?;
/// assert_eq!(list.delete(7), Err(EditError::Unknown));
/// // From the origin: first along the line to number 1.
/// let first = follower.follow(&list, [0.0, 0.0], 0.0, 50.0).expect("three");
/// assert_eq!((first.way_point.id, first.is_last), (1, false));
/// list.delete(1)?;
/// assert_eq!(follower.follow(&list, [0.0, 0.0], 0.0, 50.0).map(|followed| followed.way_point.id), Some(2));
/// # Ok::<(), EditError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WayPoints<const N: usize> {
    list: Vec<WayPoint, N>,
    /// How often it was emptied: a follower begins again then.
    cleared: u32,
}

impl<const N: usize> WayPoints<N> {
    /// Puts a way-point behind the last one.
    ///
    /// # Errors
    /// When it is full, the number is taken, or the place is none.
    pub fn append(&mut self, way_point: WayPoint) -> Result<(), EditError> {
        self.check(&way_point)?;
        self.list.push(way_point).map_err(|_| EditError::Full)
    }

    /// Puts a way-point before the one with the number `before`.
    ///
    /// # Errors
    /// When it is full, a number is taken or not known, or the place is none.
    pub fn insert(&mut self, before: u32, way_point: WayPoint) -> Result<(), EditError> {
        self.check(&way_point)?;
        let place = self.find(before)?;
        self.list.insert(place, way_point).map_err(|_| EditError::Full)
    }

    /// Moves the way-point that has this number.
    ///
    /// # Errors
    /// When none has the number, or the place is none.
    pub fn update(&mut self, way_point: WayPoint) -> Result<(), EditError> {
        finite(&way_point)?;
        let place = self.find(way_point.id)?;
        if let Some(known) = self.list.get_mut(place) {
            *known = way_point;
        }
        Ok(())
    }

    /// Takes one out. Whoever flies to it flies to the next one.
    ///
    /// # Errors
    /// When none has this number.
    pub fn delete(&mut self, id: u32) -> Result<(), EditError> {
        let place = self.find(id)?;
        self.list.remove(place);
        Ok(())
    }

    /// Forgets all of them.
    pub fn clear(&mut self) {
        self.list.clear();
        self.cleared = self.cleared.wrapping_add(1);
    }

    /// The way-points.
    #[must_use]
    pub fn list(&self) -> &[WayPoint] {
        &self.list
    }

    fn find(&self, id: u32) -> Result<usize, EditError> {
        self.list.iter().position(|known| known.id == id).ok_or(EditError::Unknown)
    }

    fn check(&self, way_point: &WayPoint) -> Result<(), EditError> {
        finite(way_point)?;
        if self.find(way_point.id).is_ok() { Err(EditError::Known) } else { Ok(()) }
    }
}

fn finite(WayPoint { place: [north, east], height, .. }: &WayPoint) -> Result<(), EditError> {
    let all = [north, east, height].iter().all(|number| number.is_finite());
    if all { Ok(()) } else { Err(EditError::NotFinite) }
}

/// How far a flight along [`WayPoints`] is. Edits of the list do not lose its place: it knows the number of the way-point ahead.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Follower {
    /// Place and number of the way-point ahead.
    ahead: usize,
    id: Option<u32>,
    leg: Leg,
    /// Where the leg to the way-point ahead begins.
    from: Option<[f32; 2]>,
    /// Has it turned to the first way-point?
    joined: bool,
    cleared: u32,
}

impl Follower {
    /// How many way-points are ahead, the present one included.
    #[must_use]
    pub fn remaining<const N: usize>(&self, way_points: &WayPoints<N>) -> usize {
        if self.cleared == way_points.cleared {
            way_points.list.len().saturating_sub(self.ahead)
        } else {
            way_points.list.len()
        }
    }

    /// Where to fly from here, moving on this course over the ground, rad, with arcs of this radius, m. `None` behind the last one.
    ///
    /// The first leg begins where the aircraft has turned to the first way-point.
    pub fn follow<const N: usize>(
        &mut self,
        way_points: &WayPoints<N>,
        here: [f32; 2],
        course: f32,
        radius: f32,
    ) -> Option<Followed> {
        if self.cleared != way_points.cleared {
            *self = Self { cleared: way_points.cleared, ..Self::default() };
        }
        let list = &way_points.list;
        if let Some(id) = self.id {
            match list.iter().position(|known| known.id == id) {
                Some(place) => self.ahead = place,
                None => self.leg = Leg::Line,
            }
        }
        self.ahead = self.ahead.min(list.len());
        // Each turn takes one way-point away, so it ends.
        let followed = loop {
            let Some(target) = list.get(self.ahead).copied() else { break None };
            let from = *self.from.get_or_insert(here);
            let next = list.get(self.ahead + 1).copied();
            let along = direction(from, target.place);
            let towards = math::atan2(along[1], along[0]);
            if !self.joined {
                self.from = Some(here);
                self.joined = math::wrap_angle(course - towards).abs() < FACES;
            }
            let corner = next.and_then(|next| Corner::new(from, target.place, next.place, radius));
            let is_over = match (self.leg, &corner) {
                (Leg::Line, Some(corner)) => is_behind(here, corner.begin, along),
                (Leg::Line, None) => is_behind(here, target.place, along),
                (Leg::Arc, Some(corner)) => is_behind(here, corner.end, corner.out),
                (Leg::Arc, None) => true,
            };
            match (self.leg, corner) {
                (Leg::Line, Some(_)) if is_over => self.leg = Leg::Arc,
                _ if is_over => {
                    self.from = Some(target.place);
                    (self.ahead, self.leg) = (self.ahead + 1, Leg::Line);
                }
                (Leg::Arc, Some(corner)) => {
                    break Some(Followed { track: corner.arc, way_point: target, is_last: false });
                }
                _ => {
                    let track = Track::Line { through: target.place, course: towards };
                    break Some(Followed { track, way_point: target, is_last: next.is_none() });
                }
            }
        };
        self.id = followed.map(|followed| followed.way_point.id);
        followed
    }
}

/// The arc between two legs.
struct Corner {
    arc: Track,
    /// Where the first leg is left, and the second one met.
    begin: [f32; 2],
    end: [f32; 2],
    /// Direction of the second leg.
    out: [f32; 2],
}

impl Corner {
    /// `None` where the legs are one line, lead back, or are too short for it.
    fn new(from: [f32; 2], at: [f32; 2], to: [f32; 2], radius: f32) -> Option<Self> {
        let [into, out] = [direction(from, at), direction(at, to)];
        let (cross, dot) = (into[0] * out[1] - into[1] * out[0], into[0] * out[0] + into[1] * out[1]);
        let turn = math::atan2(cross, dot);
        if !(STRAIGHT..BACK).contains(&turn.abs()) {
            return None;
        }
        let before = radius * math::tan(0.5 * turn.abs());
        // No number is no arc.
        if before.is_nan() || before >= 0.5 * distance(from, at).min(distance(at, to)) {
            return None;
        }
        let begin = [at[0] - before * into[0], at[1] - before * into[1]];
        let end = [at[0] + before * out[0], at[1] + before * out[1]];
        let side = if turn > 0.0 { radius } else { -radius };
        let centre = [begin[0] - side * into[1], begin[1] + side * into[0]];
        Some(Self { arc: Track::Orbit { centre, radius, clockwise: turn > 0.0 }, begin, end, out })
    }
}

fn distance(from: [f32; 2], to: [f32; 2]) -> f32 {
    let [north, east] = [to[0] - from[0], to[1] - from[1]];
    math::sqrt(north * north + east * east)
}

/// Unit vector from one to the other; north when they are the same place.
fn direction(from: [f32; 2], to: [f32; 2]) -> [f32; 2] {
    let length = distance(from, to);
    if length > 1e-3 { [(to[0] - from[0]) / length, (to[1] - from[1]) / length] } else { [1.0, 0.0] }
}

/// Is `here` beyond the line across `along` through `place`?
fn is_behind(here: [f32; 2], place: [f32; 2], along: [f32; 2]) -> bool {
    (here[0] - place[0]) * along[0] + (here[1] - place[1]) * along[1] >= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point(id: u32, north: f32, east: f32) -> WayPoint {
        WayPoint { id, place: [north, east], height: 50.0 }
    }

    /// Follows them exactly, and says in which order they were ahead, and how far it ever was from a path that it had just been given.
    fn fly<const N: usize>(list: &WayPoints<N>, mut here: [f32; 2]) -> (std::vec::Vec<(u32, bool)>, f32) {
        let mut heading = [1.0, 0.0];
        let config = crate::fixed_wing::TrackConfig { line_gain: 1.0, orbit_gain: 20.0, ..Default::default() };
        let (mut follower, mut seen, mut off) = (Follower::default(), std::vec::Vec::new(), 0f32);
        for _ in 0..200_000 {
            let Some(followed) = follower.follow(list, here, math::atan2(heading[1], heading[0]), 40.0) else {
                return (seen, off);
            };
            let steering = followed.track.steer(here, heading, &config);
            off = off.max(steering.aside.abs());
            let now = (followed.way_point.id, matches!(followed.track, Track::Orbit { .. }));
            if seen.last() != Some(&now) {
                seen.push(now);
            }
            let (sin, cos) = math::sin_cos(steering.course);
            heading = [cos, sin];
            here = [here[0] + 0.1 * cos, here[1] + 0.1 * sin];
        }
        panic!("never ends: {seen:?}");
    }

    #[test]
    fn arcs_join_the_legs_without_a_step() {
        let mut list = WayPoints::<8>::default();
        for way_point in [point(1, 300.0, 0.0), point(2, 300.0, 300.0), point(3, -100.0, 300.0), point(4, 250.0, 40.0)]
        {
            list.append(way_point).unwrap();
        }
        let (seen, off) = fly(&list, [0.0, 0.0]);
        assert_eq!(seen, [(1, false), (1, true), (2, false), (2, true), (3, false), (3, true), (4, false)]);
        assert!(off < 0.3, "{off} m");
    }

    #[test]
    fn edits_do_not_lose_the_place() {
        let mut list = WayPoints::<4>::default();
        for id in 1..=3 {
            list.append(point(id, 100.0 * id as f32, 0.0)).unwrap();
        }
        let mut follower = Follower::default();
        let mut ahead = |list: &WayPoints<4>, north: f32| {
            let followed = follower.follow(list, [north, 0.0], 0.0, 10.0);
            (followed.map(|followed| followed.way_point.id), follower.remaining(list))
        };
        assert_eq!(ahead(&list, 0.0), (Some(1), 3));
        assert_eq!(ahead(&list, 150.0), (Some(2), 2));
        list.delete(1).unwrap();
        assert_eq!(ahead(&list, 151.0), (Some(2), 2), "the one behind is gone");
        list.insert(2, point(9, 180.0, 0.0)).unwrap();
        assert_eq!(ahead(&list, 152.0), (Some(2), 2), "it flies to number 2 already");
        list.update(point(9, 170.0, 5.0)).unwrap();
        assert_eq!(list.list()[0].place, [170.0, 5.0]);
        assert_eq!(list.append(point(9, 0.0, 0.0)), Err(EditError::Known));
        assert_eq!(list.append(point(5, f32::NAN, 0.0)), Err(EditError::NotFinite));
        list.append(point(5, 0.0, 0.0)).unwrap();
        assert_eq!(list.append(point(6, 0.0, 0.0)), Err(EditError::Full));
        assert_eq!(list.insert(77, point(6, 0.0, 0.0)), Err(EditError::Unknown));
        list.clear();
        list.append(point(8, 0.0, 300.0)).unwrap();
        assert_eq!(ahead(&list, 153.0), (Some(8), 1), "a new list is flown from its beginning");
        list.clear();
        assert_eq!(ahead(&list, 154.0), (None, 0));
    }

    proptest! {
        #[test]
        fn any_list_has_an_end(places in prop::collection::vec(prop::array::uniform2(-400f32..400.0), 1..6)) {
            let mut list = WayPoints::<8>::default();
            for (id, [north, east]) in places.iter().enumerate() {
                list.append(point(id as u32, *north, *east)).unwrap();
            }
            fly(&list, [0.0, 0.0]);
        }
    }
}
