//! Stick files: recorded or scripted stick input, for vehicles flown by sticks.
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
//! | column | content |
//! |---|---|
//! | `t` | seconds, 0 to 3600, not descending. A row holds until the next one |
//! | `throttle` | −1 (stick at its lowest) to 1 |
//! | `roll`, `pitch`, `yaw` | −1 to 1: right, forward (nose down), clockwise seen from above |
//! | `mode` | `stabilize`, `acro`, `althold` or `poshold` |
//! | `arm` | arm switch, 0 or 1 |
//! | `flip`, `land` | optional, 0 or 1: a rising edge is a request to the vehicle |
//! | `kill` | optional: kill switch, on while 1 |
//!
//! Columns may be in any order. Lines may end with CR LF; a byte order mark is ignored.
//!
//! | part | purpose |
//! |---|---|
//! | [`StickFile`], [`Row`] | the rows; parses and writes the table |
//! | [`DRAWN`] | prefix that selects sticks drawn from a seed instead of a file |
//! | [`StickError`] | error in a table, with its line |
//! | [`Player`] | the row that the transmitter sends at an instant |
//! | [`StickOptions`], [`Sticks`], [`Start`] | options of flying a file: as typed, and resolved for a vehicle |
//! | [`Throttle`] | conversion of throttle between vehicles |
//!
//! For a vehicle that flies autonomously use a mission instead.

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
