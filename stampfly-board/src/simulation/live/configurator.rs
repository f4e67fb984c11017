//! What the StampFly is for programs that speak MSP.
//!
//! The rows are MultiWii's, in its order. Its bytes are gains; the vehicle has integral and derivative times, and torques for its gains, so the factors are such that the
//! vehicle's own values are in the middle of what a byte holds.

use stampfly_services::msp::{Card, PidRow, PidTerm, Scale};
use stampfly_services::version;

const fn times(parameter: &'static str, factor: f32) -> Option<PidTerm> {
    Some(PidTerm { parameter, scale: Scale::Times(factor) })
}

const fn over(parameter: &'static str, factor: f32) -> Option<PidTerm> {
    Some(PidTerm { parameter, scale: Scale::Over(factor) })
}

const ROWS: &[PidRow] = &[
    PidRow {
        name: "ROLL",
        terms: [times("rate.roll.kp", 1e5), over("rate.roll.ti", 50.0), times("rate.roll.td", 2_000.0)],
    },
    PidRow {
        name: "PITCH",
        terms: [times("rate.pitch.kp", 1e5), over("rate.pitch.ti", 50.0), times("rate.pitch.td", 2_000.0)],
    },
    PidRow {
        name: "YAW",
        terms: [times("rate.yaw.kp", 1e5), over("rate.yaw.ti", 50.0), times("rate.yaw.td", 2_000.0)],
    },
    PidRow { name: "ALT", terms: [times("altitude.alt.kp", 50.0), None, None] },
    PidRow { name: "Pos", terms: [times("position.pos.kp", 50.0), None, None] },
    PidRow { name: "PosR", terms: [times("position.vel.kp", 12.0), over("position.vel.ti", 50.0), None] },
    PidRow { name: "NavR", terms: [None, None, None] },
    PidRow { name: "LEVEL", terms: [times("attitude.tilt.kp", 12.0), None, None] },
    PidRow { name: "MAG", terms: [times("attitude.heading.kp", 12.0), None, None] },
    PidRow { name: "VEL", terms: [times("altitude.vel.kp", 12.0), over("altitude.vel.ti", 50.0), None] },
];

/// What a configurator is told.
pub(super) static CARD: Card = Card {
    variant: *b"SFLY",
    board: *b"SFLY",
    version: version(crate::VERSION),
    name: "StampFly",
    kind: 3,
    motors: 4,
    cycle: 2_500,
    long_analog: true,
    rows: ROWS,
    misc: None,
};
