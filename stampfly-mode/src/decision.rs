//! The decision: what the vehicle does next, as a function of its state and the facts, and of nothing else.
//!
//! [`decide`] is total and has no memory of its own. [`ModeMachine`](crate::ModeMachine) keeps the [`State`] and turns inputs
//! into [`Facts`]; use `decide` directly to explore states, not to fly.
//!
//! # Who has authority
//! The pilot whose switch armed the vehicle, or the program whose command did. In flight the pilot takes over by acting:
//! turning the arm or the mode switch, or moving the sticks. Frames alone do nothing. A program takes over with a new
//! command, unless the pilot flies in a manual mode.
//!
//! # Which mode
//! | phase | mode switch turned | switch and mode differ | program or click |
//! |---|---|---|---|
//! | INIT, IDLE_HELD | kept for later | ignored | ignored |
//! | IDLE_GROUND | applied | the switch is applied | POS_HOLD |
//! | ARMED | applied | ignored | POS_HOLD |
//! | FLYING | applied; a manual mode after ALT_HOLD or POS_HOLD once the throttle stick has passed the hover, ALT_HOLD until then | ignored | ignored |
//! | TAKEOFF, LANDING, FLIP | kept for later | ignored | ignored |
//!
//! A height-holding mode that loses the height stays what it is: the controller comes down without it, and after
//! [`ModeConfig::blind`] the vehicle lands. It never becomes a mode in which the stick is thrust. A manual mode whose sticks
//! fall silent becomes POS_HOLD. A vehicle that no pilot flies and that no longer knows its horizontal velocity lands after
//! [`ModeConfig::adrift`].

use crate::arming;
use crate::config::ModeConfig;
use crate::facts::Facts;
pub use crate::state::{CUT, LAND, NO_FLIP, Silence, State};
use crate::transitions::{Event, is_airborne, is_armed, rows};
use stampfly_types::messages::{
    Alerts, ArmBlocks, ButtonGesture, CommandSource, FlightMode, FlightPhase, FlipBlocks, GroundContact, Validity,
};
use stampfly_types::{Duration, Instant};

/// Alerts with which the accelerometer shows neither motion nor the ground under the legs.
pub const UNFELT: Alerts = Alerts::FORCE_IMPLAUSIBLE.with(Alerts::ACCEL_FAULTY);
/// Cosine of the largest tilt, 15°, before and after turning over.
const LEVEL: f32 = 0.966;
/// A take-off in ACRO is over after this time, legs free or not. It levels the vehicle, and on one that a
/// hand holds that fills the integrals of the rate loops. A take-off frees its legs within a second.
const ACRO_TAKE_OFF: Duration = Duration::from_secs(3);

impl State {
    /// Is the vehicle so close to the ground that the motors may be stopped?
    #[must_use]
    fn is_low(&self, config: &ModeConfig, facts: &Facts) -> bool {
        facts.contact == GroundContact::Ground || facts.known_height().is_some_and(|height| height < config.stop_height)
    }
}

/// The next state.
///
/// ```
/// use stampfly_mode::decision::{State, decide};
/// use stampfly_mode::{Facts, ModeConfig};
/// use stampfly_types::messages::{CommandSource, FlightMode, FlightPhase, GroundContact, Validity};
///
/// let flying = State {
///     phase: FlightPhase::Flying,
///     wanted: FlightMode::Stabilize,
///     commander: CommandSource::Pilot,
///     ..State::default()
/// };
/// // The pilot has fallen silent.
/// let facts = Facts { valid: Validity::ALL, contact: GroundContact::Air, sticks: CommandSource::Failsafe, ..Facts::default() };
/// let next = decide(&ModeConfig::default(), &flying, &facts);
/// assert_eq!((next.phase, next.mode), (FlightPhase::Flying, FlightMode::PosHold));
/// ```
#[must_use]
pub fn decide(config: &ModeConfig, state: &State, facts: &Facts) -> State {
    let mut next = *state;
    advance(config, &mut next, facts);
    next
}

