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

/// Prints text on standard error.
pub fn print_error(text: &str) {
    let _ = std::io::stderr().lock().write_all(lines(text).as_bytes());
}

/// The text as a terminal shows it. Names and values of files and of vehicles are in it, and none
/// of them rules the terminal.
fn lines(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for (place, line) in text.split('\n').enumerate() {
        // A string takes everything.
        let _ = write!(shown, "{}{}", if place == 0 { "" } else { "\n" }, plain(line));
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::lines;

    #[test]
    fn a_terminal_gets_lines_and_nothing_that_it_obeys() {
        assert_eq!(lines("a\x1b[2J\nb\r\n\n"), "a\\u001b[2J\nb\\u000d\n\n");
    }
}
