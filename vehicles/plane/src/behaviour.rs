//! Speeds, heights and limits of this aircraft, as [`stampfly_fixed_wing`] asks for them.

use crate::Parameters;
use stampfly_fixed_wing::Config;
use stampfly_fixed_wing::config::{Flare, Ground, Heights, Limits, Paths, Speeds};
use stampfly_fixed_wing::crash::CrashConfig;

/// What these parameters say. What belongs to the strip and to the airframe is the crate's default.
#[must_use]
pub fn config(p: &Parameters) -> Config {
    Config {
        speed: Speeds {
            stall: p.speed.stall,
            rotation: p.speed.rotation,
            climb: p.speed.climb,
            cruise: p.speed.cruise,
            approach_share: p.speed.approach_share,
        },
        height: Heights {
            climbed: p.height.climbed,
            approach: p.height.approach,
            crossing: p.height.crossing,
            flare: p.height.flare,
            decrab: p.height.decrab,
            touchdown: p.height.touchdown,
        },
        path: Paths {
            radius: p.path.radius,
            bank_max: p.path.bank_max,
            bank_low: p.path.bank_low,
            bank_lost: p.path.bank_lost,
            climb_pitch: p.climb.pitch,
        },
        flare: Flare { sink: p.flare.sink, time: p.flare.time, ..Flare::default() },
        ground: Ground { speed: p.speed.taxi, ..Ground::default() },
        limits: Limits {
            link_lost: p.link.lost,
            link_land: p.link.land,
            blind: p.path.blind,
            fence_radius: p.fence.radius,
            fence_height: p.fence.height,
            battery: p.battery.warning,
        },
        crash: CrashConfig::default(),
    }
}
