<<<<<<< HEAD
//! What people see and hear: one table for lights, one for tunes.
//!
//! The status light tells the state, the two body lights the flight mode, as on the StampFly. Rows of a table are
//! looked at from the top; the first one that applies wins.

use stampfly_types::Micros;
use stampfly_types::messages::{Alerts, FlightMode, FlightState, Signal, SystemMode, Tone};

/// How a light shows its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Blink {
    Solid,
    /// One second.
    Slow,
    /// A quarter of a second.
    Fast,
}

type Colour = [u8; 3];

const OFF: Colour = [0, 0, 0];
const WHITE: Colour = [32, 32, 32];
const RED: Colour = [32, 0, 0];
const GREEN: Colour = [0, 32, 0];
const BLUE: Colour = [0, 0, 32];
const CYAN: Colour = [0, 32, 32];
const MAGENTA: Colour = [32, 0, 32];
const ORANGE: Colour = [32, 16, 0];
const LIME: Colour = [16, 32, 0];

/// The signaller.
///
/// ```
/// use stampfly_mode::Signaller;
/// use stampfly_types::{Micros, messages::*};
/// let mut signaller = Signaller::default();
/// let idle = SystemMode { state: FlightState::IdleGround, ..Default::default() };
/// let shown = signaller.step(Micros(0), &idle, Alerts::NONE);
/// assert!(shown.status[1] > 0 && shown.status[0] == 0, "green: ready");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signaller {
    last_state: Option<FlightState>,
    last_warning: Option<Micros>,
    tone: Tone,
    tone_count: u32,
}

/// A low battery is called out again after this long.
const REPEAT: Micros = Micros::from_secs(10);

impl Signaller {
    /// What to show now; call at about 30 Hz.
    pub fn step(&mut self, now: Micros, mode: &SystemMode, alerts: Alerts) -> Signal {
        let low = alerts.intersects(Alerts::LOW_BATTERY | Alerts::CRITICAL_BATTERY);
        let fault = alerts.intersects(Alerts::IMU_LOST | Alerts::ESTIMATE_DIVERGED | Alerts::TILT_MISMATCH);
        if self.last_state != Some(mode.state) {
            let tone = match (self.last_state, mode.state) {
                (None, _) => Tone::Start,
                (Some(FlightState::Init), FlightState::IdleGround) => Tone::Ready,
                (_, FlightState::Armed) => Tone::Arm,
                (Some(FlightState::IdleHeld), FlightState::IdleGround) => Tone::None,
                (_, FlightState::IdleGround) => Tone::Disarm,
                _ => Tone::None,
            };
            self.last_state = Some(mode.state);
            self.start(tone);
        } else if low && self.last_warning.is_none_or(|at| now.since(at) >= REPEAT) {
            self.last_warning = Some(now);
            self.start(Tone::LowBattery);
        }

        let status = [
            (fault, RED, Blink::Fast),
            (low, CYAN, Blink::Slow),
            (mode.pairing, BLUE, Blink::Fast),
            (mode.state == FlightState::Init, MAGENTA, Blink::Slow),
            (mode.state == FlightState::IdleGround, GREEN, Blink::Solid),
            (mode.state == FlightState::IdleHeld, CYAN, Blink::Fast),
            (mode.state == FlightState::Armed, GREEN, Blink::Slow),
            (mode.state == FlightState::TakeOff, WHITE, Blink::Fast),
            (mode.state == FlightState::Flying, GREEN, Blink::Solid),
            (mode.state == FlightState::Landing, ORANGE, Blink::Slow),
        ];
        let in_the_air = matches!(mode.state, FlightState::TakeOff | FlightState::Flying | FlightState::Landing);
        let rhythm = if in_the_air { Blink::Slow } else { Blink::Solid };
        let body = [
            (low, CYAN, Blink::Fast),
            (mode.state == FlightState::Init, WHITE, Blink::Solid),
            (mode.mode == FlightMode::Acro, BLUE, rhythm),
            (mode.mode == FlightMode::Stabilize, LIME, rhythm),
            (mode.mode == FlightMode::AltHold, ORANGE, rhythm),
            (mode.mode == FlightMode::PosHold, MAGENTA, rhythm),
        ];
        Signal { status: first(&status, now), body: first(&body, now), tone: self.tone, tone_count: self.tone_count }
    }

