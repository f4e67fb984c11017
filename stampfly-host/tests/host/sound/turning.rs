//! A flip asks for room above, and ends level whatever fails in it.

use super::*;
use crate::losses::harness::{Lies, instant, run_in};
use stampfly_types::math;
use stampfly_types::messages::{FlowData, GuidedKind, ImuData, TofData};

const WAYS: [(&str, GuidedKind); 4] = [
    ("left", GuidedKind::FlipLeft),
    ("right", GuidedKind::FlipRight),
    ("forward", GuidedKind::FlipForward),
    ("back", GuidedKind::FlipBack),
];

/// What fails beside a sensor that lies.
#[derive(Clone, Copy, PartialEq)]
enum Fails {
    Nothing,
    /// Range finder and barometer fall silent.
    Bus,
    /// The front right rotor has this share of its thrust.
    Rotor(f64),
    /// The program is not heard any more.
    Link,
}

/// Takes off to this height, turns over, and lands four seconds later. So long after the flip
/// began, s, the sensors begin to lie and this fails.
fn flip(way: GuidedKind, seed: u64, height: f32, lies: Lies, after: f32, fails: Fails) -> (Seen, Option<Instant>) {
    let (since, note) = instant();
    let seen = run_in(
        |_| {},
        lies,
        seed,
        50.0,
        |mut hands| {
            Box::pin(async move {
                hands.wait_for(|frame| frame.phase == FlightPhase::IdleGround && frame.blocks.is_empty()).await;
                hands.command(GuidedKind::Arm);
                hands.wait_for(|frame| frame.armed).await;
                hands.command_at(GuidedKind::TakeOff, height);
                hands.wait_for(|frame| frame.phase == FlightPhase::Flying).await;
                for _ in 0..75 {
                    hands.command(GuidedKind::None);
                    hands.sleep(0.02).await;
                }
                hands.command(way);
                for n in 0..200 {
                    if n * 20 >= (1e3 * after) as i32 && hands.lying.get().is_none() {
                        note.set(hands.clock.now());
                        hands.lying.set(Some(hands.clock.now()));
                        hands.height_silent.set(fails == Fails::Bus);
                        if let Fails::Rotor(thrust) = fails {
                            hands.weaken(0, thrust);
                        }
                    }
                    if fails != Fails::Link || hands.lying.get().is_none() {
                        hands.command(GuidedKind::None);
                    }
                    hands.sleep(0.02).await;
                }
                if fails != Fails::Link {
                    hands.command(GuidedKind::Land);
                }
                while hands.telemetry().armed {
                    if fails != Fails::Link {
                        hands.command(GuidedKind::None);
                    }
                    hands.sleep(0.02).await;
                }
                hands.sleep(1.0).await;
                hands.leave();
                hands.sleep(0.1).await;
            })
        },
    );
    let began = seen.entered(FlightPhase::Flip, Instant::ZERO);
    (seen, began.filter(|_| since.get() > Instant::ZERO))
}

/// Flights of a kind in the small size and in the thorough one.
const FLOWN: [f32; 2] = [6.0, 96.0];

/// A kind of failure: its name, what it makes of the sensors' samples, and what else fails.
struct Kind {
    name: &'static str,
    lies: fn() -> Lies,
    fails: Fails,
    /// How many of [`FLOWN`] end level, and within 5 m of their place. Fewer, by more than two
    /// standard errors of such a count, are a step back; of all of them not one.
    level: [f32; 2],
    near: [f32; 2],
}

const fn kind(name: &'static str, lies: fn() -> Lies) -> Kind {
    Kind { name, lies, fails: Fails::Nothing, level: FLOWN, near: FLOWN }
}

impl Kind {
    const fn with(self, fails: Fails) -> Self {
        Self { fails, ..self }
    }

    const fn ends(self, level: [f32; 2], near: [f32; 2]) -> Self {
        Self { level, near, ..self }
    }
}

fn imu(lie: impl FnMut(f32, &mut ImuData) + 'static) -> Lies {
    Lies { imu: Some(Box::new(lie)), ..Lies::default() }
}

fn tof(lie: impl FnMut(f32, &mut TofData) + 'static) -> Lies {
    Lies { tof: Some(Box::new(lie)), ..Lies::default() }
}

fn flow(lie: impl FnMut(f32, &mut FlowData) + 'static) -> Lies {
    Lies { flow: Some(Box::new(lie)), ..Lies::default() }
}

fn dark(_: f32, flow: &mut FlowData) {
    (flow.delta_x, flow.delta_y, flow.quality, flow.valid) = (0.0, 0.0, 0, false);
}

fn scaled(by: f32) -> Lies {
    imu(move |_, imu| (imu.accel, imu.gyro) = (imu.accel * by, imu.gyro * by))
}

