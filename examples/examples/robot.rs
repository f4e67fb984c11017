//! A robot of one's own, with nothing but bus, log and flight loop: own messages, own tables, two runnables, a flight
//! record that every ULog tool opens, and the same drive again, bit for bit.
//!
//! The robot follows a wall. Its planner offers steps on a queue that holds two; the wheels come round more slowly, so
//! steps are refused. What was refused is recorded, and the replay refuses the same.

use serde::{Deserialize, Serialize};
use stampfly_bus::{Activation, Duration, Full, Instant, Runnable, message};
use stampfly_flight::{Assembled, Recorder, ReplayOptions, key_frame, replay::Memory, replay::replay};

message! {
    /// What the range finder sees.
    pub struct Wall {
        /// Distance to the wall.
        distance: f32 ["m"],
    }
}

message! {
    /// A step of the wheels.
    pub struct Step {
        /// How far to turn towards the wall.
        turn: f32 ["rad"],
    }
}

mod topics {
    use super::{Step, Wall};

    stampfly_bus::topics! {
        outside range_finder, motors;

        /// Distance to the wall, every sample.
        wall: Wall = ring(8) @ 50 Hz from range_finder => [planner];
        /// Steps to take; none is lost without the planner knowing.
        steps: Step = queue(2) @ on event from planner => [wheels];
        /// Steps that were refused, all together.
        refused: Step = latest @ 50 Hz from planner => [];
        /// Where the wheels are turned to.
        heading: Step = latest @ 10 Hz from wheels => [planner, motors];
    }
}

/// Plans a step for every distance.
#[derive(Clone, Serialize, Deserialize)]
struct Planner {
    wanted: f32,
    refused: f32,
}

impl Planner {
    fn new(wanted: &f32) -> Self {
        Self { wanted: *wanted, refused: 0.0 }
    }
}

impl Runnable for Planner {
    type Ends<'b> = topics::PlannerEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        for wall in ends.wall.iter() {
            let turn = 0.2 * (wall.data.distance - self.wanted) - 0.5 * ends.heading.get().turn;
            if let Err(Full(step)) = activation.offer(&mut ends.steps, Step { turn }) {
                self.refused += step.turn;
            }
        }
        ends.refused.publish(activation.now(), &Step { turn: self.refused });
    }
}

/// Takes the steps.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Wheels {
    heading: f32,
}

impl Wheels {
    fn new(_: &f32) -> Self {
        Self::default()
    }
}

impl Runnable for Wheels {
    type Ends<'b> = topics::WheelsEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        self.heading += ends.steps.iter().map(|step| step.data.turn).sum::<f32>();
        ends.heading.publish(activation.now(), &Step { turn: self.heading });
    }
}

stampfly_bus::schedule! {
    /// The robot.
    #[derive(Clone, Serialize, Deserialize)]
    struct Robot on topics from f32;

    /// Plans.
    planner = Planner: on wall or at latest 60 ms, flight, 50 us;
    /// Turns the wheels.
    wheels = Wheels: every 100 ms, background, 50 us;
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut bus = topics::Bus::new();
    let Assembled { mut flight_loop, mut outside, mut taps } =
        Assembled::<Robot>::new(&mut bus, None, &0.5, Instant::ZERO);
    let mut recorder = Recorder::<Robot, _>::start(Memory::default(), "wall follower", Instant::ZERO)?;

    // Ten seconds along a wall. The virtual clock steps by 20 ms; on a microcontroller a timer would.
    let (mut now, mut offset) = (Instant::ZERO, 1.0f32);
    for _ in 0..500 {
        now += Duration::from_millis(20);
        outside.range_finder.wall.publish(now, &Wall { distance: offset });
        recorder.pass(&mut flight_loop, &mut taps, now);
        offset -= 0.01 * outside.motors.heading.latest().map_or(0.0, |sample| sample.data.turn);
    }
    let mut frame = [0; 4096];
    let length = key_frame::encode(&flight_loop, now, &mut frame)?;
    recorder.key_frame(now, &frame[..length])?;
    let log = recorder.into_sink().0;

    let again = replay::<Robot>(&log, 0.5, |_, _, _| true, ReplayOptions::default())?;
    println!(
        "{} bytes of ULog, {} activations again, {} samples compared",
        log.len(),
        again.activations,
        again.samples
    );
    assert_eq!((again.difference, again.key_frames), (None, 1), "bit for bit, and the same state at the end");
    assert!(flight_loop.runnables().planner.refused != 0.0, "some steps were refused");
    Ok(())
}