    fn start(&mut self, tone: Tone) {
        if tone != Tone::None {
            self.tone = tone;
            self.tone_count = self.tone_count.wrapping_add(1);
        }
    }
}

fn first(rows: &[(bool, Colour, Blink)], now: Micros) -> Colour {
    let Some((_, colour, blink)) = rows.iter().find(|(applies, ..)| *applies) else { return OFF };
    let on = match blink {
        Blink::Solid => true,
        Blink::Slow => now.0 / 500_000 % 2 == 0,
        Blink::Fast => now.0 / 125_000 % 2 == 0,
    };
    if on { *colour } else { OFF }
=======
//! What people see and hear: one table of lights, one of tunes.
//!
//! The status light tells the state, the body lights the flight mode, both overridden by what matters more. Read the
//! tables from top to bottom: the first line that applies wins.

use stampfly_types::Micros;
use stampfly_types::messages::{Alerts, ArmBlocks, FlightMode, FlightState, Signal, SystemAlert, SystemMode, Tone};

/// Red, green, blue.
type Colour = [u8; 3];

const OFF: Colour = [0, 0, 0];
const WHITE: Colour = [255, 255, 255];
const RED: Colour = [255, 0, 0];
const GREEN: Colour = [0, 255, 0];
const BLUE: Colour = [0, 0, 255];
const CYAN: Colour = [0, 255, 255];
const MAGENTA: Colour = [255, 0, 255];
const ORANGE: Colour = [255, 128, 0];
const YELLOW_GREEN: Colour = [128, 255, 0];

/// How a light is lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rhythm {
    Solid,
    /// Half a second on, half a second off.
    Slow,
    /// An eighth of a second on, an eighth off.
    Fast,
}

type Applies = fn(&SystemMode, Alerts) -> bool;

/// The status light.
const STATUS: [(Applies, Colour, Rhythm); 12] = [
    (|m, a| a.intersects(FAULTS) || m.blocks.contains(ArmBlocks::CRASHED), RED, Rhythm::Fast),
    (|_, a| a.intersects(BATTERY), CYAN, Rhythm::Slow),
    (|m, _| m.pairing, BLUE, Rhythm::Fast),
    (|m, _| m.state == FlightState::Init && m.blocks.contains(ArmBlocks::CALIBRATING), MAGENTA, Rhythm::Slow),
    (|m, _| m.state == FlightState::Init, WHITE, Rhythm::Solid),
    (|m, _| m.state == FlightState::IdleGround && !m.blocks.is_empty(), ORANGE, Rhythm::Solid),
    (|m, _| m.state == FlightState::IdleGround, GREEN, Rhythm::Solid),
    (|m, _| m.state == FlightState::IdleHeld, CYAN, Rhythm::Fast),
    (|m, _| m.state == FlightState::Armed, GREEN, Rhythm::Slow),
    (|m, _| m.state == FlightState::TakeOff, WHITE, Rhythm::Fast),
    (|m, _| m.state == FlightState::Flying, GREEN, Rhythm::Solid),
    (|m, _| m.state == FlightState::Landing, ORANGE, Rhythm::Slow),
];

/// The two body lights: colour only, they blink slowly in the air.
const BODY: [(Applies, Colour); 6] = [
    (|_, a| a.intersects(BATTERY), CYAN),
    (|m, _| m.state == FlightState::Init, WHITE),
    (|m, _| m.mode == FlightMode::Acro, BLUE),
    (|m, _| m.mode == FlightMode::Stabilize, YELLOW_GREEN),
    (|m, _| m.mode == FlightMode::AltHold, ORANGE),
    (|m, _| m.mode == FlightMode::PosHold, MAGENTA),
];

