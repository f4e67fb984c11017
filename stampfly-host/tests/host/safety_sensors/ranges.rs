//! A range finder that lies.

use super::*;

type Lie = Box<dyn FnMut(f32, &mut TofData)>;

/// Lies, how high the vehicle may get from its 0.5 m, m, and within how many seconds they must be found,
/// if they can be. What reads as where the vehicle stood is the sensor's window and left out, until it
/// repeats itself or leaves that place, as the alias of 0.52 m does.
fn lies() -> Vec<(&'static str, Lie, f32, Option<f32>)> {
    let mut held = None;
    let mut count = 0u32;
    vec![
        ("low", Box::new(|_, tof: &mut TofData| (tof.distance, tof.valid) = (0.03, true)), 1.0, Some(1.0)),
        ("stuck", Box::new(move |_, tof: &mut TofData| *tof = *held.get_or_insert(*tof)), 1.0, Some(2.0)),
        ("half", Box::new(|_, tof: &mut TofData| tof.distance *= 0.5), 1.0, Some(0.5)),
        ("0.3 m too low", Box::new(|_, tof: &mut TofData| tof.distance -= 0.3), 1.0, Some(0.5)),
        ("aliased", Box::new(|_, tof: &mut TofData| tof.distance %= 0.2), 1.0, Some(0.5)),
        ("aliased to the window", Box::new(|_, tof: &mut TofData| tof.distance %= 0.25), 1.0, Some(2.0)),
        (
            "outliers",
            Box::new(move |_, tof: &mut TofData| {
                count += 7;
                if count % 10 < 3 {
                    tof.distance = 0.03;
                }
            }),
            0.8,
            None,
        ),
        // It is followed until it ends: no other sensor knows better in a room with doors.
        ("ramp", Box::new(|t, tof: &mut TofData| tof.distance = (tof.distance - 0.3 * t).max(0.02)), 4.5, None),
    ]
}

#[test]
fn d1_a_range_that_lies_does_not_carry_the_vehicle_away() {
    for seed in seeds() {
        for (what, lie, highest, within) in lies() {
            let lies = Lies { tof: Some(lie), ..Lies::default() };
            let (seen, since) = fly(seed, 40.0, Onset::After(FlightPhase::Flying, 2.0), lies);
            let found = seen.alert_after(Alerts::RANGE_IMPLAUSIBLE, since);
            let reached = seen.highest(since);
            println!(
                "{what}, seed {seed}: {reached:.2} m, found after {found:?} s, drift {:.2} m",
                seen.drift(since, Instant::MAX)
            );
            assert!(reached < highest, "{what}, seed {seed}: {reached} m");
            assert!(
                within.is_none_or(|limit| found.is_some_and(|found| found < limit)),
                "{what}, seed {seed}: {found:?} s"
            );
            assert!(!seen.end().0.armed && seen.end().1.contact, "{what}, seed {seed}: it has landed");
        }
    }
}

#[test]
fn d1_a_range_stuck_from_the_take_off_on_does_not_carry_the_vehicle_away() {
    for seed in seeds() {
        let lie: Lie = Box::new(|_, tof| (tof.distance, tof.valid) = (0.03, true));
        let lies = Lies { tof: Some(lie), ..Lies::default() };
        let (seen, since) = fly(seed, 40.0, Onset::After(FlightPhase::Armed, 0.3), lies);
        let found = seen.alert_after(Alerts::RANGE_IMPLAUSIBLE, since);
        let reached = seen.highest(since);
        println!("from the take-off, seed {seed}: {reached:.2} m, found after {found:?} s");
        assert!(reached < 1.5, "seed {seed}: {reached} m");
        assert!(found.is_some_and(|found| found < 2.5), "seed {seed}: {found:?} s");
    }
}

#[test]
fn d1_a_range_that_recovers_is_believed_again() {
    for seed in seeds() {
        let lie: Lie = Box::new(|t, tof| {
            if t < 2.0 {
                (tof.distance, tof.valid) = (0.03, true);
            }
        });
        let (seen, since) =
            fly(seed, 35.0, Onset::After(FlightPhase::Flying, 2.0), Lies { tof: Some(lie), ..Lies::default() });
        let reached = seen.highest(since);
        println!("2 s of 3 cm, seed {seed}: {reached:.2} m");
        assert!(reached < 1.1, "seed {seed}: {reached} m");
        let late = |at: Instant| at.since(since).seconds() > 9.0 && at.since(since).seconds() < 11.0;
        let doubted = seen.alerts.iter().any(|(at, alerts)| late(*at) && alerts.contains(Alerts::RANGE_IMPLAUSIBLE));
        assert!(!doubted, "seed {seed}");
    }
}