/// [`decide`] in place: a copy of the state is 130 instructions.
pub(crate) fn advance(config: &ModeConfig, state: &mut State, facts: &Facts) {
    let (was_armed, was_manual) = (state.is_armed(), state.mode.is_manual());
    watch_link(config, state, facts);
    choose_commander(state, facts);
    choose_mode(config, state, facts);
    watch_pairing(config, state, facts);
    watch_height(state, facts);
    state.inverted |= facts.upright < 0.0;
    state.lands_next = state.phase == FlightPhase::Flip && (state.lands_next || lands(config, state, facts));
    // A person has come to look at the vehicle. A press alone is no sign of it: what it becomes may be a click, which must not
    // find the crash acknowledged and arm.
    let gesture = facts.button.is_some_and(|gesture| gesture != ButtonGesture::Press);
    let acknowledges = !was_armed && (facts.pilot.switch.falls || gesture || facts.asked.disarm);
    let next = rows(state.phase).iter().find(|row| happens(row.event, config, was_manual, state, facts));
    // What is acknowledged in this step does not arm in it.
    if acknowledges {
        state.unacknowledged = ArmBlocks::NONE;
    }
    if let Some(row) = next {
        leave_and_enter(config, state, facts, row.event, row.to);
    } else if state.phase == FlightPhase::Landing && facts.pilot.switch.falls {
        // The pilot wants this landing, whatever began it. The next switch-off means more.
        state.landing_by_switch = true;
    }
    let diverged = facts.alerts.contains(Alerts::ESTIMATE_DIVERGED);
    if diverged && !state.diverged {
        state.full_resets = state.full_resets.wrapping_add(1);
    }
    state.diverged = diverged;
}

/// A silence ends when the commander has been heard for a while: a link that flaps is none.
fn watch_link(config: &ModeConfig, state: &mut State, facts: &Facts) {
    let silent = facts.alerts.contains(Alerts::COMM_LOST);
    state.silence = match state.silence {
        _ if !state.is_armed() => None,
        None if silent => Some(Silence { since: facts.now, heard_since: None }),
        Some(silence) if silent => Some(Silence { heard_since: None, ..silence }),
        Some(silence) => {
            let heard = silence.heard_since.unwrap_or(facts.now);
            let over =
                facts.now.since(heard) >= config.link_back && facts.now.since(silence.since) >= config.link_back * 2;
            (!over).then_some(Silence { heard_since: Some(heard), ..silence })
        }
        None => None,
    };
}

fn choose_commander(state: &mut State, facts: &Facts) {
    if !state.is_armed() {
        state.commander = CommandSource::None;
        return;
    }
    let pilot = &facts.pilot;
    let acts = pilot.deflected || pilot.mode_turned || pilot.switch.rises || pilot.switch.falls;
    let manual = state.wanted.is_manual() || state.throttle_above.is_some();
    let retakes = facts.asked.flies() && !manual;
    // On the ground no flight is interrupted.
    let starts = facts.asked.flies() && state.phase == FlightPhase::Armed;
    if acts {
        state.commander = CommandSource::Pilot;
    } else if retakes || starts {
        state.commander = CommandSource::Guided;
    }
}

