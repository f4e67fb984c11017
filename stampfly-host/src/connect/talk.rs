//! What a vehicle says and does, told to its pages no faster than they can take it: a page that
//! does not keep up with its texts is cut off, and one that is cut off cannot kill.
//!
//! Of too many lines of text the first are told, and how many are left out. Of a parameter that
//! changes too often, and of who commands, the newest is told when there is room.

use super::ONLY;
use super::budget::Budget;
use stampfly_ground::{Event, Hub};
use stampfly_sim::vehicle::Setting;
use stampfly_types::{Duration, Instant};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Lines of text: a start says some dozens at once, and more than twenty a second cannot be read.
const TEXTS: Budget = Budget::new(100, Duration::from_millis(50));
/// Parameters: all of a vehicle at once, within what waits for a page at most.
const PARAMETERS: Budget = Budget::new(256, Duration::from_millis(5));
/// Who commands, and how many lines were left out.
const SELDOM: Budget = Budget::new(4, Duration::from_millis(500));

pub(super) struct Talk {
    hub: Arc<Hub>,
    texts: Budget,
    left_out: u64,
    may_count: Budget,
    parameters: Budget,
    /// Places of parameters that have changed, and pages do not know.
    untold: BTreeSet<usize>,
    commanders: Budget,
    /// Who commands, as pages were told last.
    commander: Option<(String, Option<u64>)>,
}

impl Talk {
    pub fn new(hub: Arc<Hub>) -> Self {
        Self {
            hub,
            texts: TEXTS,
            left_out: 0,
            may_count: SELDOM,
            parameters: PARAMETERS,
            untold: BTreeSet::new(),
            commanders: SELDOM,
            commander: None,
        }
    }

    /// A line that the vehicle says.
    pub fn text(&mut self, now: Instant, text: String) {
        if self.texts.takes(now) {
            self.hub.tell_all(ONLY, &Event::Text { text });
        } else {
            self.left_out += 1;
        }
    }

    /// The parameter in this place has changed.
    pub fn parameter(&mut self, now: Instant, place: usize, settings: &[Setting]) {
        self.untold.insert(place);
        self.tell_parameters(now, settings);
    }

    /// Who commands.
    pub fn commander(&mut self, now: Instant, commander: (String, Option<u64>)) {
        if self.commander.as_ref() != Some(&commander) && self.commanders.takes(now) {
            let (who, page) = commander.clone();
            self.commander = Some(commander);
            self.hub.tell_all(ONLY, &Event::Commander { who, page });
        }
    }

    /// Tells what there was no room for before.
    pub fn poll(&mut self, now: Instant, settings: &[Setting]) {
        self.tell_parameters(now, settings);
        if self.left_out > 0 && self.may_count.takes(now) {
            let text = format!("the vehicle says too much: {} lines are left out", self.left_out);
            self.left_out = 0;
            self.hub.tell_all(ONLY, &Event::Text { text });
        }
    }

    fn tell_parameters(&mut self, now: Instant, settings: &[Setting]) {
        while !self.untold.is_empty() && self.parameters.takes(now) {
            let Some(Setting { name, value, .. }) = self.untold.pop_first().and_then(|place| settings.get(place))
            else {
                continue;
            };
            self.hub.tell_all(ONLY, &Event::Parameter { name: (*name).to_owned(), value: *value });
        }
    }
}
