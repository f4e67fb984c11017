//! No detector convicts a sound vehicle, however it is flown and whatever is usual around it.
//!
//! | file | what is usual |
//! |---|---|
//! | `force.rs` | throttle at its ends, flips by hand, tired batteries by hand, gusts |
//! | `packs.rs` | batteries of every resistance and charge, in missions, hovers to the end, climbs |
//! | `thrust.rs` | all the throttle on a battery that is half empty |
//! | `garbage.rs` | inertial samples that are garbage for a twentieth of a second |
//! | `pressure.rs` | doors, fans, and propellers that press on the barometer in either direction |
//! | `picture.rs` | a flow sensor of another scale, that is late and askew, in brisk flight |
//! | `centre.rs` | a centre of mass up to 4 mm beside the middle |
//! | `turning.rs` | room above a flip, and what fails during one |

mod centre;
mod force;
mod garbage;
mod packs;
mod picture;
mod pressure;
mod thrust;
mod turning;

use crate::losses::harness::{Hands, STICKS, Seen};
use crate::thorough::thorough;
use stampfly_types::messages::{Alerts, FlightMode, FlightPhase, PilotInput};
use stampfly_types::{Duration, Instant, Vec3};

/// What no sound vehicle is accused of.
const CONVICTS: Alerts = Alerts::IMPACT
    .with(Alerts::STRUCK)
    .with(Alerts::ACCEL_FAULTY)
    .with(Alerts::GYRO_ANOMALY)
    .with(Alerts::TUMBLED)
    .with(Alerts::IMU_LOST)
    .with(Alerts::IMU_FAULTY)
    .with(Alerts::IMU_NOISY)
    .with(Alerts::FORCE_IMPLAUSIBLE)
    .with(Alerts::MOTOR_WEAK)
    .with(Alerts::MOTOR_LOST)
    .with(Alerts::NO_LIFT)
    .with(Alerts::RANGE_IMPLAUSIBLE)
    .with(Alerts::FLOW_IMPLAUSIBLE)
    .with(Alerts::POWER_IMPLAUSIBLE)
    .with(Alerts::ESTIMATE_DIVERGED);

/// The throttle with which it hovers in a manual mode.
const HOVER: f32 = 0.58;

/// No flight was found to be wrong.
fn none(wrong: &[String]) {
    assert!(wrong.is_empty(), "{} flights:\n{}", wrong.len(), wrong.join("\n"));
}

fn names(alerts: Alerts) -> Vec<&'static str> {
    alerts.names().collect()
}

fn seeds() -> std::ops::RangeInclusive<u64> {
    1..=crate::thorough::flights(1, 4)
}

impl Seen {
    /// Alerts of these kinds until an instant, and how high it was at the first of them, m.
    fn accused(&self, of: Alerts, until: Instant) -> Option<(Alerts, f32)> {
        let found = self.alerts.iter().filter(|(at, _)| *at <= until);
        let all = found.clone().fold(Alerts::NONE, |all, (_, alerts)| all | *alerts);
        let of = |alerts: Alerts| of.without(of.without(alerts));
        let (first, _) = found.clone().find(|(_, alerts)| !of(*alerts).is_empty())?;
        let truth = self.truths.iter().find(|(at, _)| at >= first)?;
        Some((of(all), -truth.1.position.z))
    }

    /// A moment before it first touched the ground after it had been this high, or the end. What it
    /// feels of the ground comes in the same step of the simulation.
    fn touches_after(&self, height: f32) -> Instant {
        let flown = self.truths.iter().skip_while(|(_, truth)| -truth.position.z < height);
        let touched = flown.clone().find(|(_, truth)| truth.contact);
        touched.map_or(Instant::MAX, |(at, _)| *at - Duration::from_millis(10))
    }

    /// It lies on the ground with its motors off, touched it no faster than this, m/s, and upright.
    fn ends_well(&self, fastest: f32) -> bool {
        let (mode, truth) = self.end();
        let upright = (truth.attitude * Vec3::z()).z > 0.94;
        !mode.armed && truth.contact && upright && self.touch_speed() < fastest
    }

    /// How fast it sank when it touched the ground after a flight, m/s.
    fn touch_speed(&self) -> f32 {
        let mut before = 0.0;
        for (_, truth) in self.truths.iter().skip_while(|(_, truth)| -truth.position.z < 0.3) {
            if truth.contact {
                return before;
            }
            before = truth.velocity.z;
        }
        0.0
    }
}

/// A pilot holds this height by thrust, with these sticks, by sight.
async fn hold(hands: &mut Hands<'_>, seconds: f32, height: f32, sticks: PilotInput) {
    for _ in 0..(seconds / 0.02) as u32 {
        let truth = hands.truth();
        let throttle = HOVER + 0.5 * (height + truth.position.z) + 0.35 * truth.velocity.z;
        hands.frame(&PilotInput { arm: true, throttle: throttle.clamp(-0.9, 1.0), ..sticks });
        hands.sleep(0.02).await;
    }
}

/// The same until this becomes true, for so many seconds at most, with these sticks whatever the
/// height is.
async fn until(hands: &mut Hands<'_>, seconds: f32, sticks: PilotInput, stop: impl Fn(f32, f32) -> bool) {
    for _ in 0..(seconds / 0.02) as u32 {
        let truth = hands.truth();
        if stop(-truth.position.z, -truth.velocity.z) {
            return;
        }
        hands.frame(&PilotInput { arm: true, ..sticks });
        hands.sleep(0.02).await;
    }
}

/// A pilot arms in this mode, whose throttle is thrust.
async fn arm(hands: &mut Hands<'_>, mode: FlightMode) {
    let rest = PilotInput { mode, throttle: -1.0, ..STICKS };
    while hands.telemetry().phase != FlightPhase::IdleGround || !hands.telemetry().blocks.is_empty() {
        hands.frame(&rest);
        hands.sleep(0.02).await;
    }
    while !hands.telemetry().armed {
        hands.frame(&PilotInput { arm: true, ..rest });
        hands.sleep(0.02).await;
    }
}

/// A pilot takes off in STABILIZE, rises to this height and stays there.
async fn rise(hands: &mut Hands<'_>, height: f32) {
    arm(hands, FlightMode::Stabilize).await;
    let sticks = PilotInput { mode: FlightMode::Stabilize, ..STICKS };
    hold(hands, 3.0 + height / 1.2, height, sticks).await;
}
