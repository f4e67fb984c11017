//! Expands nested formats into scalars, with names as in pyulog: `current.lat`, `esc[0].esc_rpm`.
//!
//! A file may contain formats that contain themselves, or very long arrays. An expansion therefore
//! ends with an error at [`MAX_DEPTH`] nested formats and at [`MAX_STEPS`] steps.

use super::{Declaration, FieldError, Format, Scalar};
use core::fmt;

/// Maximum number of nested formats, the topic's own included. PX4's logs have two.
pub(super) const MAX_DEPTH: usize = 6;
/// Maximum number of declarations and elements in one expansion. A sample has at most 65,535 bytes.
pub(super) const MAX_STEPS: usize = 1 << 16;
/// Number of bytes of a declaration that count as one step.
const LETTERS: usize = 64;

/// Path to a scalar through nested formats. Displays as `esc[0].esc_rpm`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Path<'a> {
    steps: [Step<'a>; MAX_DEPTH],
    depth: usize,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Step<'a> {
    field: &'a str,
    index: Option<usize>,
}

impl<'a> Path<'a> {
    /// The path without the index of its last array, common to all elements of an array.
    #[must_use]
    pub fn field(mut self) -> Self {
        if let Some(last) = self.depth.checked_sub(1).and_then(|last| self.steps.get_mut(last)) {
            last.index = None;
        }
        self
    }

    /// Whether this is the given field of the topic's own format.
    #[must_use]
    pub fn is(&self, field: &str) -> bool {
        matches!(self.steps(), [Step { field: own, index: None }] if *own == field)
    }

    fn steps(&self) -> &[Step<'a>] {
        self.steps.get(..self.depth).unwrap_or_default()
    }
}

impl fmt::Display for Path<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (depth, Step { field, index }) in self.steps().iter().enumerate() {
            f.write_str(if depth == 0 { "" } else { "." })?;
            f.write_str(field)?;
            if let Some(index) = index {
                write!(f, "[{index}]")?;
            }
        }
        Ok(())
    }
}

/// Location and type of one scalar in a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnfoldedColumn<'a> {
    /// Path to the scalar.
    pub path: Path<'a>,
    /// Type of the value.
    pub scalar: Scalar,
    /// Byte offset in the sample.
    pub offset: usize,
}

/// Iterator returned by [`Format::unfolded`].
#[derive(Clone, Debug)]
pub struct Unfolded<'a, F> {
    formats: F,
    /// Formats being expanded, the topic's own first.
    open: [Open<'a>; MAX_DEPTH],
    depth: usize,
    offset: usize,
    steps: usize,
}

/// A format that is being expanded.
#[derive(Clone, Copy, Debug, Default)]
struct Open<'a> {
    /// Declarations that follow the current field.
    rest: &'a str,
    /// The current field, and the number of its elements already expanded.
    field: Option<(Declaration<'a>, Kind<'a>, usize)>,
}

#[derive(Clone, Copy, Debug)]
enum Kind<'a> {
    Scalar(Scalar),
    Fields(&'a str),
}

impl<'a> Format<'a> {
    /// One column per scalar, in byte order, without padding. Fields whose type `formats` finds are
    /// replaced by the fields of that format. Ends after the first error, because the offsets after
    /// a field of unknown size are unknown.
    ///
    /// ```
    /// use stampfly_log::ulog::Format;
    /// let own = Format { name: "triplet", fields: "uint64_t timestamp;setpoint current;setpoint[2] others;" };
    /// let inner = Format { name: "setpoint", fields: "double lat;bool valid;uint8_t[7] _padding0;" };
    /// let columns = own.unfolded(|name| (name == inner.name).then_some(inner));
    /// let names: Vec<_> = columns.map(|c| c.map(|c| format!("{} {}", c.path, c.offset))).collect::<Result<_, _>>()?;
    /// assert_eq!(names, [
    ///     "timestamp 0", "current.lat 8", "current.valid 16", "others[0].lat 24", "others[0].valid 32",
    ///     "others[1].lat 40", "others[1].valid 48",
    /// ]);
    /// # Ok::<(), stampfly_log::ulog::FieldError>(())
    /// ```
    pub fn unfolded<F: Fn(&str) -> Option<Format<'a>>>(&self, formats: F) -> Unfolded<'a, F> {
        let mut open = [Open::default(); MAX_DEPTH];
        if let Some(own) = open.first_mut() {
            own.rest = self.fields;
        }
        Unfolded { formats, open, depth: 1, offset: 0, steps: 0 }
    }
}

impl<'a, F: Fn(&str) -> Option<Format<'a>>> Unfolded<'a, F> {
    /// Number of declarations and elements processed so far, with long declarations counted several
    /// times: the cost of the expansion.
    #[must_use]
    pub const fn steps(&self) -> usize {
        self.steps
    }

    fn end(&mut self, error: FieldError<'a>) -> Option<Result<UnfoldedColumn<'a>, FieldError<'a>>> {
        self.depth = 0;
        Some(Err(error))
    }

    fn path(&self) -> Path<'a> {
        let mut path = Path { steps: [Step::default(); MAX_DEPTH], depth: self.depth };
        for (step, open) in path.steps.iter_mut().zip(&self.open) {
            if let Some((declaration, _, done)) = open.field {
                *step = Step { field: declaration.name, index: declaration.count.and(done.checked_sub(1)) };
            }
        }
        path
    }
}

