//! Which step may start next: the first one in the order of the table whose predecessors have ended and whose parts of the machine
//! are free.

use crate::step::{Holds, Step};

/// The steps that have not ended.
pub struct Queue<'s> {
    waiting: Vec<&'s Step>,
    running: Vec<&'s Step>,
}

/// The next action of a job.
pub enum Next<'s> {
    /// Runs this step.
    Start(&'s Step),
    /// Waits until another step has ended.
    Wait,
    /// Ends: no step is left to start.
    Finished,
}

impl<'s> Queue<'s> {
    pub fn new(steps: Vec<&'s Step>) -> Self {
        Self { waiting: steps, running: Vec::new() }
    }

    /// Takes the next step that may start.
    pub fn next(&mut self) -> Next<'s> {
        if let Some(place) = self.waiting.iter().position(|step| self.may_start(step)) {
            let step = self.waiting.remove(place);
            self.running.push(step);
            return Next::Start(step);
        }
        if self.waiting.is_empty() { Next::Finished } else { Next::Wait }
    }

    /// A step has ended, whatever came of it: what waits for it runs all the same and says itself what it misses.
    pub fn ended(&mut self, step: &Step) {
        self.running.retain(|running| running.name != step.name);
    }

    fn may_start(&self, step: &Step) -> bool {
        let unfinished = |name: &str| self.waiting.iter().chain(&self.running).any(|other| other.name == name);
        let holds_machine = |step: &Step| step.holds.contains(&Holds::Machine);
        let collides = |other: &&Step| {
            holds_machine(step) || holds_machine(other) || step.holds.iter().any(|held| other.holds.contains(held))
        };
        !step.after.iter().any(|name| unfinished(name)) && !self.running.iter().any(collides)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn step(name: &'static str, holds: &'static [Holds], after: &'static [&'static str]) -> Step {
        Step::ci(name, "", |_, _| Ok(())).holding(holds).after(after)
    }

    const CLIPPY: Step = step("clippy", &[Holds::Debug], &[]);
    const TEST: Step = step("test", &[Holds::Debug], &[]);
    const PROGRAM: Step = step("program", &[Holds::Release], &[]);
    const CLIENTS: Step = step("clients", &[], &["program"]);
    const SPEED: Step = step("speed", &[Holds::Machine], &[]);

    fn started<'s>(queue: &mut Queue<'s>) -> Option<&'static str> {
        match queue.next() {
            Next::Start(step) => Some(step.name),
            Next::Wait => None,
            Next::Finished => Some("finished"),
        }
    }

    #[test]
    fn steps_that_build_in_one_folder_take_turns() {
        let mut queue = Queue::new(vec![&CLIPPY, &TEST, &PROGRAM]);
        assert_eq!([started(&mut queue), started(&mut queue)], [Some("clippy"), Some("program")]);
        assert_eq!(started(&mut queue), None);
        queue.ended(&CLIPPY);
        assert_eq!([started(&mut queue), started(&mut queue)], [Some("test"), Some("finished")]);
    }

    #[test]
    fn a_step_waits_for_what_it_uses_and_for_nothing_that_is_left_out() {
        let mut queue = Queue::new(vec![&CLIENTS, &PROGRAM]);
        assert_eq!([started(&mut queue), started(&mut queue)], [Some("program"), None]);
        queue.ended(&PROGRAM);
        assert_eq!(started(&mut queue), Some("clients"));
        assert_eq!(started(&mut Queue::new(vec![&CLIENTS])), Some("clients"));
    }

    #[test]
    fn a_step_that_measures_time_runs_alone() {
        let mut queue = Queue::new(vec![&CLIENTS, &SPEED]);
        assert_eq!([started(&mut queue), started(&mut queue)], [Some("clients"), None]);
        queue.ended(&CLIENTS);
        assert_eq!(started(&mut queue), Some("speed"));
        let mut queue = Queue::new(vec![&SPEED, &CLIENTS]);
        assert_eq!([started(&mut queue), started(&mut queue)], [Some("speed"), None]);
    }
}
