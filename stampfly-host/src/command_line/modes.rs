//! `stampfly modes`: the mode machine's tables, printed from the code that uses them.
//!
//! Transitions, guards and checks are tables of `stampfly-mode`; what a mode switch and a program may do is found by asking its
//! `decide`.

use crate::command_line::failure::Failure;
use stampfly_board::VehicleConfig;
use stampfly_mode::arming::CHECKS;
use stampfly_mode::decision::{State, decide};
use stampfly_mode::transitions::{Event, TABLE, is_airborne};
use stampfly_mode::{Asked, Facts, Heard, ModeConfig};
use stampfly_types::messages::{CommandSource, FlightMode, FlightPhase, GroundContact, PilotInput, Validity};
use stampfly_types::{Duration, Instant};
use std::process::ExitCode;

pub fn run() -> Result<ExitCode, Failure> {
    diagram();
    transitions();
    guards();
    arbitration();
    manual_modes();
    checks();
    Ok(ExitCode::SUCCESS)
}

fn diagram() {
    outln!("## Phases\n\n```mermaid\nstateDiagram-v2\n    [*] --> Init");
    for row in TABLE {
        outln!("    {:?} --> {:?}: {:?}", row.from, row.to, row.event);
    }
    outln!(
        "```\n\nThe motors may turn in Armed, TakeOff, Flying, Flip and Landing. INIT has no time-out: a vehicle whose sensors do"
    );
    outln!("not become ready must not go anywhere. IDLE_GROUND and FLYING last as long as they are wanted.");
}

fn transitions() {
    outln!("\n## Transitions\n\nA phase ignores an event without a cell.\n");
    let phases = || FlightPhase::ALL.iter();
    outln!("| event |{}", phases().map(|phase| format!(" {phase:?} |")).collect::<String>());
    outln!("|---|{}", phases().map(|_| "---|").collect::<String>());
    for event in Event::ALL {
        let cell = |from: &FlightPhase| {
            let row = TABLE.iter().find(|row| row.from == *from && row.event == event);
            row.map_or(" |".into(), |row| format!(" {:?} |", row.to))
        };
        outln!("| {event:?} |{}", phases().map(cell).collect::<String>());
    }
}

fn guards() {
    outln!("\n## Events, most urgent first\n\n| event | happens when |\n|---|---|");
    for event in Event::ALL {
        outln!("| {event:?} | {} |", event.guard());
    }
}

/// What becomes of the mode in a phase, in which the vehicle was told POS_HOLD.
fn becomes(phase: FlightPhase, turned: bool, program: bool) -> &'static str {
    let now = Instant::from_secs(10);
    let airborne = is_airborne(phase);
    let other = FlightMode::AltHold;
    let wanted = if program { other } else { FlightMode::PosHold };
    let state = State {
        phase,
        wanted,
        mode: wanted,
        commander: CommandSource::Guided,
        entered: now,
        landing_limit: Duration::from_secs(60),
        ..State::default()
    };
    let frame = PilotInput { mode: other, ..PilotInput::default() };
    let pilot = Heard { frame: Some((now, frame)), mode: Some(other), mode_turned: turned, ..Heard::default() };
    let facts = Facts {
        now,
        valid: Validity::ALL,
        height: if airborne || phase == FlightPhase::IdleHeld { 1.0 } else { 0.03 },
        contact: if airborne { GroundContact::Air } else { GroundContact::Ground },
        pilot: if program { Heard::default() } else { pilot },
        asked: Asked { route: program, any: program, ..Asked::default() },
        ..Facts::default()
    };
    let next = decide(&ModeConfig::default(), &state, &facts);
    match (next.wanted == wanted, next.pending.is_some()) {
        (false, _) => "applied",
        (true, true) => "kept for later",
        (true, false) => "ignored",
    }
}

fn arbitration() {
    outln!("\n## Mode switch and programs\n\nFor a vehicle under the authority of a program.\n");
    outln!("| phase | mode switch turned | mode switch differs | program wants POS_HOLD |\n|---|---|---|---|");
    for &phase in FlightPhase::ALL {
        let [turned, differs, program] =
            [(true, false), (false, false), (false, true)].map(|(turned, program)| becomes(phase, turned, program));
        outln!("| {phase:?} | {turned} | {differs} | {program} |");
    }
}

/// Why a manual mode waits for the throttle, with a picture of the stick.
fn manual_modes() {
    let percent = 100.0 * VehicleConfig::default().mode.hover_throttle;
    outln!(
        "\n## STABILIZE and ACRO in the air\n
In ALT_HOLD and POS_HOLD the throttle stick asks for a climb rate, and its centre for none. In STABILIZE and
ACRO the stick is thrust: none at the centre and below, all of it at the top. The vehicle hovers with the stick at
{percent:.0} % of the way from the centre to the top. A stick with a spring rests in the centre, so a vehicle whose stick
became thrust at once would fall.
"
    );
    outln!(
        "```text
 throttle in ALT_HOLD, POS_HOLD      throttle in STABILIZE, ACRO

 ┌───────┐ climbs                    ┌───────┐ full thrust
 │   ┆   │                           │   ┆   │
 │   ┆   │                           │···┆···│ {percent:.0} %: hovers; STABILIZE begins here
 │   ●   │ holds its height          │   ●   │ no thrust
 │   ┆   │                           │   ┆   │
 └───────┘ sinks                     └───────┘ no thrust
```

Turned to STABILIZE or ACRO, the vehicle is in ALT_HOLD until the throttle stick has passed the hover once, upwards or
downwards. Tilt follows the sticks at once. A switch that was turned during take-off counts when the vehicle flies, by the
same rule. From STABILIZE to ACRO and back there is nothing to wait for. A take-off in ACRO levels itself until the legs
are free, for three seconds at most."
    );
}

fn checks() {
    outln!("\n## Checks before arming\n\n| block | refuses when | value in |\n|---|---|---|");
    for check in CHECKS {
        let name = check.block.names().next().unwrap_or("none");
        outln!("| `{name}` | {} | {} |", check.refuses, if check.unit.is_empty() { "–" } else { check.unit });
    }
}
