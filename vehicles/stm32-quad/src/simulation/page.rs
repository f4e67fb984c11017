//! What a page about a flight of the quadcopter shows.

use stampfly_sim::vehicle::{Body, Motion, Observer, Page, PanelSpec, Pick};

const DEGREES: f64 = 180.0 / core::f64::consts::PI;
const AXES: &[(&str, &str)] = &[("angle[0]", "roll"), ("angle[1]", "pitch"), ("angle[2]", "yaw")];

/// Plots, states and body.
pub const PAGE: Page = Page {
    observers: &[Observer { topic: "truth", role: "truth", name: "truth", motion: Motion::Space }],
    panels: &[
        PanelSpec::new(
            "Actuators",
            "Motors",
            "%",
            "actuator_motor",
            &[
                ("duty[0]", "rear right"),
                ("duty[1]", "front right"),
                ("duty[2]", "rear left"),
                ("duty[3]", "front left"),
            ],
        )
        .times(100.0)
        .picking(Pick::Mean),
        PanelSpec::new(
            "Pilot",
            "Sticks",
            "",
            "receiver_input",
            &[("roll", "roll"), ("pitch", "pitch"), ("yaw", "yaw"), ("throttle", "throttle")],
        ),
        PanelSpec::new("Attitude", "Angles", "°", "attitude", AXES).times(DEGREES).picking(Pick::Mean),
        PanelSpec::new(
            "Attitude",
            "Rates",
            "°/s",
            "attitude",
            &[("rate[0]", "roll"), ("rate[1]", "pitch"), ("rate[2]", "yaw")],
        )
        .times(DEGREES)
        .picking(Pick::Mean),
        PanelSpec::new(
            "Attitude",
            "Rates that are wanted",
            "°/s",
            "rate_demand",
            &[("setpoint[0]", "roll"), ("setpoint[1]", "pitch"), ("setpoint[2]", "yaw")],
        )
        .times(DEGREES)
        .picking(Pick::Mean),
        PanelSpec::new("Battery", "Voltage", "V", "battery_state", &[("voltage", "filtered")]),
    ],
    bands: &[("flight_status", "phase", "State"), ("flight_status", "mode", "Mode")],
    alerts: Some(("flight_status", "blocks")),
    body: Body {
        rings: &[[-0.078, 0.078, -0.01], [0.078, 0.078, -0.01], [-0.078, -0.078, -0.01], [0.078, -0.078, -0.01]],
        radius: 0.0635,
        outline: &[[0.04, 0.02], [0.04, -0.02], [-0.04, -0.02], [-0.04, 0.02]],
        down: 0.04,
        nose: 0.1,
        reach: 0.14,
    },
    ..Page::EMPTY
};
