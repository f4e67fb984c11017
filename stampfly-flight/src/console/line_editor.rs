//! Keystrokes → a line, with the few editing keys of a terminal.
//!
//! For a person at a serial port. A program that sends whole lines needs none.

use core::fmt::Write;
use heapless::String;

const BELL: &str = "\x07";
/// One step back, blank, one step back.
const RUB_OUT: &str = "\x08 \x08";

/// Where the terminal is in the sequence of a special key. All of these are ignored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Escape {
    #[default]
    None,
    /// After ESC.
    Begun,
    /// After ESC [ or ESC O: goes on to the first letter or tilde.
    Sequence,
}

/// Collects keys until return, with backspace, Ctrl-U (erase the line) and Ctrl-C (abandon it).
///
/// Takes printable ASCII and ignores everything else. A line holds at most `N` characters; a key too many rings the bell.
///
/// ```
/// use stampfly_flight::console::LineEditor;
/// let mut editor = LineEditor::<32>::new();
/// let mut screen = String::new();
/// let mut lines = Vec::new();
/// for byte in b"staz\x7ftus\r\n" {
///     lines.extend(editor.feed(*byte, &mut screen).map(|line| line.to_string()));
/// }
/// assert_eq!(lines, ["status"]);
/// ```
#[derive(Clone, Debug, Default)]
pub struct LineEditor<const N: usize> {
    line: String<N>,
    /// The line is finished, and cleared by the next key.
    done: bool,
    escape: Escape,
    /// Was the last byte a carriage return? Then a line feed belongs to it.
    returned: bool,
}

impl<const N: usize> LineEditor<N> {
    /// An empty line.
    #[must_use]
    pub const fn new() -> Self {
        Self { line: String::new(), done: false, escape: Escape::None, returned: false }
    }

    /// Takes a byte and echoes it. Returns the line when it is finished; it stays until the next byte.
    ///
    /// An echo that the terminal does not take is lost.
    pub fn feed(&mut self, byte: u8, echo: &mut impl Write) -> Option<&str> {
        if core::mem::take(&mut self.done) {
            self.line.clear();
        }
        let after_return = core::mem::replace(&mut self.returned, byte == b'\r');
        self.escape = match (self.escape, byte) {
            (_, 0x1B) => Escape::Begun,
            (Escape::Begun, b'[' | b'O') | (Escape::Sequence, ..=b'?') => Escape::Sequence,
            (Escape::None, _) => Escape::None,
            // The sequence ends with this byte, which belongs to it.
            _ => {
                self.escape = Escape::None;
                return None;
            }
        };
        if self.escape != Escape::None {
            return None;
        }
        let _ = match byte {
            b'\n' if after_return => Ok(()),
            b'\r' | b'\n' => {
                let _ = echo.write_str("\r\n");
                self.done = true;
                return Some(&self.line);
            }
            0x08 | 0x7F => match self.line.pop() {
                Some(_) => echo.write_str(RUB_OUT),
                None => echo.write_str(BELL),
            },
            // Ctrl-U.
            0x15 => {
                let result = (0..self.line.len()).try_for_each(|_| echo.write_str(RUB_OUT));
                self.line.clear();
                result
            }
            // Ctrl-C.
            0x03 => {
                self.line.clear();
                let _ = echo.write_str("^C\r\n");
                self.done = true;
                return Some(&self.line);
            }
            b' '..=b'~' => match self.line.push(char::from(byte)) {
                Ok(()) => echo.write_char(char::from(byte)),
                Err(_) => echo.write_str(BELL),
            },
            _ => Ok(()),
        };
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::{String as Screen, ToString};
    use std::vec::Vec;

    fn typed(bytes: &[u8]) -> (Vec<Screen>, Screen) {
        let mut editor = LineEditor::<8>::new();
        let mut screen = Screen::new();
        let lines = bytes.iter().filter_map(|byte| editor.feed(*byte, &mut screen).map(ToString::to_string)).collect();
        (lines, screen)
    }

    #[test]
    fn every_kind_of_return_ends_one_line() {
        assert_eq!(typed(b"a\rb\nc\r\nd\n\re\r").0, ["a", "b", "c", "d", "", "e"]);
        assert_eq!(typed(b"\r\n\r\n").0, ["", ""]);
    }

    #[test]
    fn special_keys_are_ignored() {
        let arrows_home_f5 = b"h\x1b[A\x1b[1;5C\x1bOHe\x1b[15~l\x1bxp\t\x00\xff\xc3\xa9\r";
        assert_eq!(typed(arrows_home_f5).0, ["help"]);
    }

    #[test]
    fn mistakes_can_be_erased() {
        assert_eq!(typed(b"\x08ab\x7fc\r").0, ["ac"]);
        assert_eq!(typed(b"abc\x15de\r").0, ["de"]);
        assert_eq!(typed(b"abc\x03de\r").0, ["", "de"], "an empty line brings the prompt back");
        let (lines, screen) = typed(b"123456789\r");
        assert_eq!(lines, ["12345678"]);
        assert!(screen.contains(BELL));
    }

    proptest! {
        #[test]
        fn a_line_is_always_short_and_printable(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            for line in typed(&bytes).0 {
                prop_assert!(line.len() <= 8 && line.bytes().all(|byte| (b' '..=b'~').contains(&byte)));
            }
        }
    }
}
