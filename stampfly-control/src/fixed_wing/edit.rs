//! Changes of a list of way-points in flight, as a ground station asks for them: in latitude and longitude, by number.
//!
//! Messages, so that a change travels on a topic, is logged and replays. Not for a mission that a station uploads as a whole, which begins anew.

use super::way_points::{EditError, WayPoint, WayPoints};
use stampfly_types::{Origin, message, message_enum};

message_enum! {
    /// What to do with a way-point, as the ground station of the document asks for it.
    pub enum EditKind {
        /// Nothing.
        #[default]
        None = 0,
        /// Forget all others; it is the first one.
        Init = 1,
        /// Put it behind the last one.
        Append = 2,
        /// Put it before another one.
        Insert = 3,
        /// Move the one with its number.
        Update = 4,
        /// Take the one with its number out.
        Delete = 5,
        /// Forget all of them.
        Nuke = 6,
    }
}

message! {
    /// A change of the list of way-points.
    pub struct WayPointEdit {
        /// What to do.
        kind: EditKind,
        /// The way-point's number.
        id: u32,
        /// For `Insert`: the number of the one that it goes before.
        before: u32,
        /// Ten-millionths of a degree, north is positive.
        latitude: i32 ["1e-7 deg"],
        /// Ten-millionths of a degree, east is positive.
        longitude: i32 ["1e-7 deg"],
        /// Above home.
        height: f32 ["m"],
    }
}

message_enum! {
    /// Why a change of the list was refused.
    pub enum EditRefusal {
        /// It was not.
        #[default]
        None = 0,
        /// There is no room.
        Full = 1,
        /// No way-point has this number.
        Unknown = 2,
        /// One with this number is in the list.
        Known = 3,
        /// A number of it is none, or nobody knows where home is.
        NoPlace = 4,
    }
}

impl From<Result<(), EditError>> for EditRefusal {
    fn from(result: Result<(), EditError>) -> Self {
        match result {
            Ok(()) => Self::None,
            Err(EditError::Full) => Self::Full,
            Err(EditError::Unknown) => Self::Unknown,
            Err(EditError::Known) => Self::Known,
            Err(EditError::NotFinite) => Self::NoPlace,
        }
    }
}

impl<const N: usize> WayPoints<N> {
    /// Does what a change asks for. Without an origin a place is none.
    ///
    /// ```
    /// use stampfly_control::fixed_wing::{EditError, EditKind, WayPointEdit, WayPoints};
    /// use stampfly_types::Origin;
    /// let mut list = WayPoints::<8>::default();
    /// let first = WayPointEdit { kind: EditKind::Init, id: 7, latitude: 10_000, height: 50.0, ..Default::default() };
    /// assert_eq!(list.edit(&first, None), Err(EditError::NotFinite), "nobody knows where that is");
    /// list.edit(&first, Some(&Origin::default()))?;
    /// assert!((list.list()[0].place[0] - 111.3).abs() < 0.1);
    /// # Ok::<(), EditError>(())
    /// ```
    ///
    /// # Errors
    /// As the functions for each kind of change; the list is as it was.
    pub fn edit(&mut self, edit: &WayPointEdit, origin: Option<&Origin>) -> Result<(), EditError> {
        let WayPointEdit { kind, id, before, latitude, longitude, height } = *edit;
        let place = origin.map_or([f32::NAN; 2], |origin| origin.local(latitude, longitude));
        let way_point = WayPoint { id, place, height };
        match kind {
            EditKind::None => Ok(()),
            EditKind::Init => {
                // A place that is none must not cost the list.
                WayPoints::<1>::default().append(way_point)?;
                self.clear();
                self.append(way_point)
            }
            EditKind::Append => self.append(way_point),
            EditKind::Insert => self.insert(before, way_point),
            EditKind::Update => self.update(way_point),
            EditKind::Delete => self.delete(id),
            EditKind::Nuke => {
                self.clear();
                Ok(())
            }
        }
    }
}
