//! Messages as text, field by field: for CSV, JSON lines and consoles.
//!
//! Numbers are written with the fewest digits that read back as the same bits (`core::fmt` does
//! this for `f32`), so the text is lossless. For flat records only: fields with several elements,
//! vectors and quaternions included, are refused, as are `f64` and `i64`. For a log of all topics
//! use ULog; for a radio use a codec of bytes.
//!
//! ```
//! use stampfly_types::{Message, message, text};
//! message! {
//!     /// A lamp.
//!     pub struct Lamp {
//!         /// Is it on?
//!         on: bool,
//!         /// Its power.
//!         power: f32 ["W"],
//!     }
//! }
//! let lamp = Lamp { on: true, power: 0.1 };
//! let mut line = String::new();
//! for (field, words) in text::fields::<Lamp>(&lamp.to_words()) {
//!     line += field.name;
//!     line += "=";
//!     text::write(field, words, text::Style::Names, &mut line)?;
//!     line += " ";
//! }
//! assert_eq!(line, "on=true power=0.1 ");
//!
//! let read: Option<Lamp> = text::read(|field| Ok::<_, ()>(if field.name == "on" { "1" } else { "0.1" })).unwrap();
//! assert_eq!(read, Some(lamp));
//! # Ok::<(), core::fmt::Error>(())
//! ```

use crate::{FieldInfo, FieldKind, Message};
use core::fmt::{Error, Result as Written, Write};

/// Format of enumerations and truth values for writing. Reading accepts both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// As numbers.
    Numbers,
    /// As `true`, `false` and names in double quotes.
    Names,
}

/// The fields of a message, each with its words.
pub fn fields<M: Message>(words: &M::Words) -> impl Iterator<Item = (&'static FieldInfo, &[u32])> {
    let mut rest = words.as_ref();
    M::FIELDS.iter().map(move |field| {
        let (here, after) = rest.split_at(field.words.min(rest.len()));
        rest = after;
        (field, here)
    })
}

/// Whether all `f32` fields of the message are finite. Does not check `f64` fields or nested
/// messages.
pub fn is_finite<M: Message>(message: &M) -> bool {
    let finite = |words: &[u32]| words.iter().all(|word| f32::from_bits(*word).is_finite());
    fields::<M>(&message.to_words()).all(|(field, words)| field.kind != FieldKind::F32 || finite(words))
}

/// Writes one field.
///
/// # Errors
/// When `out` fails, when the field has several elements or an unsupported type, or when its words
/// are not the number of a named value.
pub fn write(field: &FieldInfo, words: &[u32], style: Style, out: &mut impl Write) -> Written {
    let named = style == Style::Names;
    match (field.kind, words) {
        (FieldKind::F32, [word]) => write!(out, "{}", f32::from_bits(*word)),
        (FieldKind::I32 | FieldKind::I16, [word]) => write!(out, "{}", word.cast_signed()),
        (FieldKind::Bool, [word]) if named => write!(out, "{}", *word != 0),
        (FieldKind::Enum(names), [word]) if named => {
            let (name, _) = names.iter().find(|(_, number)| number == word).ok_or(Error)?;
            write!(out, "\"{name}\"")
        }
        (FieldKind::U64, [low, high]) => write!(out, "{}", u64::from(*low) | u64::from(*high) << 32),
        (_, [word]) => write!(out, "{word}"),
        _ => Err(Error),
    }
}

/// Parses a message from the text of each of its fields. `None` when a text is not a value of its
/// field.
///
/// # Errors
/// Those of `text_of`.
pub fn read<'t, M: Message, E>(
    mut text_of: impl FnMut(&'static FieldInfo) -> Result<&'t str, E>,
) -> Result<Option<M>, E> {
    let mut words = M::ZERO;
    let mut rest = words.as_mut();
    for field in M::FIELDS {
        let (here, after) = rest.split_at_mut(field.words.min(rest.len()));
        if read_field(field, text_of(field)?, here).is_none() {
            return Ok(None);
        }
        rest = after;
    }
    Ok(M::from_words(&words))
}

fn read_field(field: &FieldInfo, text: &str, words: &mut [u32]) -> Option<()> {
    match (field.kind, words) {
        (FieldKind::F32, [word]) => *word = text.parse::<f32>().ok()?.to_bits(),
        (FieldKind::I32 | FieldKind::I16, [word]) => *word = text.parse::<i32>().ok()?.cast_unsigned(),
        (FieldKind::Bool, [word]) if text == "true" || text == "false" => *word = u32::from(text == "true"),
        (FieldKind::Enum(names), [word]) if text.starts_with('"') => {
            let name = text.strip_prefix('"')?.strip_suffix('"')?;
            (_, *word) = *names.iter().find(|(known, _)| *known == name)?;
        }
        (FieldKind::U64, [low, high]) => {
            let value: u64 = text.parse().ok()?;
            (*low, *high) = (value as u32, (value >> 32) as u32);
        }
        (_, [word]) => *word = text.parse().ok()?,
        _ => return None,
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{FlightStatus, ImuData};
    use crate::{Instant, message};
    use proptest::prelude::*;
    use std::string::String;
    use std::vec::Vec;

    message! {
        /// One field of every kind.
        struct Kinds {
            real: f32,
            unsigned: u32,
            signed: i32,
            small: i16,
            truth: bool,
            time: Instant ["us"],
        }
    }

    fn texts<M: Message>(message: &M, style: Style) -> Result<Vec<String>, Error> {
        fields::<M>(&message.to_words())
            .map(|(field, words)| {
                let mut text = String::new();
                write(field, words, style, &mut text).map(|()| text)
            })
            .collect()
    }

    fn back<M: Message>(texts: &[String]) -> Option<M> {
        let mut texts = texts.iter();
        read(|_| texts.next().map(String::as_str).ok_or(())).expect("as many texts as fields")
    }

    proptest! {
        #[test]
        fn text_loses_nothing(bits: u32, unsigned: u32, signed: i32, small: i16, truth: bool, time: u64) {
            let real = f32::from_bits(bits);
            prop_assume!(real.is_finite());
            let kinds = Kinds { real, unsigned, signed, small, truth, time: Instant::from_micros(time) };
            for style in [Style::Names, Style::Numbers] {
                let read: Kinds = back(&texts(&kinds, style).unwrap()).expect("its own text");
                prop_assert_eq!(read.to_words(), kinds.to_words());
            }
        }

        #[test]
        fn no_text_is_a_panic(text in "\\PC{0,12}") {
            let _: Option<Kinds> = read(|_| Ok::<_, ()>(text.as_str())).unwrap();
        }
    }

    #[test]
    fn enumerations_have_names_and_numbers() {
        let mode = FlightStatus::default();
        let named = texts(&mode, Style::Names).unwrap();
        assert_eq!(named[0], "\"Init\"");
        assert_eq!(back(&named), Some(mode));
        assert_eq!(back(&texts(&mode, Style::Numbers).unwrap()), Some(mode));
        let unknown: Option<FlightStatus> = read(|_| Ok::<_, ()>("\"Elsewhere\"")).unwrap();
        assert_eq!(unknown, None);
    }

    #[test]
    fn vectors_have_no_text_and_infinities_are_seen() {
        let imu = ImuData { temperature: f32::INFINITY, ..ImuData::default() };
        assert_eq!(texts(&imu, Style::Names), Err(Error));
        assert!(!is_finite(&imu) && is_finite(&ImuData::default()));
    }
}
