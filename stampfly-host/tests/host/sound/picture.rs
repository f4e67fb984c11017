//! A flow sensor of another scale, that is late and mounted askew, in brisk flight.

use super::*;
use crate::losses::harness::{Lies, climb, run_in, send};
use stampfly_types::math;
use stampfly_types::messages::FlowData;

/// Scale about x and y, how much later than the model's camera, shares of a sample, and the angle
/// at which it is mounted, rad.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    scale: [f32; 2],
    late: f32,
    askew: f32,
}

/// Recordings fit scales of 0.79 to 1.11, of most 12 % at most; pictures are 4 to 12 ms late, where
/// 4 are expected.
pub const CAMERAS: [Camera; 8] = [
    Camera { scale: [1.12, 1.12], late: 0.0, askew: 0.0 },
    Camera { scale: [0.88, 0.88], late: 0.0, askew: 0.0 },
    Camera { scale: [1.12, 0.88], late: 0.0, askew: 0.0 },
    Camera { scale: [1.0, 1.0], late: 0.8, askew: 0.0 },
    Camera { scale: [1.0, 1.0], late: 0.0, askew: 0.035 },
    Camera { scale: [1.12, 1.12], late: 0.8, askew: 0.035 },
    Camera { scale: [0.88, 0.88], late: 0.8, askew: -0.035 },
    Camera { scale: [1.12, 0.88], late: 0.4, askew: 0.035 },
];

impl Camera {
    pub fn lies(self) -> Lies {
        let Self { scale: [along, across], late, askew } = self;
        let mut before = [0.0; 2];
        let lie = move |_: f32, flow: &mut FlowData| {
            let now = [flow.delta_x, flow.delta_y];
            let [x, y]: [f32; 2] = core::array::from_fn(|axis| late * before[axis] + (1.0 - late) * now[axis]);
            before = now;
            flow.delta_x = along * (x * math::cos(askew) + y * math::sin(askew));
            flow.delta_y = across * (y * math::cos(askew) - x * math::sin(askew));
        };
        Lies { flow: Some(Box::new(lie)), ..Lies::default() }
    }
}

/// Sticks about both axes one after the other and together, and a turn: roll, pitch, yaw, and for
/// how long, s.
pub const STICKINGS: [(f32, f32, f32, f32); 15] = [
    (0.9, 0.0, 0.0, 0.4),
    (-0.9, 0.0, 0.0, 0.4),
    (0.0, 0.0, 0.0, 0.8),
    (0.0, 0.9, 0.0, 0.4),
    (0.0, -0.9, 0.0, 0.4),
    (0.0, 0.0, 0.0, 0.8),
    (-0.7, 0.7, 0.0, 0.5),
    (0.7, -0.7, 0.0, 0.5),
    (0.0, 0.0, 1.0, 1.0),
    (1.0, 0.0, 0.0, 0.3),
    (-1.0, 0.0, 0.0, 0.3),
    (0.0, -1.0, 0.0, 0.3),
    (0.0, 1.0, 0.0, 0.3),
    (0.7, 0.7, 0.5, 0.4),
    (-0.7, -0.7, 0.5, 0.4),
];

/// What still fails among the thorough flights, one of 96: the camera that is wrong in every way at
/// once, at 2.5 m.
const KNOWN: &str = "Camera { scale: [1.12, 1.12], late: 0.8, askew: 0.035 } in AltHold, seed 1:";

#[test]
fn brisk_flight_convicts_no_flow() {
    let mut found = Vec::new();
    for seed in seeds() {
        for mode in [FlightMode::Stabilize, FlightMode::AltHold, FlightMode::PosHold] {
            for camera in CAMERAS {
                let seen = run_in(
                    |_| {},
                    camera.lies(),
                    seed,
                    60.0,
                    |mut hands| {
                        Box::pin(async move {
                            hands.lying.set(Some(hands.clock.now()));
                            let sticks = PilotInput { mode, arm: true, ..STICKS };
                            if mode == FlightMode::Stabilize {
                                rise(&mut hands, 1.4).await;
                            } else {
                                climb(&mut hands, 1.8).await;
                                send(&mut hands, 0.5, sticks).await;
                            }
                            for round in 0..2 {
                                for (roll, pitch, yaw, seconds) in STICKINGS {
                                    let flown = PilotInput { roll, pitch, yaw, ..sticks };
                                    if mode == FlightMode::Stabilize {
                                        hold(&mut hands, seconds, 1.4 + 0.8 * round as f32, flown).await;
                                    } else {
                                        let throttle = if round == 1 { 0.3 } else { 0.0 };
                                        send(&mut hands, seconds, PilotInput { throttle, ..flown }).await;
                                    }
                                }
                            }
                            hands.leave();
                            hands.sleep(0.1).await;
                        })
                    },
                );
                let accused = seen.accused(CONVICTS, seen.touches_after(1.0)).map(|(all, height)| (names(all), height));
                let flown = format!("{camera:?} in {mode:?}, seed {seed}: {accused:?}");
                println!("{flown}");
                if accused.is_some() {
                    found.push(flown);
                }
            }
        }
    }
    let (known, found): (Vec<_>, Vec<_>) = found.into_iter().partition(|flown| flown.starts_with(KNOWN));
    none(&found);
    assert_eq!(known.len(), thorough(0, 1), "a known failure ends well");
}
