//! What is wanted of the aircraft, by whom, and where to: commands, changes of the way-points, and the watch that overrules both.
//!
//! The path manager asks it once in a cycle. What becomes of an order, and in which mode, is not its business.

use crate::Config;
use crate::messages::{EditRefusal, Safety, Troubles, WayPointEdit};
use crate::modes::{CAPACITY, Order};
use stampfly_control::fixed_wing::{EditError, WayPoint, WayPoints};
use stampfly_types::messages::{GuidedCommand, GuidedKind};
use stampfly_types::{Origin, Vec3};

/// Orders, and the way-points that belong to them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Orders {
    /// What is wanted.
    pub order: Order,
    /// The middle of an orbit to hold in, instead of the way-points.
    pub hold: Option<[f32; 2]>,
    /// May the propeller turn?
    pub armed: bool,
    /// Does the watch fly it?
    pub failsafe: bool,
    /// Where to fly.
    pub way_points: WayPoints<CAPACITY>,
    /// Of the last change of the way-points, and how many were refused.
    pub refusal: EditRefusal,
    /// See `refusal`.
    pub refused: u32,
    next_id: u32,
    /// For how long the watch has flown it, s.
    overruled: f32,
}

impl Default for Orders {
    fn default() -> Self {
        Self {
            order: Order::Stand,
            hold: None,
            armed: false,
            failsafe: false,
            way_points: WayPoints::default(),
            refusal: EditRefusal::None,
            refused: 0,
            next_id: 1,
            overruled: 0.0,
        }
    }
}

/// What the aircraft is in when a command comes.
#[derive(Clone, Copy, Debug)]
pub struct Circumstances {
    /// m north and east of home; `None` while nobody knows.
    pub position: Option<[f32; 2]>,
    /// May it be armed?
    pub may_arm: bool,
    /// Does it stand on its wheels?
    pub on_ground: bool,
}

impl Orders {
    /// Does what somebody asks for.
    pub fn obey(&mut self, command: &GuidedCommand, circumstances: &Circumstances) {
        match command.kind {
            GuidedKind::Arm => self.armed |= circumstances.may_arm,
            GuidedKind::TakeOff if self.armed && matches!(self.order, Order::Stand | Order::Fly) => {
                (self.order, self.failsafe) = (Order::Fly, false);
            }
            GuidedKind::WayPoint => {
                let Vec3 { x, y, z, .. } = command.position;
                let way_point = WayPoint { id: self.next_id, place: [x, y], height: -z };
                let result = self.way_points.append(way_point);
                self.record(result);
                self.next_id = self.next_id.wrapping_add(1);
                self.fly_on(None);
            }
            GuidedKind::Hold => {
                self.way_points.clear();
                self.fly_on(circumstances.position);
            }
            GuidedKind::Land if self.order == Order::Fly => self.order = Order::Land,
            GuidedKind::Disarm if self.order == Order::Stand || circumstances.on_ground => self.disarm(),
            GuidedKind::Disarm => self.order = Order::Land,
            GuidedKind::Kill => self.disarm(),
            _ => {}
        }
    }

    /// Changes the way-points.
    pub fn edit(&mut self, edit: &WayPointEdit, origin: Option<&Origin>) {
        // Numbers that commands give are new ones.
        self.next_id = self.next_id.max(edit.id.saturating_add(1));
        let result = self.way_points.edit(edit, origin);
        self.record(result);
    }

    fn record(&mut self, result: Result<(), EditError>) {
        self.refused = self.refused.wrapping_add(u32::from(result.is_err()));
        self.refusal = result.into();
    }

    /// Somebody wants something again: the watch gives it back, and a landing is given up.
    fn fly_on(&mut self, hold: Option<[f32; 2]>) {
        (self.hold, self.failsafe) = (hold, false);
        if self.order != Order::Stand {
            self.order = Order::Fly;
        }
    }

    /// The propeller stands, and nothing is wanted any more.
    pub fn disarm(&mut self) {
        (self.armed, self.order, self.hold) = (false, Order::Stand, None);
    }

    /// What is wrong goes before what is wanted. `dt` seconds after the last time; `is_placed`: does it know where it is?
    pub fn overrule(&mut self, dt: f32, safety: &Safety, is_placed: bool, p: &Config) {
        self.overruled = if self.failsafe { self.overruled + dt } else { 0.0 };
        let comes_home = safety.troubles.contains(Troubles::LINK) || safety.troubles.contains(Troubles::FENCE);
        if self.order != Order::Stand && comes_home {
            (self.hold, self.failsafe) = (Some([0.0; 2]), true);
        }
        let has_to_land = safety.troubles.contains(Troubles::BATTERY) || self.overruled > p.limits.link_land;
        let is_blind = safety.position > p.limits.blind || !is_placed && has_to_land;
        match self.order {
            // Armed, standing, and nobody there: its propeller starts for nobody else.
            Order::Stand if safety.troubles.contains(Troubles::LINK) => self.disarm(),
            Order::Stand => {}
            _ if is_blind => (self.order, self.failsafe) = (Order::Down, true),
            Order::Down => self.order = Order::Land,
            Order::Fly if has_to_land => (self.order, self.failsafe) = (Order::Land, true),
            _ => {}
        }
    }
}
