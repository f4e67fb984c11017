//! Text from a file, escaped for a terminal.
//!
//! The writer of a log chooses its names and values. Some characters control a terminal: escape
//! sequences change its title or clear it, and others reverse the direction of the text. [`plain`]
//! escapes them. Every program of the flight stack prints text from files with it.

use core::fmt::{Display, Formatter, Result, Write};

/// Return type of [`plain`].
#[derive(Clone, Copy, Debug)]
pub struct Plain<'a>(&'a str);

/// The text with every character that controls a terminal written as `\u001b`, as in JSON.
///
/// ```
/// use stampfly_log::plain;
/// assert_eq!(plain("größe\x1b[2J\n").to_string(), r"größe\u001b[2J\u000a");
/// ```
#[must_use]
pub const fn plain(text: &str) -> Plain<'_> {
    Plain(text)
}

impl Display for Plain<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        self.0.chars().try_for_each(|letter| match is_obeyed(letter) {
            true => write!(f, "\\u{:04x}", u32::from(letter)),
            false => f.write_char(letter),
        })
    }
}

/// Control characters, line separators, and characters that change the direction of text.
fn is_obeyed(letter: char) -> bool {
    letter.is_control()
        || matches!(letter, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn nothing_is_left_that_a_terminal_obeys() {
        for number in 0..0x2100 {
            let Some(letter) = char::from_u32(number) else { continue };
            let shown = plain(&letter.to_string()).to_string();
            assert!(!shown.chars().any(is_obeyed), "{number:x}");
            assert!(shown == letter.to_string() || shown == std::format!("\\u{number:04x}"), "{number:x}");
        }
        assert_eq!(plain("\u{9b}31m\u{202e}").to_string(), r"\u009b31m\u202e");
    }
}