fn choose_mode(config: &ModeConfig, state: &mut State, facts: &Facts) {
    let pilot = &facts.pilot;
    if pilot.mode_turned {
        (state.pending, state.throttle_above) = (pilot.mode, None);
    }
    let piloted = facts.sticks == CommandSource::Pilot;
    let wanted = match state.phase {
        FlightPhase::IdleGround => {
            // A program or a click holds the place: they have no sticks.
            state.pending = None;
            let program = facts.asked.flies() || facts.click_arms();
            Some(pilot.mode.filter(|_| !program).unwrap_or(FlightMode::PosHold))
        }
        FlightPhase::Armed | FlightPhase::Flying => {
            let on_ground = state.phase == FlightPhase::Armed;
            let turned = state.pending.filter(|_| state.commander == CommandSource::Pilot);
            let turned = turned.and_then(|mode| {
                if on_ground || !mode.is_manual() || state.wanted.is_manual() {
                    (state.pending, state.throttle_above) = (None, None);
                    Some(mode)
                } else if piloted {
                    Some(begin_manual(config, state, facts, mode))
                } else {
                    // Until the pilot's throttle has arrived, a mode that makes thrust of it would make none.
                    None
                }
            });
            let guided = on_ground && facts.asked.flies() && state.commander == CommandSource::Guided;
            if guided { Some(FlightMode::PosHold) } else { turned }
        }
        FlightPhase::Init | FlightPhase::IdleHeld | FlightPhase::TakeOff | FlightPhase::Landing | FlightPhase::Flip => {
            None
        }
    };
    if let Some(wanted) = wanted.filter(|wanted| *wanted != state.wanted) {
        state.wanted = wanted;
        state.throttle_rested = false;
    }
    if is_airborne(state.phase) && state.phase != FlightPhase::Landing && state.wanted.is_manual() && !piloted {
        // The throttle of a pilot who is not heard is no thrust. The pilot has to choose the manual mode again.
        (state.wanted, state.pending) = (FlightMode::PosHold, None);
    }
    state.mode = match state.wanted {
        FlightMode::PosHold if !facts.valid.contains(Validity::POSITION_XY) => FlightMode::AltHold,
        wanted => wanted,
    };
    let blind = !facts.valid.contains(Validity::VELOCITY_Z);
    let blind = blind && !state.mode.is_manual() && is_airborne(state.phase);
    state.blind = blind.then(|| state.blind.unwrap_or(facts.now));
    // A program does not see where the vehicle drifts; a pilot does, and has sticks.
    let adrift = state.wanted.holds_place() && !state.mode.holds_place();
    let adrift = adrift && state.commander != CommandSource::Pilot && is_airborne(state.phase);
    state.adrift = adrift.then(|| state.adrift.unwrap_or(facts.now));
    // No throttle is one at rest.
    state.throttle_rested |= pilot.frame.is_none() || facts.throttle_rests(config);
}

/// The mode in force when the pilot chooses a manual one in a mode that holds the height. There the throttle stick rests in its
/// centre, or at any other place, and as thrust that would let the vehicle fall. So the height is held until the stick has
/// passed the hover once, in whichever direction; tilt follows the sticks at once.
fn begin_manual(config: &ModeConfig, state: &mut State, facts: &Facts, mode: FlightMode) -> FlightMode {
    let throttle = facts.pilot.frame.as_ref().map_or(0.0, |(_, input)| input.throttle);
    let above = throttle >= config.hover_throttle;
    if *state.throttle_above.get_or_insert(above) == above {
        return FlightMode::AltHold;
    }
    (state.pending, state.throttle_above) = (None, None);
    mode
}

/// Pairing ends with the new transmitter's first frame, by the button, or after a time. The link refuses the old
/// transmitter's frames while the vehicle looks for another one, so after a moment every frame is a new one's.
fn watch_pairing(config: &ModeConfig, state: &mut State, facts: &Facts) {
    if facts.button == Some(ButtonGesture::HoldPair) {
        state.pairing = if state.pairing.is_some() { None } else { Some(facts.now) };
    }
    state.pairing = state.pairing.filter(|since| {
        let paired = facts.pilot.frame.as_ref().is_some_and(|(at, _)| *at > *since + config.pairing_settle);
        !paired && facts.now.since(*since) < config.pairing_timeout
    });
}

fn watch_height(state: &mut State, facts: &Facts) {
    let unmeasured = state.phase == FlightPhase::IdleHeld && facts.known_height().is_none();
    state.unmeasured = unmeasured.then(|| state.unmeasured.unwrap_or(facts.now));
}