/// Alerts that end a flight.
const FAULTS: Alerts = Alerts::IMPACT
    .with(Alerts::GYRO_ANOMALY)
    .with(Alerts::IMU_LOST)
    .with(Alerts::TUMBLED)
    .with(Alerts::ESTIMATE_DIVERGED);
const BATTERY: Alerts = Alerts::LOW_BATTERY.with(Alerts::CRITICAL_BATTERY);

/// The low-battery tune repeats this often.
const LOW_BATTERY_REPEAT: Micros = Micros::from_secs(10);

/// Makes the signal.
///
/// ```
/// use stampfly_mode::Indication;
/// use stampfly_types::{Micros, messages::*};
/// let mut indication = Indication::default();
/// let idle = SystemMode { state: FlightState::IdleGround, mode: FlightMode::PosHold, ..Default::default() };
/// let signal = indication.step(Micros::ZERO, &idle, &SystemAlert::default());
/// assert_eq!((signal.status, signal.body), ([0, 255, 0], [255, 0, 255]), "ready: green; position hold: magenta");
/// assert_eq!(signal.tone, Tone::Ready);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Indication {
    previous: Option<(SystemMode, Alerts)>,
    tone: Tone,
    tone_count: u32,
    low_battery_at: Option<Micros>,
}

impl Indication {
    /// One step; 10 Hz or more looks right.
    pub fn step(&mut self, now: Micros, mode: &SystemMode, alert: &SystemAlert) -> Signal {
        let alerts = alert.active;
        if let Some(tone) = self.event(now, mode, alerts) {
            self.tone = tone;
            self.tone_count = self.tone_count.wrapping_add(1);
        }
        self.previous = Some((*mode, alerts));

        let status = STATUS
            .iter()
            .find(|(applies, ..)| applies(mode, alerts))
            .map_or(OFF, |(_, colour, rhythm)| lit(*colour, *rhythm, now));
        let rhythm = if alerts.intersects(BATTERY) {
            Rhythm::Fast
        } else if airborne(mode.state) {
            Rhythm::Slow
        } else {
            Rhythm::Solid
        };
        let body =
            BODY.iter().find(|(applies, _)| applies(mode, alerts)).map_or(OFF, |(_, colour)| lit(*colour, rhythm, now));
        Signal { status, body, tone: self.tone, tone_count: self.tone_count }
    }

    /// The tune of this instant: what changed since the previous step, the most urgent first.
    fn event(&mut self, now: Micros, mode: &SystemMode, alerts: Alerts) -> Option<Tone> {
        let (before, alerts_before) = match self.previous {
            Some(previous) => previous,
            None => (SystemMode::default(), Alerts::NONE),
        };
        let low = alerts.intersects(BATTERY);
        let repeat = low && self.low_battery_at.is_none_or(|at| now.since(at) >= LOW_BATTERY_REPEAT);
        let tone = if alerts.intersects(FAULTS.without(alerts_before)) {
            Tone::Error
        } else if before.armed != mode.armed {
            if mode.armed { Tone::Arm } else { Tone::Disarm }
        } else if mode.pairing && !before.pairing {
            Tone::Pair
        } else if repeat {
            Tone::LowBattery
        } else if before.state == FlightState::Init && mode.state == FlightState::IdleGround {
            Tone::Ready
        } else if self.previous.is_none() {
            Tone::Start
        } else {
            return None;
        };
        if tone == Tone::LowBattery {
            self.low_battery_at = Some(now);
        }
        Some(tone)
    }
}

fn airborne(state: FlightState) -> bool {
    match state {
        FlightState::Init | FlightState::IdleGround | FlightState::IdleHeld | FlightState::Armed => false,
        FlightState::TakeOff | FlightState::Flying | FlightState::Landing => true,
    }
}

fn lit(colour: Colour, rhythm: Rhythm, now: Micros) -> Colour {
    let half_period = match rhythm {
        Rhythm::Solid => return colour,
        Rhythm::Slow => 500_000,
        Rhythm::Fast => 125_000,
    };
    if (now.0 / half_period).is_multiple_of(2) { colour } else { OFF }
>>>>>>> control
}

