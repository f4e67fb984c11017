//! What the ground station's page asks of a vehicle.

use super::seats::{Controls, Seats};
use super::services::{Services, obey};
use crate::simulation::faults::FAULTS;
use crate::simulation::terminal::Terminal;
use stampfly_flight::parameters;
use stampfly_services::{Cockpit as _, Refusal, Request, Seat};
use stampfly_sim::ask::{Ask, Guided, Reply};
use stampfly_sim::fault::{Fault, When};
use stampfly_types::Instant;
use std::string::{String, ToString};

impl Services<'_> {
    /// Does what a page asks for.
    pub(super) fn page(&mut self, now: Instant, ask: &Ask) -> Result<Reply, String> {
        let seen = self.seen;
        let newest = seen.newest.borrow();
        let mut cockpit = Seats { controls: &mut self.controls, newest: &newest, seen };
        cockpit.alive(now, Seat::Page);
        let said = |result: Result<(), Refusal>| match result {
            Ok(()) => Ok(Reply::text("")),
            Err(refusal) => Err(refusal.to_string()),
        };
        match ask {
            // A click on the map says where to be, not where to be after everything else.
            Ask::Guided(go_to @ Guided::GoTo { .. }) => said(cockpit.fly_to(now, Seat::Page, (*go_to).into())),
            Ask::Guided(guided) => said(cockpit.guide(now, Seat::Page, (*guided).into())),
            Ask::Sticks(sticks) => said(cockpit.steer(now, Seat::Page, &(*sticks).into())),
            Ask::MotorTest { motor, duty } => {
                said(cockpit.request(now, Request::TestMotor { motor: *motor, duty: *duty }))
            }
            Ask::MotorStop {} => said(cockpit.request(now, Request::StopMotor)),
            Ask::ParamGet { name } => {
                let config = cockpit.parameters();
                let value = parameters::find(config, name).ok().and_then(|index| config.get(index));
                value.map(|value| Reply::value(value.into())).ok_or_else(|| "there is no such parameter".into())
            }
            Ask::ParamSet { name, value } => {
                if cockpit.view().state().armed {
                    return Err(Refusal::Armed.to_string());
                }
                match parameters::set(cockpit.parameters(), name, *value) {
                    Ok(_) => Ok(Reply::value((*value).into())),
                    Err(error) => Err(error.to_string()),
                }
            }
            Ask::Console { line } => {
                let desk = self.desk(&newest);
                let mut terminal = Terminal::new();
                let Controls { config, console, .. } = &mut self.controls;
                let keys = std::format!("{line}\r");
                let board = |request: &_, config: &_| obey(request, seen, config);
                terminal.send(now, keys.as_bytes(), &desk, (config, console), board);
                // Without the echo and the prompt.
                let screen = terminal.screen.strip_prefix(line.as_str()).unwrap_or(&terminal.screen);
                Ok(Reply::text(screen.trim_end_matches("> ").trim()))
            }
            Ask::Fault { text } => self.break_something(now, text),
            Ask::FaultClear {} => {
                (0..self.faults.faults().count()).for_each(|place| self.faults.end(place, now));
                Ok(Reply::text(""))
            }
            Ask::Speed { factor } => {
                let speed = self.speed.as_ref().ok_or("time is somebody else's here")?;
                speed.set(*factor);
                Ok(Reply::value((*factor).into()))
            }
            Ask::Alive {} => Ok(Reply::default()),
            Ask::ParamSave {} => said(cockpit.request(now, Request::SaveParameters)),
        }
    }

    fn break_something(&self, now: Instant, text: &str) -> Result<Reply, String> {
        let fault = Fault::parse(text, FAULTS).map_err(|error| error.to_string())?;
        let same = |other: &Fault| other.kind == fault.kind && other.value == fault.value;
        let place = self.faults.faults().position(same).ok_or("in flight, only with its usual value")?;
        match fault.when {
            // A moment of the flight may have passed, a time that has is now.
            When::Moment(_) => return Err("in flight, only now: @0".into()),
            When::After(_) => self.faults.begin(place, now, fault.lasts),
        }
        Ok(Reply::text(text))
    }
}
