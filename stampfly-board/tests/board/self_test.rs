//! A machine that computes something else does not arm, and says why; one with other bits only says so.

use stampfly_board::schedule::Runnables;
use stampfly_board::{VehicleConfig, messages::TelemetryFrame, topics};
use stampfly_bus::Band;
use stampfly_flight::Assembled;
use stampfly_types::Instant;
use stampfly_types::messages::{Alerts, ArmBlocks, SelfTest, SelfTestVerdict};

/// What the ground station sees after a tenth of a second.
fn after(verdict: SelfTestVerdict) -> TelemetryFrame {
    let mut bus = topics::Bus::new();
    let vehicle = Assembled::<Runnables>::new(&mut bus, None, &VehicleConfig::default(), Instant::ZERO);
    let (mut flight_loop, mut outside) = (vehicle.flight_loop, vehicle.outside);
    outside.self_test.self_test.publish(Instant::ZERO, &SelfTest { verdict, worst: 0.0 });
    for step in 1..=40 {
        let now = Instant::from_micros(2_500 * step);
        outside.imu.sensor_imu.publish(now, &Default::default());
        flight_loop.run_band(Band::Flight, now, &mut ());
        flight_loop.run_band(Band::Background, now, &mut ());
    }
    outside.link.telemetry.latest().expect("fifty a second").data
}

#[test]
fn a_failed_self_test_refuses_arming() {
    let frame = after(SelfTestVerdict::Failed);
    assert!(frame.blocks.contains(ArmBlocks::SELF_TEST) && frame.alerts.contains(Alerts::SELF_TEST_FAILED));
}

#[test]
fn other_bits_are_an_alert_and_no_more() {
    let frame = after(SelfTestVerdict::WithinTolerance);
    assert!(!frame.blocks.contains(ArmBlocks::SELF_TEST) && frame.alerts.contains(Alerts::SELF_TEST_DIFFERS));
    let frame = after(SelfTestVerdict::Identical);
    assert!(!frame.blocks.contains(ArmBlocks::SELF_TEST));
    assert!(!frame.alerts.intersects(Alerts::SELF_TEST_FAILED | Alerts::SELF_TEST_DIFFERS));
}
