//! Stick files: what a person's thumbs did, or are to do, for vehicles that are flown by sticks.
//!
//! ```text
//! t,throttle,roll,pitch,yaw,mode,arm,land
//! 0,-1,0,0,0,stabilize,0,0
//! 9,-1,0,0,0,stabilize,1,0
//! 10,0.7,0,0,0,stabilize,1,0
//! 12,0.6,0.3,0,0,stabilize,1,0
//! 15,0,0,0,0,althold,1,1
//! ```
//!
//! | column | what it is |
//! |---|---|
//! | `t` | seconds, from 0 to an hour; it never goes back. A row holds until the next one |
//! | `throttle` | −1, the stick at its lowest, to 1 |
//! | `roll`, `pitch`, `yaw` | −1 to 1: right, forward (nose down), clockwise seen from above |
//! | `mode` | `stabilize`, `acro`, `althold` or `poshold` |
//! | `arm` | the arm switch, 0 or 1 |
//! | `flip`, `land` | may be left out: 0 or 1, and what rises to 1 asks the vehicle once |
//! | `kill` | may be left out: the kill switch, on while 1 |
//!
//! Columns come in any order. Lines may end with CR LF, and a byte order mark is passed over.
//!
//! | part | what it is |
//! |---|---|
//! | [`StickFile`], [`Row`] | the rows; reads and writes the table |
//! | [`DRAWN`] | sticks that are drawn from a seed, in place of a file |
//! | [`StickError`] | why a table is none, with the line |
//! | [`Player`] | which row the transmitter sends when |
//! | [`StickOptions`], [`Sticks`], [`Start`] | how a file is to be flown: as typed, and resolved for a vehicle |
//! | [`Throttle`] | a throttle stick of one vehicle as that of another |
//!
//! Not for a vehicle that flies by itself: that has a mission.

mod drawn;
mod error;
mod file;
mod options;
mod player;
mod throttle;

pub use error::{StickError, StickErrorKind};
pub use file::{LATEST, LONGEST_LINE, MODES, MOST_BYTES, MOST_ROWS, Row, StickFile, mode_named};
pub use options::{DRAWN, START_HEIGHT, Start, StickOptions, Sticks};
pub use player::{Frame, Player};
pub use throttle::Throttle;
