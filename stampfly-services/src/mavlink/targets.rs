//! Set-points: a place to fly to, or how to move.
//!
//! | message | the vehicle flies |
//! |---|---|
//! | `SET_POSITION_TARGET_LOCAL_NED` with a place | the place; velocities beside it are not needed |
//! | with velocities | [the velocity](super::leading), with a height instead of the vertical one if there is one; heading or rate of turn |
//! | with accelerations | the velocity changes so; without velocities, the one that the vehicle has |
//! | `SET_POSITION_TARGET_GLOBAL_INT` | the same, of a vehicle that knows where on Earth it is |
//!
//! Others are refused aloud. Attitudes and forces are among them: a program that flies those has to
//! hear the vehicle within a hundredth of a second.

use super::commands::Turn;
use super::leading::{Motion, NotLed};
use super::unserved::Unserved;
use crate::goal::why_not;
use crate::refusal::Refusal;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_types::messages::{FlightPhase, FlightStatus, GuidedCommand, StateEstimate};
use stampfly_types::{Vec3, frame};

type Mask = PositionTargetTypemask;
const NO_PLACE: Mask = Mask::POSITION_TARGET_TYPEMASK_X_IGNORE.union(Mask::POSITION_TARGET_TYPEMASK_Y_IGNORE);
const NO_HEIGHT: Mask = Mask::POSITION_TARGET_TYPEMASK_Z_IGNORE;
const NO_VELOCITY: Mask = Mask::POSITION_TARGET_TYPEMASK_VX_IGNORE.union(Mask::POSITION_TARGET_TYPEMASK_VY_IGNORE);
const NO_CLIMB: Mask = Mask::POSITION_TARGET_TYPEMASK_VZ_IGNORE;
const NO_ACCELERATION: Mask = Mask::POSITION_TARGET_TYPEMASK_AX_IGNORE.union(Mask::POSITION_TARGET_TYPEMASK_AY_IGNORE);
const NO_LIFT: Mask = Mask::POSITION_TARGET_TYPEMASK_AZ_IGNORE;
const FORCES: Mask = Mask::POSITION_TARGET_TYPEMASK_FORCE_SET;
const NO_YAW: Mask = Mask::POSITION_TARGET_TYPEMASK_YAW_IGNORE;
const NO_YAW_RATE: Mask = Mask::POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE;
/// No number of a velocity is beyond this, m/s, rad, rad/s, m.
const FASTEST: f32 = 100.0;
/// No acceleration is beyond this, m/s²: twice that of gravity.
const HARDEST: f32 = 20.0;

/// Flies a set-point, or says why not.
pub(super) fn fly<C: Copy + PartialEq, const ITEMS: usize>(
    mut turn: Turn<'_, '_, C, ITEMS>,
    target: &SET_POSITION_TARGET_LOCAL_NED_DATA,
) {
    let mask = target.type_mask;
    let status = turn.access.view().state();
    if status.phase != FlightPhase::Flying {
        return turn.client.complain(Unserved::Target, &grounded(&status), turn.put);
    }
    let Some((_, estimate)) = turn.access.view().estimate() else { return };
    let is_led = !mask.intersects(NO_VELOCITY)
        || !mask.intersects(NO_ACCELERATION)
        || !mask.contains(NO_HEIGHT | NO_CLIMB | NO_LIFT);
    if !mask.intersects(NO_PLACE | NO_HEIGHT) {
        turn.go_to(target, &estimate);
    } else if mask.contains(FORCES) && !mask.contains(NO_ACCELERATION | NO_LIFT) {
        turn.client.complain(Unserved::Target, &"forces are not flown", turn.put);
    } else if mask.contains(NO_PLACE) && is_led {
        turn.lead(target, &estimate, &status);
    } else {
        turn.client.complain(Unserved::Target, &"no place, velocity or acceleration in it", turn.put);
    }
}

/// The same of places on Earth.
pub(super) fn fly_on_earth<C: Copy + PartialEq, const ITEMS: usize>(
    turn: Turn<'_, '_, C, ITEMS>,
    target: &SET_POSITION_TARGET_GLOBAL_INT_DATA,
) {
    let Some(origin) = turn.own.origin else {
        return turn.client.complain(Unserved::Target, &"where on Earth it is, is not known", turn.put);
    };
    let z = match target.coordinate_frame {
        MavFrame::MAV_FRAME_GLOBAL | MavFrame::MAV_FRAME_GLOBAL_INT => origin.down(target.alt),
        MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT | MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT => -target.alt,
        _ => return turn.client.complain(Unserved::Target, &"not in this frame", turn.put),
    };
    let [x, y] = origin.local(target.lat_int, target.lon_int);
    let SET_POSITION_TARGET_GLOBAL_INT_DATA { vx, vy, vz, afx, afy, afz, yaw, yaw_rate, type_mask, .. } = *target;
    let (target_system, target_component) = (target.target_system, target.target_component);
    let (time_boot_ms, coordinate_frame) = (target.time_boot_ms, MavFrame::MAV_FRAME_LOCAL_NED);
    fly(
        turn,
        &SET_POSITION_TARGET_LOCAL_NED_DATA {
            time_boot_ms,
            x,
            y,
            z,
            vx,
            vy,
            vz,
            afx,
            afy,
            afz,
            yaw,
            yaw_rate,
            type_mask,
            target_system,
            target_component,
            coordinate_frame,
        },
    );
}

