//! Scenarios: rejected texts, and instants of commands and checks.

use proptest::prelude::*;
use stampfly_sim::vehicle::Scenario;
use stampfly_types::messages::{FlightStatus, PowerData};

/// Commands a voltage and checks a mode.
fn parse(text: &str) -> Result<Scenario<PowerData, FlightStatus>, String> {
    Scenario::parse(text, |power| (0.0..=5.0).contains(&power.voltage))
}

#[test]
fn values_stay_until_they_are_changed_and_act_after_their_time() {
    let scenario = parse("# comment\n1 voltage 4 current 0.5 # more\n\n2 current 1\n3 end\n").expect("a scenario");
    let at = |time: f32| (scenario.command(time).voltage, scenario.command(time).current);
    assert_eq!([at(0.5), at(1.0), at(1.01), at(2.5)], [(0.0, 0.0), (0.0, 0.0), (4.0, 0.5), (4.0, 1.0)]);
    assert_eq!(scenario.end(), 3.0);
}

#[test]
fn checks_are_made_on_the_first_line_at_or_after_their_time() {
    let armed = |armed| FlightStatus { armed, ..FlightStatus::default() };
    let log = [(0.0, armed(false)), (1.0, armed(true)), (2.0, armed(false))];
    for (text, failures) in [
        ("0.5 check armed == 1\n1 check armed > 0.5\n1.1 check armed < 1\n2 check phase == Init\n3 end", vec![]),
        ("1 check armed == 0\n2 check armed >= 1\n2.5 end", vec!["1 s: armed == 0", "2 s: armed >= 1"]),
        ("2.1 check armed <= 1\n3 end", vec!["2.1 s: armed <= 1"]),
    ] {
        assert_eq!(parse(text).expect("a scenario").failures(log.into_iter()), failures, "{text}");
    }
}

#[test]
fn mistakes_are_named_with_their_line() {
    for (text, error) in [
        ("0 voltage", "line 1: 'voltage' is no command"),
        ("0 voltage 6\n1 end", "line 1: 'voltage 6' is no command"),
        ("0 gear 2\n1 end", "line 1: 'gear 2' is no command"),
        ("0\n1 end", "line 1: '' is no command"),
        ("1 voltage 1\n0 end", "line 2: times ascend, and nothing comes after the end"),
        ("0 end\n1 voltage 1", "line 2: times ascend, and nothing comes after the end"),
        ("nan voltage 1", "line 1: times ascend, and nothing comes after the end"),
        ("soon voltage 1", "line 1: 'soon' is no time"),
        ("0 voltage 1", "the scenario has no end"),
        ("0 check armed 3", "line 1: 'check armed 3' is none: field, comparison, value"),
        ("0 check armour == 3", "line 1: 'check armour == 3' is none: field, comparison, value"),
        ("0 check armed = 3", "line 1: 'check armed = 3' is none: field, comparison, value"),
        ("0 check phase == Nowhere", "line 1: 'check phase == Nowhere' is none: field, comparison, value"),
    ] {
        assert_eq!(parse(text).expect_err(text), error);
    }
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused(text in "[a-z0-9 .#=<>\\n-]{0,200}") {
        let _ = parse(&text);
    }
}
