//! The vehicle flies with the limits of its configuration.

use stampfly_board::schedule::Runnables;
use stampfly_board::{VehicleConfig, topics};
use stampfly_bus::Band;
use stampfly_flight::Assembled;
use stampfly_param::parameters;
use stampfly_types::Instant;
use stampfly_types::messages::{Alerts, TofData};

/// The alerts of a vehicle without a battery monitor, so many seconds after power-on, with ranges of this distance.
fn alerts(config: &VehicleConfig, seconds: f32, distance: Option<f32>) -> Alerts {
    let mut bus = topics::Bus::new();
    let vehicle = Assembled::<Runnables>::new(&mut bus, None, config, Instant::ZERO);
    let (mut flight_loop, mut outside) = (vehicle.flight_loop, vehicle.outside);
    for step in 1..=(400.0 * seconds) as u64 {
        let now = Instant::from_micros(2_500 * step);
        outside.imu.sensor_imu.publish(now, &Default::default());
        if let Some(distance) = distance.filter(|_| step.is_multiple_of(13)) {
            outside.tof.sensor_tof.publish(now, &TofData { distance, valid: true, ..TofData::default() });
        }
        flight_loop.run_band(Band::Flight, now, &mut ());
        flight_loop.run_band(Band::Background, now, &mut ());
    }
    outside.link.telemetry.latest().expect("fifty a second").data.alerts
}

#[test]
fn a_timeout_is_the_parameters() {
    let mut config = VehicleConfig::default();
    assert!(!alerts(&config, 0.3, None).contains(Alerts::POWER_LOST), "a second by default");
    parameters::set(&mut config, "failsafe.power.timeout", 0.25).expect("in range");
    assert!(alerts(&config, 0.3, None).contains(Alerts::POWER_LOST));
}

#[test]
fn a_range_of_nothing_or_less_is_none() {
    for (distance, lost) in [(None, true), (Some(0.0), true), (Some(-0.27), true), (Some(0.03), false)] {
        let alerts = alerts(&VehicleConfig::default(), 2.0, distance);
        assert_eq!(alerts.contains(Alerts::TOF_LOST), lost, "{distance:?} m");
    }
}
