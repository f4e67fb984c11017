//! What a page about a flight of the aircraft shows.

use stampfly_sim::vehicle::{Body, Motion, Observer, Page, PanelSpec, Pick};

/// Plots, states and body.
pub const PAGE: Page = Page {
    observers: &[
        Observer { topic: "truth", role: "truth", name: "truth", motion: Motion::Space },
        Observer { topic: "estimate_state", role: "estimate", name: "estimate", motion: Motion::Space },
    ],
    panels: &[
        PanelSpec::new(
            "Air",
            "Airspeed and wind",
            "m/s",
            "air",
            &[("airspeed", "airspeed"), ("wind[0]", "wind north"), ("wind[1]", "wind east")],
        ),
        PanelSpec::new("Path", "Height", "m", "demand", &[("height", "demanded")]),
        PanelSpec::new(
            "Surfaces",
            "Deflections",
            "%",
            "actuator_servo",
            &[
                ("deflection[0]", "left aileron"),
                ("deflection[1]", "right aileron"),
                ("deflection[2]", "elevator"),
                ("deflection[3]", "rudder"),
            ],
        )
        .times(100.0)
        .picking(Pick::Mean),
        PanelSpec::new("Surfaces", "Throttle", "%", "actuator_motor", &[("duty[0]", "throttle")]).times(100.0),
        PanelSpec::new("Path", "Way-points", "", "path_status", &[("remaining", "ahead"), ("landings", "landings")]),
        PanelSpec::new("Battery", "Voltage", "V", "sensor_power", &[("voltage", "battery")]),
    ],
    bands: &[("path_status", "place", "Stage"), ("flight_status", "phase", "State")],
    alerts: Some(("safety", "troubles")),
    body: Body {
        rings: &[],
        radius: 0.0,
        // Nose, wing tips, tail.
        outline: &[
            [0.35, 0.0],
            [0.05, 0.635],
            [-0.1, 0.635],
            [-0.1, 0.05],
            [-0.65, 0.2],
            [-0.65, -0.2],
            [-0.1, -0.05],
            [-0.1, -0.635],
            [0.05, -0.635],
        ],
        down: 0.22,
        nose: 0.35,
        reach: 0.7,
    },
    ..Page::EMPTY
};