/// Has this event happened? The words are in [`Event::guard`]. `was_manual`: the mode in force in the step before was.
// Inlined, the conditions of every event would be computed before the loop over the rows: some 300 instructions.
#[inline(never)]
fn happens(event: Event, config: &ModeConfig, was_manual: bool, state: &State, facts: &Facts) -> bool {
    let (asked, pilot, phase) = (&facts.asked, &facts.pilot, state.phase);
    let waited = |time: Duration| facts.now.since(state.entered) >= time;
    let lasts = |since: Option<Instant>, time: Duration| since.is_some_and(|since| facts.now.since(since) >= time);
    let kill = || {
        asked.kill
            || facts.stop_button
            || facts.cut_off
            || pilot.frame.as_ref().is_some_and(|(_, input)| input.kill)
            || facts.alerts.intersects(CUT)
    };
    match event {
        Event::Emergency => kill(),
        Event::Stop => match phase {
            FlightPhase::Armed => {
                asked.disarm || pilot.switch.falls || pilot.switch.found_off || waited(config.armed_timeout)
            }
            // A transmitter that restarts turns both switches at once; that is no wish to fall.
            FlightPhase::TakeOff | FlightPhase::Flying => {
                let stays = facts.alerts.contains(Alerts::NO_LIFT) && state.is_low(config, facts);
                (phase == FlightPhase::TakeOff && stays) || (pilot.switch.falls && was_manual && state.mode.is_manual())
            }
            FlightPhase::Landing => {
                let low = state.is_low(config, facts) && (asked.disarm || pilot.switch.falls);
                // What carries it cannot be felt.
                let stands = facts.known_height().is_some_and(|height| height < config.standing_height);
                let numb = stands && facts.alerts.intersects(UNFELT);
                low || numb || (pilot.switch.falls && state.landing_by_switch) || waited(state.landing_limit)
            }
            FlightPhase::Init | FlightPhase::IdleGround | FlightPhase::IdleHeld | FlightPhase::Flip => false,
        },
        Event::Touchdown => facts.landed,
        Event::Land => {
            // From upside down the thrust of a landing would push downwards.
            let level = phase != FlightPhase::Flip || facts.upright > LEVEL || waited(config.flip_timeout);
            level && (state.lands_next || lands(config, state, facts))
        }
        Event::TakeOffComplete => {
            // In a manual mode when its legs are free.
            let rises = facts.known_height().is_none_or(|height| height > config.standing_height);
            facts.takeoff_complete
                || (state.mode.is_manual() && facts.contact == GroundContact::Air && rises)
                || (state.mode.commands_rates() && waited(ACRO_TAKE_OFF))
        }
        Event::TakeOff => {
            let piloted = state.commander == CommandSource::Pilot && facts.sticks == CommandSource::Pilot;
            let throttle = pilot.frame.as_ref().map_or(0.0, |(_, input)| input.throttle);
            let raised = piloted && state.throttle_rested && throttle > config.throttle_take_off;
            let by_itself = !state.mode.is_manual() && state.takes_off && waited(config.spool);
            asked.take_off || by_itself || raised
        }
        Event::Flip => asked.flip && flip_blocks(config, state, facts).is_empty(),
        Event::FlipOver => {
            let level = facts.upright > LEVEL && facts.at_rest;
            let given_up = !state.inverted && waited(config.flip_start);
            (level && (state.inverted || given_up)) || waited(config.flip_timeout)
        }
        Event::Arm => {
            let wanted = asked.arm || pilot.switch.rises || facts.click_arms();
            let refused = kill() || asked.disarm || asked.land || pilot.switch.falls || facts.pressed();
            wanted && !refused && arming::blocks(config, state, facts).is_empty()
        }
        Event::SetDown => {
            facts.known_height().is_some_and(|height| height < config.standing_height)
                || lasts(state.unmeasured, config.height_unknown)
        }
        Event::Lifted => facts.known_height().is_some_and(|height| height > config.held_height),
        Event::Ready => facts.calibrated && facts.valid.contains(Validity::TILT),
    }
}

/// Is landing asked for, or demanded?
fn lands(config: &ModeConfig, state: &State, facts: &Facts) -> bool {
    let (asked, pilot, phase) = (&facts.asked, &facts.pilot, state.phase);
    let waited = |time: Duration| facts.now.since(state.entered) >= time;
    let lasts = |since: Option<Instant>, time: Duration| since.is_some_and(|since| facts.now.since(since) >= time);
    let silent = facts.alerts.contains(Alerts::COMM_LOST);
    let unheard = silent && (lasts(state.silence.map(|s| s.since), config.hover_without_link));
    let unled = silent || facts.sticks == CommandSource::Failsafe;
    let blind = lasts(state.blind, config.blind) || (state.blind.is_some() && unled);
    let height_lost = facts.alerts.contains(Alerts::RANGE_IMPLAUSIBLE);
    // The height of a take-off whose range lied from its beginning is known by nothing else.
    let broken_off = phase == FlightPhase::TakeOff && (height_lost || waited(config.take_off_timeout));
    asked.land
        || asked.disarm
        || pilot.switch.falls
        || pilot.switch.found_off
        || unheard
        || blind
        || lasts(state.adrift, config.adrift)
        || broken_off
        || facts.alerts.intersects(LAND)
}

