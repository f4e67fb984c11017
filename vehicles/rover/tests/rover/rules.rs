//! Combinations of parameters with which the rover cannot do its work are refused with the reason.

use stampfly_param::parameters::validate;
use stampfly_param::{ParameterError, ParameterTable};
use stampfly_rover::Parameters;

/// Rule by rule: a value of each parameter that goes with the other just so, and one of the first that does not.
const BORDERS: [([&str; 2], [f32; 2], f32); 2] = [
    (["input.degraded_speed", "vehicle.max_speed"], [2.0, 2.0], 2.1),
    (["vehicle.wheel_radius", "vehicle.wheelbase"], [0.04, 0.1], 0.05),
];

fn with(names: [&str; 2], values: [f32; 2]) -> Parameters {
    let mut parameters = Parameters::default();
    for (name, value) in names.into_iter().zip(values) {
        let row = Parameters::find(name).expect("a parameter");
        row.set(&mut parameters, value).expect("in range");
    }
    parameters
}

#[test]
fn every_rule_refuses_beyond_its_border_and_passes_at_it() {
    let of_rules: Vec<_> = Parameters::RULES.iter().map(|rule| rule.conflict.parameters).collect();
    assert_eq!(of_rules, BORDERS.map(|(names, ..)| names));
    for (names, passes, refused) in BORDERS {
        assert_eq!(validate(&with(names, passes)), Ok(()), "{names:?}");
        match validate(&with(names, [refused, passes[1]])) {
            Err(ParameterError::Conflict(conflict)) => assert_eq!(conflict.parameters, names),
            other => panic!("{names:?}: {other:?}"),
        }
    }
}
