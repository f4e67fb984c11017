//! A mission item as it came, and the step that it means.
//!
//! Items are kept as they were uploaded, so that a download gives back the same. Whether a vehicle can do what an item says is decided when it is uploaded: the
//! answer is the result that the protocol has for it.

use super::said::Said;
use crate::mission::Step;
use core::f32::consts::TAU;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_types::Origin;
use stampfly_types::{Duration, Vec3};

/// Nobody means a place farther away than this, m: the same limit as for every guided command.
const FARTHEST: f32 = 1_000.0;
/// Longest stay, s.
const LONGEST: f32 = 1_000.0;
/// Of a coordinate in whole numbers: metres by 10⁴, degrees by 10⁷.
const PER_METRE: f32 = 1e4;
/// A coordinate that is not given.
const UNSET: i32 = i32::MAX;

/// How a position is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Frame {
    Local,
    /// Altitude above the origin.
    Relative,
    /// Altitude above the sea.
    Sea,
    /// There is no position in it.
    Nowhere,
}

/// A mission item.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Item {
    command: MavCmd,
    frame: MavFrame,
    parameters: [f32; 4],
    x: i32,
    y: i32,
    z: f32,
    autocontinue: u8,
}

impl From<&MISSION_ITEM_INT_DATA> for Item {
    fn from(item: &MISSION_ITEM_INT_DATA) -> Self {
        let MISSION_ITEM_INT_DATA { param1, param2, param3, param4, x, y, z, command, frame, autocontinue, .. } = *item;
        Self { command, frame, parameters: [param1, param2, param3, param4], x, y, z, autocontinue }
    }
}

/// As older programs send it: metres and degrees.
impl From<&MISSION_ITEM_DATA> for Item {
    fn from(item: &MISSION_ITEM_DATA) -> Self {
        let MISSION_ITEM_DATA { param1, param2, param3, param4, x, y, z, command, frame, autocontinue, .. } = *item;
        let factor = if matches!(kind(frame), Some(Frame::Relative | Frame::Sea)) { 1e7 } else { f64::from(PER_METRE) };
        // To the nearest whole number.
        let scaled = |number: f32| f64::from(number) * factor + if number < 0.0 { -0.5 } else { 0.5 };
        let [x, y] = [x, y].map(|number| if number.is_finite() { scaled(number) as i32 } else { UNSET });
        Self { command, frame, parameters: [param1, param2, param3, param4], x, y, z, autocontinue }
    }
}

const fn kind(frame: MavFrame) -> Option<Frame> {
    match frame {
        MavFrame::MAV_FRAME_LOCAL_NED => Some(Frame::Local),
        MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT | MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT => Some(Frame::Relative),
        MavFrame::MAV_FRAME_GLOBAL | MavFrame::MAV_FRAME_GLOBAL_INT => Some(Frame::Sea),
        MavFrame::MAV_FRAME_MISSION => Some(Frame::Nowhere),
        _ => None,
    }
}

impl Item {
    /// As it is downloaded by this system and component.
    pub fn message(&self, seq: u16, current: bool, [target_system, target_component]: [u8; 2]) -> Said {
        let Self { command, frame, parameters: [param1, param2, param3, param4], x, y, z, autocontinue } = *self;
        let data = MISSION_ITEM_INT_DATA {
            param1,
            param2,
            param3,
            param4,
            x,
            y,
            z,
            seq,
            command,
            target_system,
            target_component,
            frame,
            current: current.into(),
            autocontinue,
            mission_type: MavMissionType::MAV_MISSION_TYPE_MISSION,
        };
        data.into()
    }

    /// Is it this one, to the bit?
    pub fn is(&self, other: &Self) -> bool {
        let bits = |item: &Self| {
            let [a, b, c, d] = item.parameters.map(f32::to_bits);
            ([a, b, c, d, item.z.to_bits()], item.x, item.y)
        };
        let same = (self.command, self.frame, self.autocontinue) == (other.command, other.frame, other.autocontinue);
        same && bits(self) == bits(other)
    }

    /// Is its position one on Earth?
    pub fn is_global(&self) -> bool {
        matches!(kind(self.frame), Some(Frame::Relative | Frame::Sea))
    }