/// Why it would not turn over now.
pub(crate) fn flip_blocks(config: &ModeConfig, state: &State, facts: &Facts) -> FlipBlocks {
    if state.phase != FlightPhase::Flying {
        return FlipBlocks::NOT_FLYING;
    }
    let led = state.commander == CommandSource::Guided && !state.mode.is_manual();
    let known = Validity::TILT.with(Validity::VELOCITY_Z).with(Validity::HEIGHT).with(Validity::POSITION_Z);
    let known = facts.valid.contains(known) && facts.known_height().is_some();
    let high = facts.known_height().is_some_and(|height| height >= config.flip_height);
    // A number that is none is no room.
    let room = facts.climbed + config.flip_room <= config.ceiling;
    FlipBlocks::NONE
        .set(FlipBlocks::NOT_LED, !led)
        .set(FlipBlocks::ESTIMATE, !known)
        .set(FlipBlocks::LOW, !high)
        .set(FlipBlocks::NO_ROOM, !room)
        .set(FlipBlocks::UNSTEADY, !(facts.upright > LEVEL && facts.at_rest))
        .set(FlipBlocks::ALERT, facts.alerts.intersects(NO_FLIP))
}

/// All that leaving one phase and entering another means, in one place.
fn leave_and_enter(config: &ModeConfig, state: &mut State, facts: &Facts, event: Event, phase: FlightPhase) {
    let (left, low) = (state.phase, state.is_low(config, facts));
    // On exit.
    if left == FlightPhase::IdleHeld {
        state.full_resets = state.full_resets.wrapping_add(1);
    }
    if is_armed(left) && !is_armed(phase) {
        let crashed = facts.alerts.intersects(CUT);
        // A press of the button means that the vehicle is in a hand: no acknowledgement is missing.
        let fell = is_airborne(left) && !low && event != Event::Touchdown && !facts.stop_button;
        let block = if facts.cut_off { ArmBlocks::CUT_OFF } else { ArmBlocks::CRASHED };
        if crashed || fell || facts.cut_off {
            state.unacknowledged |= block;
        }
        state.commander = CommandSource::None;
        (state.silence, state.blind, state.adrift, state.landing_by_switch) = (None, None, None, false);
    }
    // On enter.
    match phase {
        FlightPhase::IdleGround => state.control_resets = state.control_resets.wrapping_add(1),
        FlightPhase::Armed => {
            state.control_resets = state.control_resets.wrapping_add(1);
            // Positions count from the take-off spot.
            state.origin_resets = state.origin_resets.wrapping_add(1);
            // Raised already, it does not take off.
            state.throttle_rested = false;
            state.takes_off = !facts.asked.arm && !state.mode.is_manual();
            state.commander = match (facts.asked.arm, facts.pilot.frame) {
                (true, _) => CommandSource::Guided,
                (false, Some(_)) => CommandSource::Pilot,
                // By a click, and only programs are heard.
                (false, None) => CommandSource::None,
            };
        }
        FlightPhase::Landing => {
            state.landing_by_switch = facts.pilot.switch.falls;
            state.landing_limit = facts.known_height().map_or(config.landing_blind, |height| {
                config.landing_spare + Duration::from_seconds(height.max(0.0) / config.landing_slowest)
            });
        }
        FlightPhase::Flip => {
            state.inverted = false;
        }
        FlightPhase::Init | FlightPhase::IdleHeld | FlightPhase::TakeOff | FlightPhase::Flying => {}
    }
    (state.phase, state.entered) = (phase, facts.now);
    state.transitions = state.transitions.wrapping_add(1);
}

#[cfg(test)]
mod tests;
