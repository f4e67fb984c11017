//! Combinations of parameters that cannot fly are refused with the reason, and what is accepted flies.

use stampfly_board::rules::RULES;
use stampfly_board::{VehicleConfig, parameters};
use stampfly_param::parameters::{set, settle};
use stampfly_param::{Conflict, ParameterError, Parameters};

/// Rule by rule: a value of each parameter that goes with the other just so, and one of the first that does not.
const BORDERS: &[([&str; 2], [f32; 2], f32)] = &[
    (["navigator.height.min", "navigator.height.max"], [0.499, 0.5], 0.5),
    (["navigator.takeoff.height", "navigator.height.max"], [0.8, 0.8], 0.81),
    (["navigator.takeoff.height", "navigator.height.min"], [0.4, 0.4], 0.39),
    (["navigator.takeoff.height", "takeoff.airborne.rise"], [0.28, 0.27], 0.27),
    (["navigator.height.min", "takeoff.airborne.rise"], [0.16, 0.15], 0.15),
    (["navigator.takeoff.height", "takeoff.arrived.band"], [0.28, 0.27], 0.27),
    // Twelve of fifteen seconds.
    (["navigator.takeoff.height", "navigator.takeoff.speed"], [1.19, 0.1], 1.21),
    (["takeoff.arrived.time", "takeoff.limit.time"], [1.9, 2.0], 2.0),
    // 0.435 N are six fifths of 0.36 N, and 0.77 of the duty's.
    (["motor.duty.max", "hover.thrust"], [0.85, 0.361], 0.7),
    (["position.tilt.max", "failsafe.tip.tilt"], [0.39, 0.4], 0.4),
    (["position.vel.ti", "attitude.tilt.kp"], [0.25, 2.0], 0.24),
    (["mode.arming.tilt", "failsafe.tip.tilt"], [0.39, 0.4], 0.4),
    (["navigator.heading.rate", "failsafe.rate.max"], [4.0, 5.0], 4.1),
    (["navigator.stick.turn", "failsafe.rate.max"], [4.0, 5.0], 4.1),
    (["failsafe.imu.degraded", "failsafe.imu.lost"], [0.019, 0.02], 0.02),
    (["failsafe.battery.low", "failsafe.battery.critical"], [3.21, 3.2], 3.2),
    (["failsafe.impact.landing", "failsafe.impact.flying"], [40.0, 40.0], 39.0),
    (["failsafe.touch.speed", "landing.descent.speed"], [0.81, 0.8], 0.8),
    (["landing.ceiling.height", "landing.flare.height"], [0.05, 0.05], 0.06),
];

/// The default with these two values, whatever becomes of them together.
fn with(names: [&str; 2], values: [f32; 2]) -> VehicleConfig {
    let mut config = VehicleConfig::default();
    for (name, value) in names.into_iter().zip(values) {
        let index = parameters::all().position(|info| info.name == name).unwrap_or_else(|| panic!("{name}"));
        config.set(index, value).unwrap_or_else(|error| panic!("{name} {value}: {error}"));
    }
    config
}

/// The rule about these two alone.
fn holds(names: [&str; 2], config: &VehicleConfig) -> bool {
    let rule = RULES.iter().find(|rule| rule.conflict.parameters == names).expect("a rule");
    (rule.holds)(config)
}

#[test]
fn every_rule_refuses_beyond_its_border_and_passes_at_it() {
    let of_rules: Vec<_> = RULES.iter().map(|rule| rule.conflict.parameters).collect();
    let of_borders: Vec<_> = BORDERS.iter().map(|(names, ..)| *names).collect();
    assert_eq!(of_rules, of_borders, "a row a rule");
    for &(names, passes, refused) in BORDERS {
        assert!(holds(names, &with(names, passes)), "{names:?} {passes:?} passes");
        assert!(!holds(names, &with(names, [refused, passes[1]])), "{names:?} {refused} is refused");
        // As a console does it: the second value stands, the first is typed.
        let mut config = with(names, passes);
        let before = config.clone();
        match set(&mut config, names[0], refused) {
            Err(ParameterError::Conflict(Conflict { parameters, reason })) => {
                assert!(parameters.contains(&names[0]) && reason.len() > 10, "{names:?}: {parameters:?} {reason}");
            }
            other => panic!("{names:?} {refused}: {other:?}"),
        }
        assert_eq!(config, before, "{names:?}: nothing has changed");
    }
}

#[test]
fn the_refusal_names_both_parameters_and_the_reason() {
    let mut config = VehicleConfig::default();
    set(&mut config, "navigator.height.max", 0.6).expect("above the take-off height");
    let refused = set(&mut config, "navigator.takeoff.height", 0.7).expect_err("above the largest height");
    let text = "navigator.takeoff.height with navigator.height.max: take-off ends above the largest height";
    assert_eq!(refused.to_string(), text);
    // The other one is refused by the same rule.
    assert_eq!(set(&mut config, "navigator.height.max", 0.5), Ok(set_index("navigator.height.max")));
    assert!(set(&mut config, "navigator.takeoff.height", 0.51).is_err());
}

fn set_index(name: &str) -> usize {
    parameters::all().position(|info| info.name == name).expect("a parameter")
}

/// What makes it right to look only at the rules about the parameter that changes.
#[test]
fn a_rule_depends_on_its_two_parameters_and_no_other() {
    for &(names, passes, refused) in BORDERS {
        for (index, info) in parameters::all().enumerate().filter(|(_, info)| !names.contains(&info.name)) {
            for (values, expected) in [(passes, true), ([refused, passes[1]], false)] {
                for value in [info.min, info.max] {
                    let mut config = with(names, values);
                    config.set(index, value).expect("its range");
                    assert_eq!(holds(names, &config), expected, "{names:?} and {} {value}", info.name);
                }
            }
        }
    }
}

#[test]
fn the_default_breaks_no_rule_and_what_was_stored_is_settled_by_defaults() {
    let default = VehicleConfig::default();
    assert_eq!(default.check(None), Ok(()));
    // All borders broken at once.
    let mut stored = default.clone();
    for &(names, passes, refused) in BORDERS {
        for (name, value) in names.into_iter().zip([refused, passes[1]]) {
            stored.set(set_index(name), value).expect("in range");
        }
    }
    stored.set(set_index("eskf.gate"), 3.5).expect("in range");
    let mut told = Vec::new();
    let conflicts = settle(&mut stored, &default, &mut |conflict| told.push(conflict.to_string()));
    assert!(conflicts == told.len() && conflicts >= 8, "{told:#?}");
    assert_eq!((stored.check(None), stored.eskf.gate), (Ok(()), 3.5));
}
