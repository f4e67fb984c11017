//! Battery readings that no battery gives.

use super::*;

/// Alerts of a flight whose battery monitor reads this, from a volt and an ampere per reading at 14 Hz.
fn readings(rig: &mut Rig, list: impl IntoIterator<Item = (f32, f32)>) -> Vec<Alerts> {
    let mut step = |(voltage, current)| {
        rig.battery = PowerData { voltage, current, ..Default::default() };
        rig.read = Some(rig.now + PERIOD);
        (0..28).map(|_| rig.sample(REST, Vec3::zeros())).last().unwrap_or_default()
    };
    list.into_iter().map(&mut step).collect()
}

fn implausible(list: &[Alerts]) -> Option<usize> {
    list.iter().position(|alerts| alerts.contains(Alerts::POWER_IMPLAUSIBLE))
}

#[test]
fn d10_a_reading_of_nothing_in_flight_is_an_alert() {
    let mut rig = Rig::flying().settled();
    for (lie, first) in [(0.0, 2), (f32::NAN, 2), (2.55, 3), (5.2, 2)] {
        let list = readings(&mut rig, [(3.9, 4.0), (3.88, 4.1), (lie, 4.0), (lie, 4.0), (3.87, 4.0)]);
        assert_eq!(implausible(&list), Some(first), "{lie} V");
        assert_eq!(list.last(), Some(&Alerts::NONE), "{lie} V: a good one ends it");
    }
}

#[test]
fn d10_a_lie_does_not_reach_the_level() {
    let mut rig = Rig::flying().settled();
    readings(&mut rig, [(4.1, 4.0)]);
    let list = readings(&mut rig, core::iter::repeat_n((2.55, 4.0), 70));
    assert_eq!(list.first(), Some(&Alerts::NONE), "the next one tells it from a current that comes later");
    let rest = list.get(1..).unwrap_or_default();
    assert!(rest.iter().all(|alerts| *alerts == Alerts::POWER_IMPLAUSIBLE), "five seconds: {:?}", list.last());
}

#[test]
fn a_weak_battery_under_load_is_plausible() {
    let mut rig = Rig::flying().settled();
    rig.mode.armed = false;
    // 0.25 Ω, and eight amperes at once.
    readings(&mut rig, [(4.1, 0.3)]);
    rig.mode.armed = true;
    let list = readings(&mut rig, [(4.05, 0.5), (2.6, 6.0), (3.4, 3.0), (3.0, 4.5), (4.0, 0.5)]);
    assert_eq!(implausible(&list), None, "{list:?}");
    // A mean of the current that comes a reading later.
    let list = readings(&mut rig, [(4.05, 0.2), (3.45, 0.3), (3.45, 2.8), (3.9, 1.5), (4.0, 0.4)]);
    assert_eq!(implausible(&list), None, "{list:?}");
    // As fast as a small cell empties, and faster than any meter's noise.
    let falls = (0..200).map(|k| (4.0 - 0.01 * k as f32 + [0.05, -0.05][k % 2], 4.0));
    assert_eq!(implausible(&readings(&mut rig, falls.take_while(|(v, _)| *v > 2.6))), None);
}

#[test]
fn a_vehicle_without_a_meter_flies_without_one() {
    let mut rig = Rig::flying();
    rig.battery.voltage = 0.0;
    let rig = rig.settled();
    assert_eq!(rig.failsafe.active, Alerts::NONE);
}

/// After how many readings of this battery, a disarmed vehicle's after one of 4 V without current, is the alert there?
fn readings_until(alert: Alerts, voltage: f32, current: f32, millis: u64) -> Option<u64> {
    let config = FailsafeConfig { idle_current: 0.6, ..FailsafeConfig::default() };
    let mut monitor = PowerMonitor::default();
    let mut step = |n: u64, power: PowerData| {
        let now = Instant::from_millis(n * millis);
        monitor.step(&config, Alerts::NONE, now, Some((now, &power)), false)
    };
    step(0, PowerData { voltage: 4.0, ..Default::default() });
    (1..100).find(|n| step(*n, PowerData { voltage, current, ..Default::default() }).contains(alert))
}

#[test]
fn voltage_and_current_are_means_over_two_and_0_3_seconds() {
    // Readings that are seldom, because the weight of one is where such a mean goes wrong: 0.5 of 2.5 s, 0.1 of 0.4 s.
    let count = |left: f32, kept: f32| {
        let mut part = 1.0;
        (1..100).find(|_| {
            part *= kept;
            part < left
        })
    };
    assert_eq!(readings_until(Alerts::LOW_BATTERY, 3.35, 0.0, 500), count(0.05 / 0.65, 1.0 - 0.5 / 2.5));
    assert_eq!(readings_until(Alerts::MOTOR_RUNS, 4.0, 1.0, 100), count(0.4, 1.0 - 0.1 / 0.4));
    assert_eq!(readings_until(Alerts::MOTOR_RUNS, 4.0, 0.55, 100), None);
}
