//! Text that is written into bytes.

use core::fmt::{self, Write};

struct Text<'b> {
    out: &'b mut [u8],
    length: usize,
}

impl Write for Text<'_> {
    fn write_str(&mut self, part: &str) -> fmt::Result {
        let end = self.length + part.len();
        self.out.get_mut(self.length..end).ok_or(fmt::Error)?.copy_from_slice(part.as_bytes());
        self.length = end;
        Ok(())
    }
}

/// Writes what is displayed and returns how long it is; `None` when `out` is too short.
pub fn write(displayed: &impl fmt::Display, out: &mut [u8]) -> Option<usize> {
    let mut text = Text { out, length: 0 };
    write!(text, "{displayed}").ok()?;
    Some(text.length)
}

/// A number with two places; what is none is zero.
pub struct Hundredths(pub f32);

impl fmt::Display for Hundredths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = whole(self.0 * 100.0);
        let (sign, all) = (if all < 0 { "-" } else { "" }, all.unsigned_abs());
        write!(f, "{sign}{}.{:02}", all / 100, all % 100)
    }
}

/// Rounded; at the limit when it does not fit, and zero when it is none.
pub fn whole(value: f32) -> i32 {
    stampfly_types::math::round(value) as i32
}
