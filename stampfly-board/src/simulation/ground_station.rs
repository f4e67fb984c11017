//! The ground station: flies a mission by sending commands and reading telemetry, as one over a radio would.
//!
//! It knows nothing but what the vehicle tells it, and sends a sign of life ten times a second so that the vehicle
//! knows the link is there.

use super::mission::{Mission, Step};
use crate::messages::TelemetryFrame;
use crate::topics;
use stampfly_sim::time::Clock;
use stampfly_types::messages::{FlightPhase, GuidedCommand, GuidedKind};
use stampfly_types::{Duration, Vec3};
use std::cell::Cell;

/// How often it looks and speaks.
const PERIOD: Duration = Duration::from_millis(20);
/// Signs of life come at every n-th look.
const LIFE_DIVIDER: u32 = 5;

/// Looks after which telemetry surely knows of a command.
const ROUND_TRIP: u32 = 4;

/// What the ground station reports about itself.
#[derive(Debug, Default)]
pub struct Progress {
    /// Steps done.
    pub done: Cell<usize>,
    /// The mission is over.
    pub finished: Cell<bool>,
}

struct Link<'b> {
    clock: Clock,
    commands: topics::CommandGuidedTx<'b>,
    telemetry: topics::TelemetryRx<'b>,
    frame: TelemetryFrame,
    looks: u32,
}

impl Link<'_> {
    /// Waits for the next look; sends a sign of life now and then.
    async fn look(&mut self) -> TelemetryFrame {
        self.clock.sleep_until(self.clock.now() + PERIOD).await;
        self.looks += 1;
        if self.looks.is_multiple_of(LIFE_DIVIDER) {
            // A vehicle that takes no more commands misses a sign of life, which is what it should notice.
            let _ = self.commands.publish(self.clock.now(), GuidedCommand::default());
        }
        if let Some(frame) = self.telemetry.latest() {
            self.frame = frame.data;
        }
        self.frame
    }

    /// Sends a command, again and again while the vehicle's queue is full.
    async fn send(&mut self, command: GuidedCommand) {
        while self.commands.publish(self.clock.now(), command).is_err() {
            self.look().await;
        }
    }

    async fn wait_for(&mut self, condition: impl Fn(&TelemetryFrame) -> bool) {
        while !condition(&self.look().await) {}
    }
}

/// Flies the mission. Never gives up: whoever runs it bounds the time.
pub async fn fly(
    clock: Clock,
    mission: &Mission,
    commands: topics::CommandGuidedTx<'_>,
    telemetry: topics::TelemetryRx<'_>,
    progress: &Progress,
) {
    let mut link = Link { clock, commands, telemetry, frame: TelemetryFrame::default(), looks: 0 };
    let mut yaw = 0.0f32;
    for step in &mission.steps {
        match *step {
            Step::Arm => {
                link.wait_for(|frame| frame.phase == FlightPhase::IdleGround && frame.blocks.is_empty()).await;
                link.send(GuidedCommand { kind: GuidedKind::Arm, ..Default::default() }).await;
                link.wait_for(|frame| frame.armed).await;
            }
            Step::TakeOff { height } => {
                let position = Vec3::new(0.0, 0.0, -height);
                link.send(GuidedCommand { kind: GuidedKind::TakeOff, position, ..Default::default() }).await;
                link.wait_for(|frame| frame.phase == FlightPhase::Flying).await;
            }
            Step::GoTo { place: [north, east, up], yaw: heading, speed, dwell } => {
                yaw = heading.unwrap_or(yaw);
                link.send(GuidedCommand {
                    kind: GuidedKind::WayPoint,
                    position: Vec3::new(north, east, -up),
                    yaw: yaw.to_radians(),
                    speed,
                    dwell,
                })
                .await;
                // The command and the next telemetry frame both need their time.
                for _ in 0..ROUND_TRIP {
                    link.look().await;
                }
                link.wait_for(|frame| frame.remaining == 0 || frame.phase != FlightPhase::Flying).await;
            }
            Step::Hover { seconds } => {
                let until = link.clock.now() + Duration::from_seconds(seconds);
                while link.clock.now() < until {
                    link.look().await;
                }
            }
            Step::Land => {
                link.send(GuidedCommand { kind: GuidedKind::Land, ..Default::default() }).await;
                link.wait_for(|frame| !frame.armed).await;
            }
        }
        progress.done.set(progress.done.get() + 1);
    }
    progress.finished.set(true);
    loop {
        link.look().await;
    }
}
