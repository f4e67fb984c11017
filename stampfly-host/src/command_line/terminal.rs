//! The terminal: text on standard output, progress on standard error where somebody is looking.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use stampfly_log::plain;
use std::fmt::Write as _;
use std::io::Write;

/// A bar of `steps` steps.
pub fn bar(steps: u64, template: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr_with_hz(20));
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("━╸ "));
    }
    bar
}

/// Prints text. A reader that has seen enough (`| head`) is no error.
pub fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(lines(text).as_bytes()).and_then(|()| out.flush());
}

/// Standard output, for those who write pieces of text.
pub struct Screen;

impl Write for Screen {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        print(&String::from_utf8_lossy(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Prints text on standard error.
pub fn print_error(text: &str) {
    let _ = std::io::stderr().lock().write_all(lines(text).as_bytes());
}

/// The text as a terminal shows it. Names and values of files and of vehicles are in it, and none
/// of them rules the terminal.
fn lines(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for (place, line) in text.split('\n').enumerate() {
        // Lines of vehicles end with both. A string takes everything.
        let line = line.strip_suffix('\r').unwrap_or(line);
        let _ = write!(shown, "{}{}", if place == 0 { "" } else { "\n" }, plain(line));
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::lines;

    #[test]
    fn a_terminal_gets_lines_and_nothing_that_it_obeys() {
        assert_eq!(lines("a\x1b[2J\nb\rc\r\n\n"), "a\\u001b[2J\nb\\u000dc\n\n");
    }
}
