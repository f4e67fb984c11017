//! What a page about a drive shows.

use stampfly_sim::vehicle::{Body, Motion, Observer, Page, PanelSpec};

const DEGREES: f64 = 180.0 / core::f64::consts::PI;

/// Plots, states and body of the rover, which is as long as its default wheelbase.
pub const PAGE: Page = Page {
    observers: &[Observer { topic: "vehicle_state", role: "truth", name: "truth", motion: Motion::Plane }],
    panels: &[
        PanelSpec::new(
            "Driver",
            "Pedals and steering",
            "",
            "driver_input",
            &[("throttle", "throttle"), ("brake", "brake"), ("steer", "steer")],
        ),
        PanelSpec::new("Actuators", "Engine", "m/s²", "drive_command", &[("acceleration", "acceleration")]),
        PanelSpec::new("Actuators", "Brake", "m/s²", "brake_command", &[("deceleration", "deceleration")]),
        PanelSpec::new("Actuators", "Steering", "°", "steering_command", &[("angle", "angle")]).times(DEGREES),
        PanelSpec::new("Motion", "Speed", "m/s", "vehicle_state", &[("v", "speed")]),
        PanelSpec::new("Motion", "Position", "m", "vehicle_state", &[("x", "forward"), ("y", "left")]),
        PanelSpec::new("Motion", "Yaw", "°", "vehicle_state", &[("yaw", "yaw")]).times(DEGREES),
    ],
    bands: &[("safety_status", "system_state", "State"), ("operator_command", "mode", "Input")],
    alerts: Some(("diag_status", "faults")),
    body: Body {
        rings: &[[0.1, 0.09, -0.03], [-0.1, 0.09, -0.03], [-0.1, -0.09, -0.03], [0.1, -0.09, -0.03]],
        radius: 0.03,
        outline: &[[0.13, 0.07], [0.13, -0.07], [-0.13, -0.07], [-0.13, 0.07]],
        down: -0.05,
        nose: 0.2,
        reach: 0.13,
    },
    ..Page::EMPTY
};
