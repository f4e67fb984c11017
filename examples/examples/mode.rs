//! A flight through the state table, told by its transitions.

use stampfly_mode::{ModeInput, ModeMachine};
use stampfly_types::Instant;
use stampfly_types::messages::*;

/// What the vehicle sees, as the story goes on.
#[derive(Default)]
struct World {
    alerts: Alerts,
    estimate: StateEstimate,
    calibration: CalibrationResult,
    land_detected: LandDetected,
    commands: Vec<GuidedKind>,
}

/// One line of the story: when, what a person would say, and what changes.
type Event = (u64, &'static str, fn(&mut World));

const STORY: &[Event] = &[
    (100, "somebody is in a hurry: arm", |w| w.commands.push(GuidedKind::Arm)),
    (1_000, "the still-calibration is complete", |w| {
        w.calibration.complete = true;
        w.estimate.valid = Validity::ALL;
    }),
    (2_000, "arm", |w| w.commands.push(GuidedKind::Arm)),
    (2_500, "take off", |w| w.commands.push(GuidedKind::TakeOff)),
    (5_000, "the height is reached", |w| {
        w.estimate.height = 0.6;
        w.land_detected = LandDetected { contact: GroundContact::Air, takeoff_complete: true, ..w.land_detected };
    }),
    (9_000, "the battery is critical", |w| w.alerts = Alerts::CRITICAL_BATTERY),
    (12_000, "touchdown", |w| {
        w.estimate.height = 0.02;
        w.land_detected = LandDetected { contact: GroundContact::Ground, landed: true, ..Default::default() };
    }),
    (13_000, "arm", |w| w.commands.push(GuidedKind::Arm)),
];

fn main() {
    let mut machine = ModeMachine::default();
    let mut world = World::default();
    let mut before = FlightStatus::default();
    let mut story = STORY.iter().peekable();

    for step in 0..14 * 400u64 {
        let now = Instant::from_micros(step * 2_500);
        while let Some((_, text, change)) = story.next_if(|(millis, ..)| Instant::from_millis(*millis) <= now) {
            println!("{:5.1} s  {text}", now.seconds_f64());
            change(&mut world);
        }
        let World { alerts, estimate, calibration, land_detected, commands } = &world;
        let input = ModeInput {
            alerts: *alerts,
            estimate,
            calibration,
            land_detected,
            pilot: None,
            sticks: CommandSource::Guided,
            commands,
            button: None,
            cut_off: false,
        };
        let mode = machine.step(now, &input).flight_status;
        if mode.phase != before.phase {
            println!(
                "{:>9} {:?} → {:?}, motors {}",
                "",
                before.phase,
                mode.phase,
                if mode.armed { "may turn" } else { "off" }
            );
        } else if world.commands.contains(&GuidedKind::Arm) {
            println!("{:>9} refused: {}", "", mode.blocks.names().collect::<Vec<_>>().join(", "));
        }
        before = mode;
        world.commands.clear();
    }
}
