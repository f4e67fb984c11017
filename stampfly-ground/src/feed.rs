//! The stream of state that one page has subscribed to, as JSON texts.
//!
//! A text holds every vehicle, and of it the subscribed topics that have a new sample since the last text:
//!
//! ```json
//! {"now":81542.1,"state":[[0,12.34,[15,4936,12.3375,1.0,0.0,0.0,0.0]]],"dropped":0}
//! ```
//!
//! The server's clock in ms, which a page counts on to say [when](crate::ask::Asked::at) it asks something. Of each vehicle its number, its clock in s, then per topic its place in the card, how many samples it has had, the newest one's instant in s and
//! its numbers in the order of the card's fields. What is no number is `null`; truth values, names and flags are numbers.

use crate::card::TopicCard;
use crate::hub::Hub;
use crate::newest::Newest;
use stampfly_types::schema::Value;
use std::fmt::Write;
use std::sync::Arc;
use std::time::Duration;

/// What a page wants to be told, and what it has been told.
#[derive(Debug)]
pub struct Feed {
    hub: Arc<Hub>,
    topics: Vec<String>,
    /// Of each vehicle: topic and number of its last sample that was told.
    told: Vec<Vec<(usize, u64)>>,
    words: Vec<u32>,
    /// Texts left out because the page did not keep up.
    pub dropped: u64,
}

impl Feed {
    /// No topic yet: only clocks.
    pub fn new(hub: Arc<Hub>) -> Self {
        Self { hub, topics: Vec::new(), told: Vec::new(), words: Vec::new(), dropped: 0 }
    }

    /// From now on these topics. Names that a vehicle does not have are nothing to it.
    pub fn subscribe(&mut self, topics: Vec<String>) {
        self.topics = topics;
        let wanted = |topic: &TopicCard| self.topics.iter().any(|name| name == topic.name);
        let of_vehicle = |topics: &[TopicCard]| {
            topics.iter().enumerate().filter(|(_, topic)| wanted(topic)).map(|(place, _)| (place, 0)).collect()
        };
        self.told = self.hub.samples().map(|(_, topics)| of_vehicle(topics)).collect();
    }

    /// What is new, at this time of the server's clock.
    pub fn text(&mut self, now: Duration) -> String {
        let mut text = String::with_capacity(4096);
        put(&mut text, format_args!("{{\"now\":{:.1},\"state\":[", now.as_secs_f64() * 1e3));
        self.told.resize(self.hub.vehicles(), Vec::new());
        for (vehicle, ((newest, topics), told)) in self.hub.samples().zip(&mut self.told).enumerate() {
            if vehicle > 0 {
                text.push(',');
            }
            put(&mut text, format_args!("[{vehicle},{:.4}", newest.clock().seconds_f64()));
            told.iter_mut().for_each(|topic| sample(&mut text, newest, topics, topic, &mut self.words));
            text.push(']');
        }
        put(&mut text, format_args!("],\"dropped\":{}}}", self.dropped));
        text
    }
}

fn sample(text: &mut String, newest: &Newest, topics: &[TopicCard], told: &mut (usize, u64), words: &mut Vec<u32>) {
    let (place, count) = told;
    let Some((topic, (at, number))) = topics.get(*place).zip(newest.after(*place, *count, words)) else { return };
    *count = number;
    put(text, format_args!(",[{place},{number},{:.6}", at.seconds_f64()));
    for value in topic.numbers(words) {
        text.push(',');
        match value {
            Value::F32(value) if !value.is_finite() => text.push_str("null"),
            Value::F64(value) if !value.is_finite() => text.push_str("null"),
            Value::F32(value) => put(text, format_args!("{value}")),
            Value::F64(value) => put(text, format_args!("{value}")),
            Value::Unsigned(value) => put(text, format_args!("{value}")),
            Value::Signed(value) => put(text, format_args!("{value}")),
            Value::Bool(value) => put(text, format_args!("{}", u8::from(value))),
            Value::Enum { number, .. } => put(text, format_args!("{number}")),
            Value::Flags { bits, .. } => put(text, format_args!("{bits}")),
        }
    }
    text.push(']');
}

/// Text in memory takes everything.
fn put(text: &mut String, what: std::fmt::Arguments<'_>) {
    let _ = text.write_fmt(what);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::card::VehicleCard;
    use stampfly_board::simulation::StampFly;
    use stampfly_board::topics::Id;
    use stampfly_sim::vehicle::Vehicle;
    use stampfly_types::messages::{FlightPhase, FlightStatus, StateEstimate};
    use stampfly_types::{Instant, Message};

    #[test]
    fn a_text_holds_what_is_subscribed_and_new() {
        let card = |name| VehicleCard::of::<StampFly>(name, &StampFly::default_config());
        let hub = Hub::new(vec![card("one"), card("two")]);
        let watch = hub.witness(1).expect("a vehicle");
        let status = FlightStatus { phase: FlightPhase::Flying, armed: true, ..Default::default() };
        watch.note(Id::flight_status as usize, Instant::from_millis(1500), &status.to_words());
        watch.note(Id::estimate_state as usize, Instant::from_millis(1500), &StateEstimate::default().to_words());

        let mut feed = Feed::new(hub);
        assert_eq!(feed.text(Duration::ZERO), r#"{"now":0.0,"state":[[0,0.0000],[1,1.5000]],"dropped":0}"#);
        feed.subscribe(vec!["flight_status".into(), "nonsense".into()]);
        let place = Id::flight_status as usize;
        let expected = format!(
            r#"{{"now":20.5,"state":[[0,0.0000],[1,1.5000,[{place},1,1.500000,5,1,1,0,0,0,0,0,0]]],"dropped":0}}"#
        );
        assert_eq!(feed.text(Duration::from_micros(20_500)), expected);
        assert_eq!(
            feed.text(Duration::from_millis(40)),
            r#"{"now":40.0,"state":[[0,0.0000],[1,1.5000]],"dropped":0}"#,
            "nothing twice"
        );
    }

    #[test]
    fn what_is_no_number_is_null() {
        let hub = Hub::new(vec![VehicleCard::of::<StampFly>("one", &StampFly::default_config())]);
        let estimate = StateEstimate { height: f32::NAN, position_std_xy: f32::INFINITY, ..Default::default() };
        let watch = hub.witness(0).expect("a vehicle");
        watch.note(Id::estimate_state as usize, Instant::from_millis(1), &estimate.to_words());
        let mut feed = Feed::new(hub);
        feed.subscribe(vec!["estimate_state".into()]);
        let text = feed.text(Duration::ZERO);
        assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok() && text.contains("null,null"), "{text}");
    }
}
