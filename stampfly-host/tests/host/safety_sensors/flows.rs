//! Optical flow that lies.

use super::*;

type Lie = Box<dyn FnMut(f32, &mut FlowData)>;

/// Lies, and within how many seconds they must be found.
fn lies() -> Vec<(&'static str, Lie, f32)> {
    let mut held = None;
    vec![
        ("zero", Box::new(|_, flow: &mut FlowData| (flow.delta_x, flow.delta_y) = (0.0, 0.0)), 2.0),
        (
            "frozen",
            Box::new(move |_, flow: &mut FlowData| {
                if flow.delta_x != 0.0 {
                    held.get_or_insert(*flow);
                }
                *flow = held.unwrap_or(*flow);
            }),
            2.0,
        ),
        (
            "reversed",
            Box::new(|_, flow: &mut FlowData| (flow.delta_x, flow.delta_y) = (-flow.delta_x, -flow.delta_y)),
            3.0,
        ),
        (
            "swapped",
            Box::new(|_, flow: &mut FlowData| (flow.delta_x, flow.delta_y) = (flow.delta_y, flow.delta_x)),
            4.0,
        ),
        ("2 rad/s too much", Box::new(|_, flow: &mut FlowData| flow.delta_x += 0.02), 0.5),
        ("huge", Box::new(|_, flow: &mut FlowData| flow.delta_x += 1.0), 0.5),
    ]
}

#[test]
fn d8_flow_that_lies_is_found_and_does_not_crash_the_vehicle() {
    for seed in seeds() {
        for (what, lie, within) in lies() {
            let lies = Lies { flow: Some(lie), ..Lies::default() };
            let (seen, since) = fly(seed, 30.0, Onset::After(FlightPhase::Flying, 0.5), lies);
            let found = seen.alert_after(Alerts::FLOW_IMPLAUSIBLE, since);
            println!("{what}, seed {seed}: found after {found:?} s, drift {:.2} m", seen.drift(since, Instant::MAX));
            assert!(found.is_some_and(|found| found < within), "{what}, seed {seed}: {found:?} s");
            let cut = Alerts::IMPACT | Alerts::GYRO_ANOMALY | Alerts::IMU_FAULTY | Alerts::TUMBLED;
            let landed = seen.entered(FlightPhase::Landing, since).expect("it lands");
            assert!(
                seen.alerts.iter().all(|(at, alerts)| *at > landed || !alerts.intersects(cut)),
                "{what}, seed {seed}"
            );
            assert!(
                seen.alerts.iter().all(|(_, alerts)| !alerts.contains(Alerts::ESTIMATE_DIVERGED)),
                "{what}, seed {seed}"
            );
            let at = since + Duration::from_seconds(found.unwrap_or_default() + 0.1);
            let (when, estimate) = seen.estimates.iter().find(|(when, _)| *when >= at).expect("an estimate");
            let valid = estimate.valid;
            assert!(!valid.contains(Validity::POSITION_XY) && valid.contains(Validity::HEIGHT), "{what}, seed {seed}");
            // What is left of the velocity comes from drag.
            let truth = &seen.truths.iter().find(|(at, _)| at >= when).expect("a truth").1;
            let wrong = (estimate.velocity - truth.velocity).horizontal().norm();
            assert!(!valid.contains(Validity::VELOCITY_XY) || wrong < 0.5, "{what}, seed {seed}: {wrong} m/s");
        }
    }
}
