use super::*;

const DT: f32 = 0.01;

/// Has flow just been found to lie?
fn is_lie(verdict: Verdict) -> bool {
    matches!(verdict, Verdict::Implausible(_))
}

/// A vehicle that stands still in the air, as flow tells; after each reading flow corrects the acceleration by this
/// much. After how many of 200 readings is flow, or the gyro, not believed?
fn found(mut monitor: FlowMonitor, correction: Vec3) -> Option<u32> {
    monitor.ready();
    (0..200).find(|n| {
        monitor.predict(&Vec3::zeros(), DT);
        // Not frozen.
        let counts = [if n % 2 == 0 { 0.002 } else { -0.002 }, 0.0];
        let implausible = monitor.flow(counts, [0.0; 2], &Vec3::zeros(), 0.3, DT, Some(0.0));
        monitor.corrected(&correction, &Vec3::zeros());
        implausible != Verdict::Unchanged
    })
}

#[test]
fn a_gyro_bias_that_flow_moved_explains_the_tilt_that_flow_goes_on_correcting() {
    // A bias of (0.2, -0.1) rad/s tips the acceleration by gravity times as much each second.
    let moved = |sign: f32| {
        let mut monitor = FlowMonitor::airborne();
        monitor.corrected(&Vec3::zeros(), &(Vec3::new(0.2, -0.1, 0.0) * sign));
        monitor
    };
    let correction = Vec3::new(0.1, 0.2, 0.0) * GRAVITY * DT;
    assert!(found(moved(1.0), correction).is_none());
    let unmoved = found(moved(0.0), correction).unwrap();
    assert!(found(moved(-1.0), correction).unwrap() < unmoved);
}

#[test]
fn a_tilt_that_was_found_to_be_wrong_may_be_corrected() {
    let inflated = |tilt: f32| {
        let mut monitor = FlowMonitor::airborne();
        monitor.inflated(tilt);
        monitor
    };
    // One and a half m/s² within two seconds.
    let correction = Vec3::new(0.015, 0.0, 0.0);
    let sure = found(inflated(0.0), correction).unwrap();
    assert!(found(inflated(0.1), correction).is_none_or(|found| found > sure));
    assert!(found(inflated(0.0), 0.25 * correction).is_none());
}

#[test]
fn a_picture_stands_still_for_millimetres_not_for_centimetres() {
    let found = |distance: f32| {
        let mut monitor = FlowMonitor::airborne();
        (0..30).any(|_| {
            monitor.predict(&Vec3::zeros(), DT);
            // 0.012 rad in all.
            is_lie(monitor.flow([0.0; 2], [0.04, 0.0], &Vec3::new(0.0, -0.04 * distance, 0.0), distance, DT, Some(0.0)))
        })
    };
    assert!(!found(0.3) && found(1.0));
}

/// After how many of 300 readings is flow not believed on a vehicle whose accelerometer feels no motion? `reading` makes
/// flow's velocity and the picture's rate, and may change the monitor before it takes them.
fn convicted(distance: f32, reading: impl Fn(u32, &mut FlowMonitor) -> (f32, f32)) -> Option<u32> {
    let mut monitor = FlowMonitor::default();
    (0..300).find(|n| {
        monitor.predict(&Vec3::zeros(), DT);
        let (velocity, rate) = reading(*n, &mut monitor);
        // Not frozen.
        let counts = [rate * DT, if n % 2 == 0 { 0.002 } else { -0.002 }];
        is_lie(monitor.flow(counts, [0.0; 2], &Vec3::new(velocity, 0.0, 0.0), distance, DT, Some(0.0)))
    })
}

#[test]
fn a_first_reading_that_holds_two_frames_convicts_nobody() {
    // The last one before flow's past is forgotten, and the first one after it.
    for double in [99, 100] {
        let found = convicted(0.3, |n, monitor| {
            if n == 100 {
                monitor.forget();
            }
            (if n == double { 1.2 } else { 0.0 }, 0.0)
        });
        assert_eq!(found, None, "reading {double}");
    }
}

#[test]
fn a_jump_convicts_flow_unless_it_was_the_gyros() {
    // The smaller one is less than the difference may be for long.
    for jump in [1.0, 0.6] {
        for at in 100..105 {
            let steps = |n: u32| (if n < at { 0.0 } else { jump }, 0.0);
            let found = convicted(0.5, |n, _| steps(n));
            assert!(found.is_some_and(|found| (at + 10..at + 30).contains(&found)), "{jump} m/s at {at}: {found:?}");
            let undone = convicted(0.5, |n, monitor| {
                if n == at + 10 {
                    monitor.forget();
                }
                steps(n)
            });
            assert_eq!(undone, None, "{jump} m/s at {at}");
        }
    }
    assert_eq!(convicted(0.5, |n, _| (if n < 100 { 0.0 } else { 0.3 }, 0.0)), None, "none at all");
}

