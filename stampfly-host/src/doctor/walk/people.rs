//! What somebody sees, hears and touches: light, buzzer, motors, button, transmitter.

use super::Examination;
use crate::doctor::reading::newest;
use crate::doctor::visit::{Act, Lost, Question, Stick, Visit};
use stampfly_flight::doctor::Verdict;
use std::time::Duration;

/// Share of the duty at which a motor is tried, per cent.
const PERCENT: u32 = 15;
/// From the command until it turns, and from its stop until it is still.
const SPINS_UP: Duration = Duration::from_millis(700);
const STOPS: Duration = Duration::from_millis(600);
/// Which way each motor turns, as in [`Question::Direction`].
const DIRECTIONS: [usize; 4] = [1, 0, 1, 0];
/// From the release of the button to the decision what it meant, with a margin.
const CLICKED: Duration = Duration::from_secs(2);
/// From switching the transmitter on until it is heard.
const HEARD: Duration = Duration::from_secs(2);
/// Frames come fifty times a second; older than this there are none, ms.
const SILENT: u64 = 500;
/// A stick at its end gives at least this.
const PUSHED: f64 = 0.4;

impl<V: Visit> Examination<'_, V> {
    /// At power-on.
    pub(super) fn look_and_listen(&mut self) {
        if self.visit.question(Question::Light) == 1 {
            self.chart.pass("status light", "lit");
        } else {
            let advice =
                "v1.1 needs GPIO38 high, which this firmware sets; v1.0 needs nothing: its solder, or the light";
            self.chart.note("light-dark", Verdict::Fail, "dark", advice);
        }
        if self.visit.question(Question::Notes) == 1 {
            self.chart.pass("buzzer", "notes");
        } else {
            self.chart.note("buzzer-silent", Verdict::Fail, "no notes", "its solder, or the buzzer");
        }
    }

    /// Each motor alone.
    pub(super) fn motors(&mut self) -> Result<(), Lost> {
        let mut turned = [0; 4];
        for (place, turned) in turned.iter_mut().enumerate() {
            self.visit.ask(&format!("motor test {} {PERCENT}", place + 1))?;
            self.visit.wait(SPINS_UP);
            *turned = self.visit.question(Question::Motor);
            if *turned > 0 && self.visit.question(Question::Direction(*turned)) != DIRECTIONS[*turned - 1] {
                let advice = "turn its plug round: with its propeller it would push down";
                self.chart.note(&format!("motor-{turned}-reversed"), Verdict::Fail, "it turns the other way", advice);
            }
            self.visit.ask("motor stop")?;
            self.visit.wait(STOPS);
        }
        for (place, turned_then) in turned.iter().enumerate() {
            let asked = place + 1;
            match *turned_then {
                0 => {
                    let advice = "its plug, its transistor, or the motor";
                    self.chart.note(&format!("motor-{asked}-dead"), Verdict::Fail, "it does not turn", advice);
                }
                other if other != asked => {
                    let (low, high) = (asked.min(other), asked.max(other));
                    let seen = format!("{other} turned instead of {asked}");
                    let name = format!("motors-{low}-{high}-swapped");
                    self.chart.note(&name, Verdict::Fail, seen, "exchange their plugs: it would flip at take-off");
                }
                _ => {}
            }
        }
        if turned == [1, 2, 3, 4] && !self.chart.findings().any(|row| row.name.starts_with("motor")) {
            self.chart.pass("motors", "each turns, the right way");
        }
        Ok(())
    }

    /// The button's contact, let go, held, let go.
    pub(super) fn button(&mut self) -> Result<(), Lost> {
        let pressed = |visit: &mut V| newest(visit, "button_contact").map(|reading| reading.is("pressed"));
        if pressed(self.visit)? {
            let advice = "it is jammed: with motors armed any press stops them";
            self.chart.note("button-stuck", Verdict::Fail, "pressed, and nobody presses it", advice);
            return Ok(());
        }
        self.visit.please(Act::HoldButton);
        let held = pressed(self.visit)?;
        self.visit.please(Act::ReleaseButton);
        // Only then is it known that this was one click. It arms a vehicle that hears a transmitter by then.
        self.visit.wait(CLICKED);
        match (held, pressed(self.visit)?) {
            (true, false) => self.chart.pass("button", "pressed and let go"),
            (true, true) => {
                self.chart.note("button-stuck", Verdict::Fail, "still pressed when it was let go", "it is jammed");
            }
            _ => {
                let advice = "do not fly without it: it is the way to stop the motors on the ground";
                self.chart.note("button-dead", Verdict::Fail, "not pressed while it was held", advice);
            }
        }
        Ok(())
    }

    /// Every stick by itself.
    pub(super) fn transmitter(&mut self) -> Result<(), Lost> {
        self.visit.please(Act::SwitchOn);
        self.visit.wait(HEARD);
        if newest(self.visit, "flight_status")?.is("armed") {
            let advice = "nobody asked for it: switch the transmitter off and unplug the battery";
            self.chart.note("armed", Verdict::Fail, "it has armed", advice);
            return Ok(());
        }
        let frame = newest(self.visit, "command_pilot")?;
        if frame.age.is_none_or(|age| age > SILENT) {
            let advice = "is it the ecosystem's firmware, and paired? Type pair at the console, or hold the button for \
                          three seconds, and pair it; it speaks on channel 1";
            self.chart.note("transmitter-silent", Verdict::Fail, "never heard, or no more", advice);
            return Ok(());
        }
        let mut found = Vec::new();
        for stick in Stick::ALL {
            self.visit.please(Act::Push(stick));
            let frame = newest(self.visit, "command_pilot")?;
            self.visit.please(Act::Centre);
            let values = Stick::ALL.map(|field| (field, frame.number(field.name()).unwrap_or_default()));
            let largest = values.into_iter().max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()));
            found.push((stick, largest.filter(|(_, value)| value.abs() >= PUSHED)));
        }
        for (stick, moved) in &found {
            let name = stick.name();
            match moved {
                Some((field, value)) if field == stick && *value > 0.0 => {}
                Some((field, value)) if field == stick => {
                    let advice = "do not fly: the vehicle would go the other way";
                    let seen = format!("{value:+.2}");
                    self.chart.note(&format!("stick-{name}-reversed"), Verdict::Fail, seen, advice);
                }
                Some((field, value)) => {
                    let seen = format!("{name} moved {} {value:+.2}", field.name());
                    let advice = "another stick mode is chosen at the transmitter";
                    self.chart.note("sticks-swapped", Verdict::Fail, seen, advice);
                }
                None => {
                    let seen = "nothing moved";
                    self.chart.note(&format!("stick-{name}-dead"), Verdict::Fail, seen, "was it pushed to its end?");
                }
            }
        }
        if !self.chart.findings().any(|row| row.name.starts_with("stick")) {
            self.chart.pass("transmitter", "heard, every stick as it should be");
        }
        Ok(())
    }
}
