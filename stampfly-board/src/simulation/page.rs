//! What a page about a flight of the StampFly shows.

use stampfly_sim::vehicle::{Body, Motion, Observer, Page, PanelSpec, Pick};
use stampfly_types::messages::CalibrationKind;

const DEGREES: f64 = 180.0 / core::f64::consts::PI;
const XYZ: [&str; 3] = ["x", "y", "z"];

/// Plots, states and body of the StampFly.
pub const PAGE: Page = Page {
    observers: &[
        Observer { topic: "estimate_state", role: "estimate", name: "estimate", motion: Motion::Space },
        Observer { topic: "truth", role: "truth", name: "truth", motion: Motion::Space },
        Observer { topic: "device", role: "device", name: "on board", motion: Motion::Space },
    ],
    setpoint: Some("setpoint"),
    calibrations: &[
        (CalibrationKind::Temperature, "calibrate temperature"),
        (CalibrationKind::SixPositions, "calibrate six"),
        (CalibrationKind::Level, "calibrate level"),
        (CalibrationKind::Magnetometer, "calibrate mag"),
    ],
    panels: &[
        PanelSpec::new(
            "Actuators",
            "Motor duty",
            "%",
            "actuator_motor",
            &[("duty[0]", "M1"), ("duty[1]", "M2"), ("duty[2]", "M3"), ("duty[3]", "M4")],
        )
        .times(100.0)
        .picking(Pick::Mean),
        PanelSpec::new("Actuators", "Thrust demand", "N", "control_output", &[("thrust", "thrust")])
            .picking(Pick::Mean),
        PanelSpec::new(
            "Actuators",
            "Torque demand",
            "mN·m",
            "control_output",
            &[("torque[0]", "roll"), ("torque[1]", "pitch"), ("torque[2]", "yaw")],
        )
        .times(1e3)
        .picking(Pick::Mean),
        status("Innovation, height", "m", &[("tof_innovation", "range"), ("baro_innovation", "barometer")]),
        status("Innovation, flow", "m/s", &[("flow_innovation[0]", "forward"), ("flow_innovation[1]", "right")]),
        status("Innovation, angles", "°", &[("mag_innovation", "heading"), ("accel_innovation", "gravity")])
            .times(DEGREES),
        status(
            "Test ratio",
            "",
            &[
                ("tof_ratio", "range"),
                ("flow_ratio", "flow"),
                ("baro_ratio", "barometer"),
                ("mag_ratio", "field"),
                ("accel_ratio", "gravity"),
            ],
        )
        .limited(1.0),
        PanelSpec::new(
            "Sensors",
            "Angular rate",
            "°/s",
            "sensor_imu",
            &[("gyro[0]", XYZ[0]), ("gyro[1]", XYZ[1]), ("gyro[2]", XYZ[2])],
        )
        .times(DEGREES)
        .picking(Pick::Mean),
        PanelSpec::new(
            "Sensors",
            "Specific force",
            "m/s²",
            "sensor_imu",
            &[("accel[0]", XYZ[0]), ("accel[1]", XYZ[1]), ("accel[2]", XYZ[2])],
        )
        .picking(Pick::Mean),
        PanelSpec::new("Sensors", "Range", "m", "sensor_tof", &[("distance", "range")]),
        PanelSpec::new(
            "Sensors",
            "Magnetic field",
            "µT",
            "sensor_mag",
            &[("field[0]", XYZ[0]), ("field[1]", XYZ[1]), ("field[2]", XYZ[2])],
        ),
        PanelSpec::new(
            "Sensors",
            "Flow per sample",
            "mrad",
            "sensor_flow",
            &[("delta_x", "forward"), ("delta_y", "right")],
        )
        .times(1e3)
        .picking(Pick::Mean),
        PanelSpec::new("Battery", "Voltage", "V", "sensor_power", &[("voltage", "voltage")]),
        PanelSpec::new("Battery", "Current", "A", "sensor_power", &[("current", "current")]),
    ],
    bands: &[
        ("flight_status", "phase", "Phase"),
        ("flight_status", "mode", "Mode"),
        ("command_setpoint", "source", "Command"),
    ],
    alerts: Some(("system_alert", "active")),
    body: Body {
        rings: &[
            [0.0325, 0.0325, -0.008],
            [-0.0325, 0.0325, -0.008],
            [-0.0325, -0.0325, -0.008],
            [0.0325, -0.0325, -0.008],
        ],
        radius: 0.0212,
        outline: &[[0.018, 0.011], [0.018, -0.011], [-0.018, -0.011], [-0.018, 0.011]],
        down: -0.007,
        nose: 0.05,
        reach: 0.0325,
    },
};

/// A plot of the estimator's status: the extremes count.
const fn status(title: &'static str, unit: &'static str, lines: &'static [(&'static str, &'static str)]) -> PanelSpec {
    PanelSpec::new("Estimator", title, unit, "estimate_status", lines).picking(Pick::Peak)
}
