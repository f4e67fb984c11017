//! Commands to a vehicle on the secure link, and the questions of pages that they answer.
//!
//! [`Commands`] says them until they are acknowledged; this remembers who asked. A kill takes the place of a kill, and then answers both. No socket, no clock,
//! no key.

use super::questions::remember;
use stampfly_link::secure::{Commands, Payload};
use stampfly_types::Instant;
use stampfly_types::messages::{GuidedCommand, GuidedKind};
use std::collections::VecDeque;

/// Commands on their way to one vehicle.
#[derive(Debug, Default)]
pub(super) struct Orders {
    commands: Commands,
    /// Numbers of commands and of the questions that they are.
    asked: VecDeque<(u32, u16)>,
    /// The same of commands that are not said any more: the vehicle says whether one was done when
    /// that is seen, or a second and a half later why not.
    over: VecDeque<(u32, u16)>,
    /// The number of the kill that is being said.
    kill: Option<u32>,
    /// The number of the command that was refused last: a vehicle says that more than once.
    refused: Option<u32>,
}

impl Orders {
    /// Takes a command that was asked for then. `false` when there is no room.
    pub fn say(
        &mut self,
        now: Instant,
        asked: Instant,
        (number, question): (u32, u16),
        command: GuidedCommand,
    ) -> bool {
        // Before anything is said: what is over takes its room.
        self.forget(now);
        if !self.commands.say_since(now, asked, number, command) {
            return false;
        }
        if command.kind == GuidedKind::Kill
            && let Some(before) = self.kill.replace(number)
        {
            for (asked, _) in self.asked.iter_mut().filter(|(asked, _)| *asked == before) {
                *asked = number;
            }
        }
        remember(&mut self.asked, (number, question));
        true
    }

    /// What is to be sent now. Call it every 20 ms.
    pub fn next(&mut self, now: Instant) -> Option<Payload<'static>> {
        let next = self.commands.next(now);
        self.forget(now);
        next
    }

    /// Somebody has killed the vehicle otherwise than with a command.
    pub fn end(&mut self, now: Instant) {
        self.commands.end(now);
    }

    /// The questions that this acknowledgement answers.
    pub fn acknowledge(&mut self, number: u32, taken: bool) -> Vec<u16> {
        match self.commands.acknowledge(number, taken) {
            true => self.take(number),
            false if taken => self.take_over(number),
            // It is said again, or has been given up.
            false => Vec::new(),
        }
    }

    /// The questions that this refusal answers: the vehicle does not do what is asked, and says why.
    pub fn refuse(&mut self, number: u32) -> Vec<u16> {
        let questions = if self.commands.refuse(number) { self.take(number) } else { self.take_over(number) };
        if !questions.is_empty() {
            self.refused = Some(number);
        }
        questions
    }

    /// Is this the command that was refused last?
    pub fn was_refused(&self, number: u32) -> bool {
        self.refused == Some(number)
    }

    /// What is not said any more may still be answered. A station knows by itself what was not.
    fn forget(&mut self, now: Instant) {
        while let Some(over) = self.commands.over(now) {
            for question in self.take(over) {
                remember(&mut self.over, (over, question));
            }
        }
    }

    fn take_over(&mut self, command: u32) -> Vec<u16> {
        let questions = self.over.iter().filter(|(asked, _)| *asked == command).map(|(_, question)| *question);
        let questions = questions.collect();
        self.over.retain(|(asked, _)| *asked != command);
        questions
    }

    /// Takes the questions of a command that is done with.
    fn take(&mut self, command: u32) -> Vec<u16> {
        self.kill = self.kill.filter(|kill| *kill != command);
        let questions = self.asked.iter().filter(|(asked, _)| *asked == command).map(|(_, question)| *question);
        let questions = questions.collect();
        self.asked.retain(|(asked, _)| *asked != command);
        questions
    }
}
