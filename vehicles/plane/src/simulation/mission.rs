//! The aircraft's missions by name, and how near it comes to a place.

use stampfly_sim::station::Mission;
use std::prelude::v1::*;

/// A place is reached within this distance, m: the next one is known before the aircraft has to turn.
pub const REACH: f32 = 110.0;
/// And a take-off is over at this height, m.
pub const HEIGHT: f32 = 40.0;

/// Around the field, and the same twice; there and back.
const ROUND: &str = "take-off; 36.5626949,136.7000000,60; 36.5626949,136.6966450,60; 36.5573051,136.6966450,70; \
                     36.5573051,136.7000000,60; hold 30; land";
const HOP: &str = "take-off; 36.5626949,136.7000000,60; land";

/// The mission of this name, or of this text.
///
/// # Errors
/// Says what in it is none.
pub fn mission(text: &str) -> Result<Mission, String> {
    match text {
        "round" => ROUND.parse(),
        "twice" => format!("{ROUND}; {ROUND}").parse(),
        "hop" => HOP.parse(),
        text => text.parse().map_err(|error| format!("round, twice, hop, or items: {error}")),
    }
}
