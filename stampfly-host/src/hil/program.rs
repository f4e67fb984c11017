//! A vehicle's end in a program that speaks over its standard input and output: an emulator with our firmware's code in it.

use super::emulated::Pipe;
use stampfly_sim::vehicle::Port;
use std::io::{self, Read, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::time::Duration;

/// A program that runs as long as this is held.
#[derive(Debug)]
pub struct Program {
    child: Child,
    input: ChildStdin,
    /// What it says, from the thread that reads it.
    said: Pipe,
}

impl Program {
    /// Starts a program. What it says on its standard error is shown.
    ///
    /// # Errors
    /// When it cannot be started.
    pub fn start(line: &str) -> io::Result<Self> {
        let mut words = line.split_whitespace();
        let name = words.next().ok_or(io::ErrorKind::InvalidInput)?;
        let mut child = Command::new(name).args(words).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let taken = child.stdin.take().zip(child.stdout.take());
        let (input, mut output) = taken.ok_or(io::ErrorKind::BrokenPipe)?;
        let [said, mut hand_on] = Pipe::pair();
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            // When the program has ended, or nobody listens any more.
            while let Ok(count @ 1..) = output.read(&mut buffer) {
                if hand_on.send(&buffer[..count]).is_err() {
                    break;
                }
            }
        });
        Ok(Self { child, input, said })
    }
}

impl Port for Program {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.input.write_all(bytes)?;
        self.input.flush()
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        self.said.receive(buffer, patience)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended by itself.
        _ = self.child.kill();
        _ = self.child.wait();
    }
}