/// Why a vehicle in this state goes nowhere.
const fn grounded(status: &FlightStatus) -> &'static str {
    match status.phase {
        FlightPhase::TakeOff => "it takes off",
        FlightPhase::Landing => "it lands",
        FlightPhase::Flip => "it turns over",
        _ => "take off first",
    }
}

impl<C: Copy + PartialEq, const ITEMS: usize> Turn<'_, '_, C, ITEMS> {
    /// Sends the vehicle to a place. Programs repeat the same target many times a second: only a
    /// new one is passed on.
    fn go_to(&mut self, target: &SET_POSITION_TARGET_LOCAL_NED_DATA, estimate: &StateEstimate) {
        let asked = Vec3::new(target.x, target.y, target.z);
        let present = frame::yaw(&estimate.attitude);
        let position = match target.coordinate_frame {
            MavFrame::MAV_FRAME_LOCAL_NED => asked,
            MavFrame::MAV_FRAME_LOCAL_OFFSET_NED => estimate.position + asked,
            MavFrame::MAV_FRAME_BODY_FRD | MavFrame::MAV_FRAME_BODY_OFFSET_NED => {
                estimate.position + frame::from_yaw(present).transform_vector(&asked)
            }
            _ => return self.client.complain(Unserved::Target, &"not in this frame", self.put),
        };
        let turns = !target.type_mask.contains(NO_YAW);
        let yaw = if turns { target.yaw } else { present };
        let [x, y, z] = asked.to_array();
        // Without a heading of its own, the present one must not make the target look new.
        let new = [x, y, z, if turns { yaw } else { 0.0 }];
        // What a mission has done since makes an old target a new one.
        if self.client.target == Some(new) && !self.missions.runner.is_running() {
            return;
        }
        match self.access.fly_to(self.now, self.requester, GuidedCommand { position, yaw, ..Default::default() }) {
            Ok(()) => {
                self.client.target = Some(new);
                self.missions.runner.halt();
                self.leading.stop();
            }
            Err(refusal) => self.client.complain(Unserved::Target, &refusal, self.put),
        }
    }

    /// Leads the vehicle at a velocity, or by an acceleration.
    fn lead(&mut self, target: &SET_POSITION_TARGET_LOCAL_NED_DATA, estimate: &StateEstimate, status: &FlightStatus) {
        let mask = target.type_mask;
        let part = |ignored: Mask, number: f32| if mask.intersects(ignored) { 0.0 } else { number };
        let velocity = Vec3::new(part(NO_VELOCITY, target.vx), part(NO_VELOCITY, target.vy), part(NO_CLIMB, target.vz));
        let acceleration =
            Vec3::new(part(NO_ACCELERATION, target.afx), part(NO_ACCELERATION, target.afy), part(NO_LIFT, target.afz));
        let [velocity, acceleration] = match target.coordinate_frame {
            MavFrame::MAV_FRAME_LOCAL_NED | MavFrame::MAV_FRAME_LOCAL_OFFSET_NED => [velocity, acceleration],
            MavFrame::MAV_FRAME_BODY_NED | MavFrame::MAV_FRAME_BODY_OFFSET_NED | MavFrame::MAV_FRAME_BODY_FRD => {
                let heading = frame::from_yaw(frame::yaw(&estimate.attitude));
                [velocity, acceleration].map(|vector| heading.transform_vector(&vector))
            }
            _ => return self.client.complain(Unserved::Target, &"not in this frame", self.put),
        };
        let down =
            (!mask.contains(NO_HEIGHT) && target.coordinate_frame == MavFrame::MAV_FRAME_LOCAL_NED).then_some(target.z);
        let yaw = (!mask.contains(NO_YAW)).then_some(target.yaw);
        let yaw_rate = if yaw.is_none() { part(NO_YAW_RATE, target.yaw_rate) } else { 0.0 };
        let numbers = [velocity.norm(), yaw_rate, yaw.unwrap_or_default(), down.unwrap_or_default()];
        // A comparison with NaN is false, so NaN is refused.
        let is_sane = numbers.iter().all(|number| number.abs() <= FASTEST) && acceleration.norm() <= HARDEST;
        if !is_sane {
            return self.client.complain(Unserved::Target, &Refusal::Range, self.put);
        }
        // Without a velocity of its own, an acceleration changes the one that the vehicle has.
        let keeps = mask.intersects(NO_VELOCITY) && !mask.intersects(NO_ACCELERATION);
        let keeps_climb = mask.contains(NO_CLIMB) && !mask.contains(NO_LIFT) && down.is_none();
        let said = |keeps: bool, number: f32| (!keeps).then_some(number);
        let velocity = [said(keeps, velocity.x), said(keeps, velocity.y), said(keeps_climb, velocity.z)];
        let motion = Motion { velocity, acceleration: acceleration.to_array(), down, yaw, yaw_rate };
        match self.leading.hear(self.now, self.client.id, self.requester, &motion, self.access) {
            Ok(false) => {}
            Ok(true) => {
                // The same place as before is a new target after this.
                self.client.target = None;
                self.missions.runner.halt();
            }
            Err(NotLed::Refused(refusal)) => self.client.complain(Unserved::Target, &refusal, self.put),
            Err(NotLed::Nowhere) => self.client.complain(Unserved::Target, &"its place is not known", self.put),
            Err(NotLed::NotFollowed) => self.client.complain(Unserved::Target, &why_not(status), self.put),
        }
    }
}
