//! The page holds what the flight has, refers to nothing outside, and is small.

use crate::made_up;
use serde_json::Value;
use stampfly_host::Flight;
use stampfly_host::{Report, report::Metric};
use stampfly_rover::simulation::Rover;
use stampfly_sim::vehicle::Vehicle;
use stampfly_types::{Instant, message, messages::PowerData};

message! {
    /// What every logged topic has beside its message.
    struct Count {
        /// Number of the sample.
        generation: u32,
    }
}

message! {
    /// A vehicle on level ground.
    struct OnGround {
        /// Forward of the start.
        x: f32 ["m"],
        /// Left of the start.
        y: f32 ["m"],
        /// Counter-clockwise.
        yaw: f32 ["rad"],
    }
}

fn page(flight: &Flight) -> String {
    Report {
        title: "A flight".to_owned(),
        subtitle: String::new(),
        metrics: Vec::new(),
        page: &stampfly_board::simulation::PAGE,
        flight,
    }
    .html()
}

/// The data the page's script reads.
fn data(html: &str) -> Value {
    let (_, rest) = html.split_once(r#"<script type="application/json" id="data">"#).unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

fn panels(data: &Value) -> Vec<String> {
    let name = |panel: &Value| format!("{}/{}", panel["group"].as_str().unwrap(), panel["title"].as_str().unwrap());
    data["panels"].as_array().unwrap().iter().map(name).collect()
}

#[test]
fn a_minute_fits_into_three_megabytes_and_needs_nothing_else() {
    let html = page(&made_up::flight());
    assert!(html.len() < 3_000_000, "{} bytes", html.len());
    for outside in ["http:", "https:", "src=", "href=", "@import", "url(", "fetch(", "import("] {
        assert!(!html.contains(outside), "the page refers to the outside: {outside}");
    }
}

#[test]
fn every_panel_is_there_and_every_channel_is_whole() {
    let data = data(&page(&made_up::flight()));
    let expected = [
        "Attitude/Roll",
        "Attitude/Pitch",
        "Attitude/Yaw",
        "Position/North",
        "Position/East",
        "Position/Up",
        "Velocity/North",
        "Velocity/East",
        "Velocity/Up",
        "Actuators/Motor duty",
        "Actuators/Thrust demand",
        "Actuators/Torque demand",
        "Estimator/Innovation, height",
        "Estimator/Innovation, flow",
        "Estimator/Innovation, angles",
        "Estimator/Test ratio",
        "Sensors/Angular rate",
        "Sensors/Specific force",
        "Sensors/Range",
        "Battery/Voltage",
        "Battery/Current",
    ];
    assert_eq!(panels(&data), expected);
    let points = data["points"].as_u64().unwrap();
    assert!((3_000..=6_001).contains(&points));
    let channels = data["channels"].as_array().unwrap();
    for channel in channels {
        let codes = channel["codes"].as_str().unwrap();
        assert_eq!(codes.len() as u64, (2 * points).div_ceil(3) * 4);
    }
    let lines = data["panels"].as_array().unwrap().iter().flat_map(|panel| panel["lines"].as_array().unwrap());
    assert!(lines.map(|line| line["channel"].as_u64().unwrap()).all(|place| place < channels.len() as u64));
    let roles: Vec<_> = data["scene"].as_array().unwrap().iter().map(|actor| actor["role"].as_str().unwrap()).collect();
    assert_eq!(roles, ["estimate", "truth", "setpoint"]);
}

#[test]
fn states_have_names_and_alerts_have_times() {
    let data = data(&page(&made_up::flight()));
    let bands = data["bands"].as_array().unwrap();
    let states: Vec<_> = bands[0]["stretches"].as_array().unwrap().iter().map(|s| s[2].as_str().unwrap()).collect();
    assert_eq!(states, ["Init", "IdleGround", "Armed", "TakeOff", "Flying", "Landing", "IdleGround"]);
    let titles: Vec<_> = bands.iter().map(|band| band["title"].as_str().unwrap()).collect();
    assert_eq!(titles, ["Phase", "Mode", "low battery", "flow lost"]);
    let lost = &bands[3]["stretches"][0];
    assert!(
        (lost[0].as_f64().unwrap() - 31.0).abs() < 0.11 && (lost[1].as_f64().unwrap() - 31.4).abs() < 0.11,
        "{lost}"
    );
    assert_eq!(data["events"].as_array().unwrap().len(), 7);
}

#[test]
fn what_a_flight_does_not_have_is_left_out() {
    let mut flight = Flight::default();
    let empty = data(&page(&flight));
    assert_eq!((panels(&empty).len(), empty["scene"].as_array().unwrap().len()), (0, 0));
    for step in 0..10 {
        let power = PowerData { voltage: 4.0, current: f32::NAN, power: 0.0 };
        flight.push("sensor_power", Instant::from_millis(step * 100), &power);
    }
    assert_eq!(panels(&data(&page(&flight))), ["Battery/Voltage"], "a column without one number is no plot");
}

#[test]
fn a_topic_without_a_place_gets_a_panel_per_unit() {
    let mut flight = Flight::default();
    for step in 0..10 {
        let at = Instant::from_millis(step * 100);
        flight.push("spare_power", at, &PowerData { voltage: 4.0, current: 1.0, power: 4.0 });
        // What a replay needs is no plot.
        flight.push("activation_spare", at, &Count { generation: step as u32 });
        flight.push("spare_count", at, &Count { generation: step as u32 });
    }
    let panels = panels(&data(&page(&flight)));
    assert_eq!(panels, ["Topics/spare power", "Topics/spare power", "Topics/spare power"]);
}

#[test]
fn a_vehicle_in_a_plane_is_in_the_scene() {
    let mut flight = Flight::default();
    for step in 0..10u8 {
        let state = OnGround { x: f32::from(step), y: 1.0, yaw: 0.5 };
        flight.push("vehicle_state", Instant::from_millis(u64::from(step) * 100), &state);
    }
    let report =
        |page| Report { title: String::new(), subtitle: String::new(), metrics: vec![], page, flight: &flight };
    let data = data(&report(&Rover::PAGE).html());
    let rover = &data["scene"][0];
    assert_eq!(rover["role"], "truth");
    assert!(rover["position"].is_array() && rover["attitude"].is_array(), "{rover}");
}

#[test]
fn no_text_can_become_markup() {
    let mut flight = made_up::flight();
    flight.events[0].text = "</script><script>alert(1)".to_owned();
    let metrics = vec![Metric::new("<b>name", "1 < 2", "\"unit\"").judged(false)];
    let html = Report {
        title: "{data} <i>".to_owned(),
        subtitle: "a & b".to_owned(),
        metrics,
        page: &stampfly_board::simulation::PAGE,
        flight: &flight,
    }
    .html();
    assert!(!html.contains("alert(1)</") && html.matches("</script>").count() == 2);
    assert_eq!(data(&html)["events"][0][1], "</script><script>alert(1)");
    assert!(html.contains("<title>{data} &lt;i&gt;</title>") && html.contains("a &amp; b"));
    assert!(html.contains("<tr class=\"failed\"><th scope=\"row\">&lt;b&gt;name</th><td><b>1 &lt; 2</b>"));
}
