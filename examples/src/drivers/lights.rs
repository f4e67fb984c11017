//! Chains of lights with a chip in each (WS2812): what they show in every state of a flight.
//!
//! The status light tells the state, the two body lights the flight mode; the table is `stampfly-mode`'s. Each state is
//! shown for a second and written down as eight letters, one for every eighth of it.

use super::Failure;
use core::convert::Infallible;
use core::fmt::Write;
use smart_leds_trait::{RGB8, SmartLedsWrite};
use stampfly_drivers::{Indicator, Lights, Timebase};
use stampfly_mode::Signaller;
use stampfly_types::messages::{Alerts, FlightPhase, FlightStatus, Signal};

/// How long a colour lasts at least: half a period of the fastest blinking.
const EIGHTH_MS: u32 = 125;

/// What was shown.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shown {
    /// States and warnings.
    pub rows: u32,
    /// Changes of the status light's colour.
    pub status_changes: u32,
    /// Changes of the body lights' colour.
    pub body_changes: u32,
}

/// Shows every state and every warning for a second, and then nothing.
///
/// # Errors
/// None from the lights: a chain that refuses is written again at the next colour.
pub async fn run<S: SmartLedsWrite, B: SmartLedsWrite, T: Timebase>(
    status: S,
    body: B,
    mut clock: T,
    out: &mut impl Write,
) -> Result<Shown, Failure<Infallible>>
where
    RGB8: Into<S::Color> + Into<B::Color>,
{
    let (mut status, mut body) = (Lights::<_, 1>::status(status), Lights::<_, 2>::body(body));
    let mut signaller = Signaller::default();
    let mut shown = Shown::default();
    let mut before = Signal::default();
    let phases = FlightPhase::ALL.iter().map(|&phase| (phase.name(), phase, Alerts::NONE));
    let warnings = [("low battery", Alerts::LOW_BATTERY), ("sensor lost", Alerts::IMU_LOST)];
    let warnings = warnings.map(|(name, alerts)| (name, FlightPhase::Flying, alerts));
    writeln!(out, "Red Green Blue, White Cyan Magenta Orange Lime; a dot is dark.")?;
    writeln!(out, "{:<12} {:<8}   body", "phase", "status")?;
    for (name, phase, alerts) in phases.chain(warnings) {
        let mode = FlightStatus { phase, ..Default::default() };
        let mut seen = [['.'; 8]; 2];
        let [seen_status, seen_body] = &mut seen;
        for (status_letter, body_letter) in seen_status.iter_mut().zip(seen_body) {
            let signal = signaller.step(clock.now(), &mode, alerts);
            status.show(&signal);
            body.show(&signal);
            (*status_letter, *body_letter) = (letter(signal.status), letter(signal.body));
            shown.status_changes += u32::from(signal.status != before.status);
            shown.body_changes += u32::from(signal.body != before.body);
            before = signal;
            clock.delay_ms(EIGHTH_MS).await;
        }
        write!(out, "{name:<12} ")?;
        for letters in seen {
            letters.into_iter().try_for_each(|letter| out.write_char(letter))?;
            out.write_str("   ")?;
        }
        writeln!(out)?;
        shown.rows += 1;
    }
    let dark = Signal::default();
    status.show(&dark);
    body.show(&dark);
    shown.status_changes += u32::from(before.status != dark.status);
    shown.body_changes += u32::from(before.body != dark.body);
    writeln!(out, "{} changes of the status light, {} of the body's", shown.status_changes, shown.body_changes)?;
    Ok(shown)
}

/// A colour's first letter.
const fn letter([red, green, blue]: [u8; 3]) -> char {
    match (red > 0, green > 0, blue > 0) {
        (false, false, false) => '.',
        (true, false, false) => 'R',
        (false, true, false) => 'G',
        (false, false, true) => 'B',
        (false, true, true) => 'C',
        (true, false, true) => 'M',
        (true, true, true) => 'W',
        (true, true, false) => {
            if red > green {
                'O'
            } else {
                'L'
            }
        }
    }
}