#[cfg(test)]
mod tests {
    use super::*;

<<<<<<< HEAD
    #[test]
    fn every_state_shows_something_and_warnings_win() {
        for &state in FlightState::ALL {
            let mode = SystemMode { state, ..Default::default() };
            let mut signaller = Signaller::default();
            assert_ne!(signaller.step(Micros(0), &mode, Alerts::NONE).status, OFF, "{state:?}");
            assert_eq!(signaller.step(Micros(0), &mode, Alerts::LOW_BATTERY).status, CYAN);
            assert_eq!(signaller.step(Micros(0), &mode, Alerts::LOW_BATTERY | Alerts::IMU_LOST).status, RED);
=======
    fn mode(state: FlightState) -> SystemMode {
        SystemMode { state, mode: FlightMode::AltHold, ..SystemMode::default() }
    }

    fn alert(active: Alerts) -> SystemAlert {
        SystemAlert { active, seen: active }
    }

    #[test]
    fn every_state_has_a_colour_and_every_mode_another() {
        for state in FlightState::ALL {
            let signal = Indication::default().step(Micros::ZERO, &mode(*state), &alert(Alerts::NONE));
            assert_ne!(signal.status, OFF, "{state:?}");
        }
        let body = |flight_mode| {
            let mode = SystemMode { mode: flight_mode, ..mode(FlightState::IdleGround) };
            Indication::default().step(Micros::ZERO, &mode, &alert(Alerts::NONE)).body
        };
        for (n, a) in FlightMode::ALL.iter().enumerate() {
            for b in FlightMode::ALL.iter().skip(n + 1) {
                assert_ne!(body(*a), body(*b));
            }
>>>>>>> control
        }
    }

    #[test]
<<<<<<< HEAD
    fn a_warning_repeats_every_ten_seconds() {
        let mut signaller = Signaller::default();
        let mode = SystemMode { state: FlightState::Flying, ..Default::default() };
        let mut count = 0;
        for second in 0..30 {
            count = signaller.step(Micros::from_secs(second), &mode, Alerts::LOW_BATTERY).tone_count;
        }
        assert_eq!(count, 4, "the start, and three warnings");
=======
    fn what_matters_more_comes_first() {
        let pairing = SystemMode { pairing: true, ..mode(FlightState::IdleGround) };
        let show = |mode: &SystemMode, alerts| Indication::default().step(Micros::ZERO, mode, &alert(alerts)).status;
        assert_eq!(show(&pairing, Alerts::NONE), BLUE);
        assert_eq!(show(&pairing, Alerts::LOW_BATTERY), CYAN);
        assert_eq!(show(&pairing, Alerts::LOW_BATTERY | Alerts::IMPACT), RED);
    }

    #[test]
    fn lights_blink_in_the_air() {
        let mut indication = Indication::default();
        let flying = mode(FlightState::Flying);
        let mut lit = 0;
        for n in 0..100 {
            let signal = indication.step(Micros::from_millis(10 * n), &flying, &alert(Alerts::NONE));
            lit += u32::from(signal.body != OFF);
            assert_ne!(signal.status, OFF, "the status light is steady");
        }
        assert_eq!(lit, 50);
    }

    #[test]
    fn tunes_are_edges_and_low_battery_repeats() {
        let mut indication = Indication::default();
        let mut count = 0;
        let mut heard = std::vec::Vec::new();
        for n in 0..250u64 {
            let armed = (50..100).contains(&n);
            let mode = SystemMode { armed, ..mode(if armed { FlightState::Armed } else { FlightState::IdleGround }) };
            let alerts = if n >= 120 { Alerts::LOW_BATTERY } else { Alerts::NONE };
            let signal = indication.step(Micros::from_millis(100 * n), &mode, &alert(alerts));
            if signal.tone_count != count {
                count = signal.tone_count;
                heard.push((n, signal.tone));
            }
        }
        assert_eq!(
            heard,
            [(0, Tone::Ready), (50, Tone::Arm), (100, Tone::Disarm), (120, Tone::LowBattery), (220, Tone::LowBattery)]
        );
>>>>>>> control
    }
}
