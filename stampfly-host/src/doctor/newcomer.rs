//! Somebody at a terminal: is told what to do, and asked what he sees.

use super::console::{self, Port};
use super::visit::{Act, Lost, Question, Visit};
use std::io::{BufRead, Write};
use std::time::{Duration, Instant};

/// A vehicle behind a port, and somebody who reads `screen` and types into `keys`.
pub struct Newcomer<P, K, S> {
    /// Opens the port again: a vehicle that is switched off loses its own.
    pub connect: fn(&str) -> Result<P, Lost>,
    /// The port's name.
    pub path: String,
    /// The port, once it is open.
    pub port: Option<P>,
    /// Where he types.
    pub keys: K,
    /// Where he reads.
    pub screen: S,
    /// When the examination began.
    pub begun: Instant,
    /// Everything so far.
    pub transcript: String,
}

impl<P: Port, K: BufRead, S: Write> Newcomer<P, K, S> {
    fn say(&mut self, text: &str) {
        self.transcript += &format!("{text}\n");
        // A screen that is gone shows nothing.
        let _ = writeln!(self.screen, "{text}").and_then(|()| self.screen.flush());
    }

    /// The next line that is typed; empty at the end of what there is.
    fn typed(&mut self) -> String {
        let mut line = String::new();
        let _ = self.keys.read_line(&mut line);
        let line = line.trim().to_lowercase();
        self.transcript += &format!("< {line}\n");
        line
    }
}

impl<P: Port, K: BufRead, S: Write> Visit for Newcomer<P, K, S> {
    fn ask(&mut self, line: &str) -> Result<String, Lost> {
        self.transcript += &format!("> {line}\n");
        if self.port.is_none() {
            self.port = Some((self.connect)(&self.path)?);
        }
        let port = self.port.as_mut().ok_or_else(|| Lost(self.path.clone()))?;
        let answer = console::ask(port, line)?;
        self.transcript += &answer.replace('\r', "");
        Ok(answer)
    }

    fn elapsed(&self) -> Duration {
        self.begun.elapsed()
    }

    fn wait(&mut self, time: Duration) {
        std::thread::sleep(time);
    }

    fn please(&mut self, act: Act) {
        let when = if act.moving().is_some() { "Press Enter, and begin." } else { "Then press Enter." };
        self.say(&format!("\n{act}\n{when}"));
        self.typed();
    }

    fn question(&mut self, question: Question) -> usize {
        let choices = question.choices();
        let listed: Vec<_> = choices.iter().enumerate().map(|(place, choice)| format!("{place} {choice}")).collect();
        self.say(&format!("\n{question} ({})", listed.join(", ")));
        // Asked three times; who types something else has seen nothing that can be named.
        for _ in 0..3 {
            let line = self.typed();
            let place = choices.iter().position(|choice| !line.is_empty() && choice.starts_with(line.as_str()));
            if let Some(place) = line.parse().ok().filter(|place| *place < choices.len()).or(place) {
                return place;
            }
            self.say("Please type the number.");
        }
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Echo(String);

    impl Port for Echo {
        fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
            self.0 = format!("{}\nhere\r\n> ", String::from_utf8_lossy(bytes));
            Ok(())
        }
        fn receive(&mut self) -> std::io::Result<String> {
            Ok(std::mem::take(&mut self.0))
        }
    }

    #[test]
    fn he_is_asked_until_he_answers_and_all_of_it_is_kept() {
        let mut screen = Vec::new();
        let mut newcomer = Newcomer {
            connect: |_| Ok(Echo(String::new())),
            path: "port".into(),
            port: None,
            keys: &b"\nleft\nrear r\n1\n"[..],
            screen: &mut screen,
            begun: Instant::now(),
            transcript: String::new(),
        };
        newcomer.please(Act::NoseUp);
        assert_eq!(newcomer.question(Question::Motor), 2, "rear right");
        assert_eq!(newcomer.question(Question::Light), 1);
        assert_eq!(newcomer.question(Question::Notes), 0, "nothing more is typed");
        assert_eq!(newcomer.ask("status").ok().as_deref(), Some("here\r\n"));
        for part in ["nose straight up", "< left", "Please type the number", "> status\nhere\n"] {
            assert!(newcomer.transcript.contains(part), "{part} is missing:\n{}", newcomer.transcript);
        }
        assert!(!screen.is_empty());
    }
}
