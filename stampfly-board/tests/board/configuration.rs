//! The vehicle flies with the limits of its configuration.

use stampfly_board::schedule::Runnables;
use stampfly_board::{VehicleConfig, topics};
use stampfly_bus::Band;
use stampfly_flight::{Assembled, parameters};
use stampfly_types::Instant;
use stampfly_types::messages::Alerts;

/// The alerts of a vehicle without a battery monitor, 0.3 s after power-on.
fn alerts(config: &VehicleConfig) -> Alerts {
    let mut bus = topics::Bus::new();
    let vehicle = Assembled::<Runnables>::new(&mut bus, None, config, Instant::ZERO);
    let (mut flight_loop, mut outside) = (vehicle.flight_loop, vehicle.outside);
    for step in 1..=120 {
        let now = Instant::from_micros(2_500 * step);
        outside.imu.sensor_imu.publish(now, &Default::default());
        flight_loop.run_band(Band::Flight, now, &mut ());
        flight_loop.run_band(Band::Background, now, &mut ());
    }
    outside.link.telemetry.latest().expect("fifty a second").data.alerts
}

#[test]
fn a_timeout_is_the_parameters() {
    let mut config = VehicleConfig::default();
    assert!(!alerts(&config).contains(Alerts::POWER_LOST), "a second by default");
    parameters::set(&mut config, "failsafe.power.timeout", 0.25).expect("in range");
    assert!(alerts(&config).contains(Alerts::POWER_LOST));
}
