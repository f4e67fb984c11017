// What flights must be: mission, figure of `stampfly campaign --json`, statistic over the flights, bar. A figure may not
// be above its bar. Read by the tests here and by `cargo xtask bars`, which flies a hundred seeds.
// Tilt: a gust of four standard deviations, 2 m/s, asks for 4.8° against drag alone (0.41 1/s); the
// correction of velocity and position comes on top, a quarter of that at most.
[
    ("square", "pos_rms_m", "max", 0.09),
    ("square", "est_pos_rms_m", "max", 0.09),
    ("square", "alt_rms_m", "max", 0.03),
    ("square", "takeoff_overshoot_m", "max", 0.10),
    ("square", "touchdown_speed_mps", "max", 0.35),
    ("square", "hover_tilt_max_deg", "max", 6.0),
    ("hover", "hover_drift_m", "p95", 0.15),
]
