//! The ground station: flies a mission by sending commands and reading telemetry, as one over a radio would.
//!
//! It knows nothing but what the vehicle tells it, and sends a sign of life ten times a second so that the vehicle
//! knows the link is there.

use super::mission::{LONGEST_LEG, Mission, Step};
use super::radio::Radio;
use super::settings::Settings;
use crate::airframe::AIRFRAME;
use crate::messages::TelemetryFrame;
use stampfly_control::autotune::{AutotuneAxis, AutotuneConfig};
use stampfly_types::messages::{FlightPhase, FlipDirection, GuidedCommand, GuidedKind};
use stampfly_types::{Duration, Vec3};
use std::cell::Cell;

/// How often it looks and speaks.
const PERIOD: Duration = Duration::from_millis(20);
/// Signs of life come at every n-th look.
const LIFE_DIVIDER: u32 = 5;

/// Looks after which telemetry surely knows of a command.
const ROUND_TRIP: u32 = 4;

/// What an autotune takes to compute its result, at most.
const COMPUTING: Duration = Duration::from_secs(4);

/// What the ground station reports about itself.
#[derive(Debug, Default)]
pub struct Progress {
    /// Steps done.
    pub done: Cell<usize>,
    /// The mission is over.
    pub finished: Cell<bool>,
}

struct Station<'b> {
    radio: Radio<'b>,
    looks: u32,
}

impl Station<'_> {
    /// Waits for the next look; sends a sign of life now and then.
    async fn look(&mut self) -> TelemetryFrame {
        let clock = self.radio.clock().clone();
        clock.sleep_until(clock.now() + PERIOD).await;
        self.looks += 1;
        if self.looks.is_multiple_of(LIFE_DIVIDER) {
            // A vehicle that takes no more commands misses a sign of life, which is what it should notice.
            self.radio.command(GuidedCommand::default());
        }
        self.radio.telemetry()
    }

    /// Sends a command, again and again while the vehicle's queue is full.
    async fn send(&mut self, command: GuidedCommand) {
        while !self.radio.command(command) {
            self.look().await;
        }
    }

    async fn wait(&mut self, time: Duration) {
        let until = self.radio.clock().now() + time;
        while self.radio.clock().now() < until {
            self.look().await;
        }
    }

    async fn wait_for(&mut self, condition: impl Fn(&TelemetryFrame) -> bool) {
        while !condition(&self.look().await) {}
    }

    /// The same, but gives up after [`LONGEST_LEG`].
    async fn wait_awhile_for(&mut self, condition: impl Fn(&TelemetryFrame) -> bool) {
        let until = self.radio.clock().now() + LONGEST_LEG;
        while !condition(&self.look().await) && self.radio.clock().now() < until {}
    }
}

/// Flies the mission. A place that cannot be reached is given up. With `waits`, two seconds pass between the vehicle's
/// permission to arm and arming. Without `settings` no parameter is changed.
pub async fn fly(
    radio: Radio<'_>,
    mission: &Mission,
    waits: bool,
    progress: &Progress,
    mut settings: Option<Settings<'_>>,
) {
    let mut link = Station { radio, looks: 0 };
    let ready = |frame: &TelemetryFrame| frame.phase == FlightPhase::IdleGround && frame.blocks.is_empty();
    let mut yaw = 0.0f32;
    for step in &mission.steps {
        match *step {
            Step::Arm => {
                link.wait_for(ready).await;
                if waits {
                    link.wait(Duration::from_secs(2)).await;
                    link.wait_for(ready).await;
                }
                link.send(GuidedCommand { kind: GuidedKind::Arm, ..Default::default() }).await;
                link.wait_for(|frame| frame.armed).await;
            }
            Step::TakeOff { height } => {
                let position = Vec3::new(0.0, 0.0, -height);
                link.send(GuidedCommand { kind: GuidedKind::TakeOff, position, ..Default::default() }).await;
                link.wait_awhile_for(|frame| frame.phase == FlightPhase::Flying || !frame.armed).await;
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
                link.wait_awhile_for(|frame| frame.remaining == 0 || frame.phase != FlightPhase::Flying).await;
            }
            Step::Hover { seconds } => link.wait(Duration::from_seconds(seconds)).await,
            Step::Flip { direction } => {
                link.send(GuidedCommand { kind: turning_over(direction), ..Default::default() }).await;
                for _ in 0..ROUND_TRIP {
                    link.look().await;
                }
                link.wait_awhile_for(|frame| frame.phase != FlightPhase::Flip).await;
            }
            Step::Autotune { axis } => {
                let kind = match axis {
                    AutotuneAxis::Roll => GuidedKind::AutotuneRoll,
                    AutotuneAxis::Pitch => GuidedKind::AutotunePitch,
                    AutotuneAxis::Yaw => GuidedKind::AutotuneYaw,
                };
                link.send(GuidedCommand { kind, ..Default::default() }).await;
                // Telemetry says nothing of it.
                let longest = AutotuneConfig::for_airframe(&AIRFRAME, axis).time_limit + COMPUTING;
                link.wait(longest).await;
                link.send(GuidedCommand { kind: GuidedKind::Hold, ..Default::default() }).await;
            }
            Step::Set { index, value } => {
                // A refusal is seen: the parameter's moment never comes.
                let now = link.radio.clock().now();
                let _ = settings.as_mut().map(|settings| settings.set(now, index, value));
            }
            // A program has no switch and no stick.
            Step::Mode { .. } | Step::Chop { .. } => {}
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

/// The command that asks to turn over this way.
pub(super) fn turning_over(direction: FlipDirection) -> GuidedKind {
    match direction {
        FlipDirection::Left => GuidedKind::FlipLeft,
        FlipDirection::Right => GuidedKind::FlipRight,
        FlipDirection::Forward => GuidedKind::FlipForward,
        FlipDirection::Back => GuidedKind::FlipBack,
    }
}