    /// What a vehicle with this origin does.
    ///
    /// # Errors
    /// With the reason why it cannot.
    pub fn step(&self, origin: Option<&Origin>, take_off_height: f32) -> Result<Step, MavMissionResult> {
        type No = MavMissionResult;
        let [p1, p2, _, p4] = self.parameters;
        let seconds = |number: f32| match number {
            number if number.is_nan() => Ok(Duration::ZERO),
            number if (0.0..=LONGEST).contains(&number) => Ok(Duration::from_seconds(number)),
            _ => Err(No::MAV_MISSION_INVALID_PARAM1),
        };
        let go_to = |stay| {
            // Zero asks for the vehicle's own.
            let radius = match p2 {
                radius if radius.is_nan() || radius == 0.0 => None,
                radius if (0.0..=FARTHEST).contains(&radius) => Some(radius),
                _ => return Err(No::MAV_MISSION_INVALID_PARAM2),
            };
            // `%` is exact, so it is the same everywhere.
            let yaw = match p4 {
                yaw if yaw.is_nan() => None,
                yaw if yaw.abs() <= 360.0 => Some(yaw.to_radians() % TAU),
                _ => return Err(No::MAV_MISSION_INVALID_PARAM4),
            };
            let [north, east] = self.horizontal(origin)?.ok_or(No::MAV_MISSION_INVALID_PARAM5_X)?;
            Ok(Step::GoTo { place: Vec3::new(north, east, self.down(origin)?), yaw, radius, stay })
        };
        match self.command {
            MavCmd::MAV_CMD_NAV_WAYPOINT => go_to(Some(seconds(p1)?)),
            MavCmd::MAV_CMD_NAV_LOITER_TIME => go_to(Some(seconds(p1)?)),
            MavCmd::MAV_CMD_NAV_LOITER_UNLIM => go_to(None),
            MavCmd::MAV_CMD_NAV_TAKEOFF => {
                let height = if self.z.is_nan() { take_off_height } else { -self.down(origin)? };
                if height > 0.0 { Ok(Step::TakeOff(height)) } else { Err(No::MAV_MISSION_INVALID_PARAM7) }
            }
            MavCmd::MAV_CMD_NAV_LAND => Ok(Step::Land(self.horizontal(origin)?)),
            MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH => Ok(Step::Land(Some([0.0, 0.0]))),
            MavCmd::MAV_CMD_NAV_DELAY => Ok(Step::Wait(seconds(p1)?)),
            MavCmd::MAV_CMD_DO_CHANGE_SPEED => match p2 {
                // −1 is no change, −2 the vehicle's own; NaN is what programs send that have nothing to say.
                -1.0 => Ok(Step::Wait(Duration::ZERO)),
                speed if speed.is_nan() || speed == -2.0 => Ok(Step::Speed(0.0)),
                speed if speed > 0.0 && speed <= FARTHEST => Ok(Step::Speed(speed)),
                _ => Err(No::MAV_MISSION_INVALID_PARAM2),
            },
            _ => Err(No::MAV_MISSION_UNSUPPORTED),
        }
    }

    /// North and east, m; `None` for where the vehicle is then.
    fn horizontal(&self, origin: Option<&Origin>) -> Result<Option<[f32; 2]>, MavMissionResult> {
        if self.x == UNSET && self.y == UNSET {
            return Ok(None);
        }
        let [north, east] = match self.frame()? {
            Frame::Local => [self.x, self.y].map(|number| number as f32 / PER_METRE),
            Frame::Nowhere => return Ok(None),
            // Programs that have no place to give send zeros.
            Frame::Relative | Frame::Sea if self.x == 0 && self.y == 0 => return Ok(None),
            Frame::Relative | Frame::Sea => {
                origin.ok_or(MavMissionResult::MAV_MISSION_UNSUPPORTED_FRAME)?.local(self.x, self.y)
            }
        };
        match [north.abs() <= FARTHEST, east.abs() <= FARTHEST] {
            [true, true] => Ok(Some([north, east])),
            [true, false] => Err(MavMissionResult::MAV_MISSION_INVALID_PARAM6_Y),
            _ => Err(MavMissionResult::MAV_MISSION_INVALID_PARAM5_X),
        }
    }

    /// How far below the origin, m.
    fn down(&self, origin: Option<&Origin>) -> Result<f32, MavMissionResult> {
        let down = match self.frame()? {
            Frame::Local => self.z,
            Frame::Relative => -self.z,
            Frame::Sea => origin.ok_or(MavMissionResult::MAV_MISSION_UNSUPPORTED_FRAME)?.down(self.z),
            Frame::Nowhere => return Err(MavMissionResult::MAV_MISSION_UNSUPPORTED_FRAME),
        };
        // No number is within them.
        if down.abs() <= FARTHEST { Ok(down) } else { Err(MavMissionResult::MAV_MISSION_INVALID_PARAM7) }
    }

    const fn frame(&self) -> Result<Frame, MavMissionResult> {
        match kind(self.frame) {
            Some(frame) => Ok(frame),
            None => Err(MavMissionResult::MAV_MISSION_UNSUPPORTED_FRAME),
        }
    }
}
