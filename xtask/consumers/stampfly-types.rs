//! A stranger's program: declares a message of its own.

use stampfly_types::{Message, Vec3, message};

message! {
    /// Wind in the world frame.
    pub struct Wind {
        /// Speed towards north, east, down.
        velocity: Vec3 ["m/s"],
    }
}

fn main() {
    let wind = Wind { velocity: Vec3::new(1.0, 2.0, 0.0) };
    assert_eq!(Wind::from_words(&wind.to_words()), Some(wind));
}