impl<'a, F: Fn(&str) -> Option<Format<'a>>> Iterator for Unfolded<'a, F> {
    type Item = Result<UnfoldedColumn<'a>, FieldError<'a>>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let open = self.open.get_mut(self.depth.checked_sub(1)?)?;
            self.steps += 1;
            if self.steps > MAX_STEPS {
                return self.end(FieldError::TooMany);
            }
            match &mut open.field {
                Some((declaration, kind, done)) if *done < declaration.count.unwrap_or(1) => {
                    *done += 1;
                    match *kind {
                        Kind::Scalar(scalar) => {
                            let offset = self.offset;
                            self.offset += scalar.size();
                            return Some(Ok(UnfoldedColumn { path: self.path(), scalar, offset }));
                        }
                        Kind::Fields(rest) => {
                            let name = declaration.type_name;
                            let Some(inner) = self.open.get_mut(self.depth) else {
                                return self.end(FieldError::TooDeep(name));
                            };
                            *inner = Open { rest, field: None };
                            self.depth += 1;
                        }
                    }
                }
                Some(_) => open.field = None,
                // All fields of this format are done: continue with the enclosing one.
                None if open.rest.is_empty() => self.depth -= 1,
                None => {
                    let (text, rest) = open.rest.split_once(';').unwrap_or((open.rest, ""));
                    open.rest = rest;
                    // Bounds the time for declarations of any length, not only their number.
                    self.steps += text.len() / LETTERS;
                    if text.trim_ascii().is_empty() {
                        continue;
                    }
                    let Some(declaration) = Declaration::parse(text) else { return self.end(FieldError::Syntax(text)) };
                    let Some(scalar) = Scalar::from_name(declaration.type_name) else {
                        let Some(format) = (self.formats)(declaration.type_name) else {
                            return self.end(FieldError::Unknown(declaration.type_name));
                        };
                        open.field = Some((declaration, Kind::Fields(format.fields), 0));
                        continue;
                    };
                    // Checked before the loop over the elements, whose number the file chooses.
                    let size = declaration.count.unwrap_or(1).saturating_mul(scalar.size());
                    if self.offset.saturating_add(size) > usize::from(u16::MAX) {
                        return self.end(FieldError::TooLong(text));
                    }
                    if declaration.name.starts_with("_padding") {
                        self.offset += size;
                    } else {
                        open.field = Some((declaration, Kind::Scalar(scalar), 0));
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;
    use std::vec::Vec;

    /// The last column or error of `own`, given these formats.
    fn last(formats: &[(&'static str, &'static str)]) -> Result<std::string::String, std::string::String> {
        let find =
            |name: &str| formats.iter().find(|(known, _)| *known == name).map(|(name, fields)| Format { name, fields });
        let mut columns = find("own").expect("a format").unfolded(find);
        let last = columns.by_ref().last().expect("an item");
        assert!(columns.steps() <= MAX_STEPS + 1_024);
        last.map(|column| column.path.to_string()).map_err(|error| error.to_string())
    }

    #[test]
    fn formats_of_formats_have_the_names_of_pyulog() {
        let formats = [("own", "report[2] esc;"), ("report", "int32_t rpm;inner part;"), ("inner", "float[3] q;")];
        assert_eq!(last(&formats), Ok("esc[1].part.q[2]".into()));
        let own = Format { name: "own", fields: formats[0].1 };
        let find = |name: &str| formats.iter().find(|f| f.0 == name).map(|(name, fields)| Format { name, fields });
        let columns: Vec<_> = own.unfolded(find).map(Result::unwrap).collect();
        assert_eq!(columns.iter().map(|column| column.offset).collect::<Vec<_>>(), [0, 4, 8, 12, 16, 20, 24, 28]);
        assert_eq!(columns[7].path.field().to_string(), "esc[1].part.q");
    }

    #[test]
    fn what_has_no_end_is_an_error_soon() {
        let deep = "`own` holds itself, or formats are too deep in one another";
        assert_eq!(last(&[("own", "own x;")]), Err(deep.into()));
        assert_eq!(last(&[("own", "float x;own[4000000000] x;")]), Err(deep.into()));
        let many = "its fields are too many";
        assert_eq!(last(&[("own", "none[4000000000] x;"), ("none", "")]), Err(many.into()));
        assert_eq!(last(&[("own", "a[99] x;"), ("a", "b[99] x;"), ("b", "c[99] x;"), ("c", "")]), Err(many.into()));
        let long = "with `float[4000000000] x` a sample is longer than a message";
        assert_eq!(last(&[("own", "float[4000000000] x;")]), Err(long.into()));
        assert_eq!(
            last(&[("own", "a[9000] x;"), ("a", "double x;")]),
            Err("with `double x` a sample is longer than a message".into())
        );
        assert_eq!(
            last(&[("own", "what x;")]),
            Err("type `what` is neither a basic one nor a format of the log".into())
        );
    }
}
