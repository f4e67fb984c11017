//! A range finder that lies.

use super::*;

#[test]
fn nominal() {
    let Ok(count) = std::env::var("NOMINAL") else { return };
    let mut worst = [0.0f32; 4];
    for seed in 1..=count.parse().unwrap() {
        let (seen, since) = fly(seed, 32.0, Onset::After(FlightPhase::Flying, 0.3), Lies::default());
        let mut w = [0.0f32; 4];
        for (at, e) in &seen.estimator {
            let flying = seen.phases().iter().rev().find(|(t, _)| t <= at).map(|(_, p)| *p);
            if !matches!(flying, Some(FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Landing)) {
                continue;
            }
            w[0] = w[0].max(e.mag_innovation.abs());
            w[1] = w[1].max(e.mag_ratio.abs());
            w[2] = w[2].max(e.accel_ratio);
        }
        let odd = seen.alerts.iter().filter(|(at, _)| *at > since).fold(Alerts::NONE, |a, (_, b)| a | *b);
        println!("{seed}: {w:?} {odd:?} {:?}", seen.end().0.phase);
        for k in 0..4 {
            worst[k] = worst[k].max(w[k]);
        }
    }
    println!("worst {worst:?}");
}

#[test]
fn trace() {
    let Ok(what) = std::env::var("TRACE") else { return };
    let mut held = None;
    let mut n = 0u32;
    let lies = match what.as_str() {
        "low" => Lies { tof: Some(Box::new(|_, tof| (tof.distance, tof.valid) = (0.03, true))), ..Lies::default() },
        "half" => Lies { tof: Some(Box::new(|_, tof| tof.distance *= 0.5)), ..Lies::default() },
        "stuck" => Lies { tof: Some(Box::new(move |_, tof| *tof = *held.get_or_insert(*tof))), ..Lies::default() },
        "bias" => Lies { tof: Some(Box::new(|_, tof| tof.distance -= 0.3)), ..Lies::default() },
        "two" => Lies { tof: Some(Box::new(|_, tof| (tof.distance, tof.valid) = (2.0, true))), ..Lies::default() },
        "alias" => Lies { tof: Some(Box::new(|_, tof| tof.distance %= 0.25)), ..Lies::default() },
        "ramp" => {
            Lies { tof: Some(Box::new(|t, tof| tof.distance = (tof.distance - 0.3 * t).max(0.02))), ..Lies::default() }
        }
        "outliers" => Lies {
            tof: Some(Box::new(move |_, tof| {
                n += 7;
                if n % 10 < 3 {
                    tof.distance = 0.03
                }
            })),
            ..Lies::default()
        },
        "flowzero" => {
            Lies { flow: Some(Box::new(|_, flow| (flow.delta_x, flow.delta_y) = (0.0, 0.0))), ..Lies::default() }
        }
        "flowrev" => Lies {
            flow: Some(Box::new(|_, flow| (flow.delta_x, flow.delta_y) = (-flow.delta_x, -flow.delta_y))),
            ..Lies::default()
        },
        "flowbias" => Lies { flow: Some(Box::new(|_, flow| flow.delta_x += 0.02)), ..Lies::default() },
        "flowswap" => Lies {
            flow: Some(Box::new(|_, flow| (flow.delta_x, flow.delta_y) = (flow.delta_y, flow.delta_x))),
            ..Lies::default()
        },
        _ => Lies::default(),
    };
    let seed = std::env::var("SEED").map_or(1, |v| v.parse().unwrap());
    let phase = if std::env::var("EARLY").is_ok() { FlightPhase::Armed } else { FlightPhase::Flying };
    let (seen, since) = fly(seed, 30.0, Onset::After(phase, 0.3), lies);
    println!("{what}: highest {:.2} drift {:.2}", seen.highest(since), seen.drift(since, Instant::MAX));
    let mut last = Alerts::NONE;
    for (at, alerts) in &seen.alerts {
        if *alerts != last && *at >= since {
            println!("  {:+.2} {alerts:?}", at.since(since).seconds());
            last = *alerts;
        }
    }
    for (at, phase) in seen.phases() {
        println!("  {:+.2} {phase:?}", at.signed_seconds_since(since));
    }
    if std::env::var("FULL").is_ok() {
        for (k, (at, e)) in seen.estimates.iter().enumerate() {
            if k % 40 != 0 || at.signed_seconds_since(since) < -1.0 {
                continue;
            }
            let Some((_, truth)) = seen.truths.iter().find(|(t, _)| t >= at) else { continue };
            println!(
                "{:+.2} h {:.2}/{:.2} vz {:.2}/{:.2} vx {:.2}/{:.2} vy {:.2}/{:.2} bz {:.2} valid {:?}",
                at.signed_seconds_since(since),
                -truth.position.z,
                e.height,
                truth.velocity.z,
                e.velocity.z,
                truth.velocity.x,
                e.velocity.x,
                truth.velocity.y,
                e.velocity.y,
                e.accel_bias.z,
                e.valid.contains(Validity::VELOCITY_Z)
            );
        }
    }
}