/// Those without figures end level near their place in every flight.
///
/// During a flip only the gyro measures the attitude, so its error stays in the attitude: half a
/// radian a second makes 29 degrees in the second that a flip takes, a scale that changes by a tenth
/// makes 36 degrees, and with a scale that changes by a fifth most flights end in a crash. A vehicle
/// that does not see the floor keeps its drift until it has landed. On a dead bus, without any
/// height, two of 96 vehicles land tilted.
const KINDS: [Kind; 12] = [
    kind("accel z -4", || imu(|_, imu| imu.accel.z -= 4.0)).ends(FLOWN, [6.0, 94.0]),
    kind("half the range", || tof(|_, tof| tof.distance *= 0.5)),
    kind("no range", || tof(|_, tof| (tof.distance, tof.valid) = (0.0, false))),
    kind("3 cm", || tof(|_, tof| (tof.distance, tof.valid) = (0.03, true))),
    kind("a dark floor", || flow(dark)).ends(FLOWN, [6.0, 85.0]),
    kind("a dead bus", Lies::default).with(Fails::Bus).ends([6.0, 94.0], FLOWN),
    kind("a rotor of 0.8", Lies::default).with(Fails::Rotor(0.8)),
    kind("a lost link", Lies::default).with(Fails::Link),
    kind("gyro x +0.5", || imu(|_, imu| imu.gyro.x += 0.5)).ends([5.0, 88.0], [4.0, 84.0]),
    kind("gyro y +0.5", || imu(|_, imu| imu.gyro.y += 0.5)).ends([4.0, 79.0], [4.0, 79.0]),
    kind("imu times 0.9", || scaled(0.9)).ends([3.0, 63.0], [1.0, 53.0]),
    kind("imu times 1.2", || scaled(1.2)).ends([1.0, 35.0], [5.0, 83.0]),
];

/// How one ended: did it touch the ground as after any landing, within 5 m of its place?
struct End {
    level: bool,
    near: bool,
}

fn end(kind: &Kind, (way, command): (&str, GuidedKind), seed: u64, after: f32) -> End {
    let (seen, began) = flip(command, seed, 1.5, (kind.lies)(), after, kind.fails);
    let what = format!("{} after {after} s, {way}, seed {seed}", kind.name);
    let began = began.unwrap_or_else(|| panic!("{what}: it turns over"));
    let highest = seen.highest(Instant::ZERO);
    let drift = seen.drift(began, Instant::MAX);
    let alerts = seen.accused(CONVICTS, Instant::MAX).map(|(all, _)| names(all));
    let speed = seen.touch_speed();
    let (level, near) = (seen.ends_well(1.0) && highest < 4.0, drift < 5.0);
    let mark = ["!!", "  "][usize::from(level)];
    println!("{mark} {what}: to {highest:.2} m, {drift:.2} m away, touches at {speed:.2} m/s, {alerts:?}");
    // Whatever the end is, the motors are off.
    assert!(!seen.end().0.armed, "{what}: flies on for ever");
    End { level, near }
}

/// Every kind in every direction, at moments of the flip.
#[test]
fn whatever_fails_during_a_flip_it_ends_as_the_table_says() {
    let mut wrong = Vec::new();
    for kind in &KINDS {
        let mut ends = Vec::new();
        for seed in 1..=crate::thorough::flights(1, 3) {
            for (place, way) in WAYS.into_iter().enumerate() {
                let few = if place == 0 { vec![0.1, 0.3, 0.5] } else { vec![0.3] };
                for after in thorough(few, vec![0.06, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0]) {
                    ends.push(end(kind, way, seed, after));
                }
            }
        }
        let [level, near] = [|end: &&End| end.level, |end: &&End| end.near].map(|of| ends.iter().filter(of).count());
        let all = ends.len();
        let line = format!("{}: of {all} flights {level} end level, {near} near their place", kind.name);
        println!("{line}");
        let size = thorough(0, 1);
        let fewer = |count: usize, of: [f32; 2]| {
            let (share, all) = (of[size] / FLOWN[size], all as f32);
            (count as f32) < all * share - 2.0 * math::sqrt(all * share * (1.0 - share))
        };
        if fewer(level, kind.level) || fewer(near, kind.near) {
            wrong.push(line);
        }
    }
    none(&wrong);
}

/// A flip rises by up to 0.6 m. Where the vehicle may not fly as high it stays as it is, and says
/// why.
#[test]
fn without_room_above_it_stays_as_it_is() {
    let (seen, began) = flip(GuidedKind::FlipLeft, 1, 2.6, Lies::default(), 9.0, Fails::Nothing);
    assert_eq!(began, None);
    assert_eq!(seen.entered(FlightPhase::Flip, Instant::ZERO), None, "0.4 m below the highest place");
    assert!(seen.ends_well(0.5));
}
