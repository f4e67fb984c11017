// What flights must be: mission, figure of `stampfly campaign --json`, statistic over the flights, bar. A figure may not
// be above its bar. Read by the tests here and by `cargo xtask bars`, which flies a hundred seeds.
[
    ("square", "pos_rms_m", "max", 0.09),
    ("square", "est_pos_rms_m", "max", 0.09),
    ("square", "alt_rms_m", "max", 0.03),
    ("square", "takeoff_overshoot_m", "max", 0.10),
    ("square", "touchdown_speed_mps", "max", 0.35),
    ("square", "hover_tilt_max_deg", "max", 5.0),
    ("hover", "hover_drift_m", "p95", 0.15),
]