/// It was believed for one reading after each half second of agreement, and convicted again.
#[test]
fn an_offset_that_began_with_a_jump_is_not_believed_again_in_the_air() {
    let mut monitor = FlowMonitor::default();
    let mut convictions = 0;
    for n in 0..1_000_u32 {
        // It swings to and fro, and flow says so, too much by 1 m/s from the second on.
        let velocity = 0.5 * stampfly_types::math::sin(0.03 * n as f32);
        let before = 0.5 * stampfly_types::math::sin(0.03 * (n as f32 - 1.0));
        monitor.predict(&Vec3::new(velocity - before, 0.0, 0.0), DT);
        let flow = Vec3::new(velocity + if n < 100 { 0.0 } else { 1.0 }, 0.0, 0.0);
        let counts = [flow.x * DT / 0.5, if n % 2 == 0 { 0.002 } else { -0.002 }];
        convictions += u32::from(is_lie(monitor.flow(counts, [0.0; 2], &flow, 0.5, DT, Some(0.0))));
        if !(100..130).contains(&n) {
            assert_eq!(monitor.is_implausible(), n >= 130, "reading {n}");
        }
    }
    assert_eq!(convictions, 1);
    monitor.stand([0.0; 2], DT);
    assert!(!monitor.is_implausible());
}

#[test]
fn nothing_jumps_where_every_fifth_reading_holds_two_frames() {
    for distance in [0.3, 0.5, 1.0, 2.0] {
        let found = convicted(distance, |n, _| {
            let rate = if n % 5 == 0 { 2.0 } else { 1.0 };
            (rate * distance, rate)
        });
        assert_eq!(found, None, "{distance} m");
    }
}

#[test]
fn the_picture_of_a_vehicle_that_stands_may_creep_and_not_run() {
    let found = |rate: f32, readings: u32| {
        let mut monitor = FlowMonitor::default();
        (0..readings).for_each(|_| monitor.stand([0.0, -rate], DT));
        monitor.is_implausible()
    };
    assert!(found(2.0, 10), "while motors spool up");
    assert!(found(0.7, 150) && !found(0.3, 100) && !found(0.7, 50));
}

#[test]
fn vibration_adds_up_to_a_velocity_that_is_no_jump() {
    // Near the floor, where 0.3 m/s are a jump. At twice the recorded vibration samples change by 57 (m/s²)² in the mean square.
    let found = |shaken: f32| {
        let mut monitor = FlowMonitor::default();
        (0..200).any(|n| {
            monitor.predict(&Vec3::zeros(), DT);
            let counts = [0.0, if n % 2 == 0 { 0.002 } else { -0.002 }];
            let velocity = Vec3::new(if n < 100 { 0.0 } else { 0.32 }, 0.0, 0.0);
            is_lie(monitor.flow(counts, [0.0; 2], &velocity, 0.17, DT, Some(shaken)))
        })
    };
    assert!(found(0.0) && !found(57.0));
}

/// A vehicle that climbs to half a metre within a second and feels nothing: what is said of flow's velocity, a function of time and
/// distance, and when, s.
fn climbs(flow: impl Fn(f32, f32) -> f32) -> (FlowMonitor, Option<(f32, Verdict)>) {
    let mut monitor = FlowMonitor::default();
    (0..20).for_each(|_| monitor.stand([0.0; 2], DT));
    for n in 1..=250u16 {
        let time = f32::from(n) * DT;
        let distance = (0.03 + 0.5 * time).min(0.5);
        let velocity = Vec3::new(flow(time, distance), 0.0, 0.0);
        let counts = [velocity.x / distance * DT, if n % 2 == 0 { 0.002 } else { -0.002 }];
        monitor.predict(&Vec3::zeros(), DT);
        let verdict = monitor.flow(counts, [0.0; 2], &velocity, distance, DT, Some(17.0));
        if verdict != Verdict::Unchanged {
            return (monitor, Some((time, verdict)));
        }
    }
    (monitor, None)
}

/// It grows too slowly for any other comparison.
#[test]
fn an_offset_from_the_take_off_on_is_undone_from_there_and_not_believed_again_in_the_air() {
    let (mut monitor, said) = climbs(|_, distance| 1.8 * distance);
    let Some((when, Verdict::Implausible(lied))) = said else { panic!("{said:?}") };
    assert!((0.8..2.0).contains(&when) && (lied - when).abs() < 0.02, "{lied} s after {when} s");
    for n in 0..500 {
        monitor.predict(&Vec3::new(if n % 200 < 100 { 0.02 } else { -0.02 }, 0.0, 0.0), DT);
        let velocity = Vec3::new(0.9 + 0.02 * f32::from(100 - (n % 200 - 100i16).abs()), 0.0, 0.0);
        monitor.flow([velocity.x * DT / 0.5, 0.001], [0.0; 2], &velocity, 0.5, DT, Some(17.0));
        assert!(monitor.is_implausible(), "reading {n}");
    }
    monitor.stand([0.0; 2], DT);
    assert!(!monitor.is_implausible());
}

#[test]
fn a_gyro_that_shifts_as_the_vehicle_takes_off_does_not_convict_flow() {
    let (monitor, said) = climbs(|time, distance| {
        let age = (time - 0.1).max(0.0);
        0.2 * (0.5 * GRAVITY * age * age - distance)
    });
    assert!(matches!(said, Some((_, Verdict::GyroShifted(_)))) && !monitor.is_implausible(), "{said:?}");
}
