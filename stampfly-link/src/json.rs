//! Datagrams as JSON lines: one flat object per line, for people, scripts and `nc`.
//!
//! `{"@kind":"PowerData","@format":1,"@sequence":7,"@time":20000,"voltage":4.2,"current":1,"power":4.2}`: members in any
//! order, all of them, each once; those of the datagram begin with `@`, which no field does; time in µs. Strings are names without escapes, and nothing is nested. The message's own schema is
//! the codec, which makes it shorter than the types a general JSON library needs, and it allocates nothing.
//!
//! ```
//! # use stampfly_link::{datagrams, Datagram, json};
//! # use stampfly_types::{Instant, messages::PowerData};
//! # datagrams! {
//! #     /// What a charger sends.
//! #     pub enum ChargerBody, magic b"CHG1";
//! #     /// Its output.
//! #     PowerData = 1, valid if |power| power.voltage >= 0.0;
//! # }
//! let body = PowerData { voltage: 4.2, current: 1.0, power: 4.2 }.into();
//! let datagram: Datagram<ChargerBody> = Datagram { sequence: 7, time: Instant::from_millis(20), body };
//! let mut line = String::new();
//! json::write(&datagram, &mut line)?;
//! assert_eq!(json::read(&line), Ok(datagram));
//! # Ok::<(), core::fmt::Error>(())
//! ```

use crate::datagram::{Body, Datagram, DatagramError, Source, VERSION, Visitor};
use core::fmt::{Error, Result as Written, Write};
use core::str::FromStr;
use stampfly_types::{Instant, Message, text};

/// Members of the datagram: kind, format, sequence, time.
const HEADER: usize = 4;

/// Writes a datagram and a line feed.
///
/// # Errors
/// When the message is not valid or has a field of several elements, or `out` refuses.
pub fn write<B: Body>(datagram: &Datagram<B>, out: &mut impl Write) -> Written {
    let Datagram { sequence, time, body } = datagram;
    if body.is_valid() { body.visit(Writer { sequence: *sequence, time: *time, out }) } else { Err(Error) }
}

struct Writer<'w, W> {
    sequence: u32,
    time: Instant,
    out: &'w mut W,
}

impl<W: Write> Visitor for Writer<'_, W> {
    type Output = Written;

    fn message<M: Message>(self, _: u8, message: &M) -> Written {
        let Self { sequence, time, out } = self;
        let (kind, time) = (M::NAME, time.as_micros());
        write!(out, r#"{{"@kind":"{kind}","@format":{VERSION},"@sequence":{sequence},"@time":{time}"#)?;
        for (field, words) in text::fields::<M>(&message.to_words()) {
            write!(out, r#","{}":"#, field.name)?;
            text::write(field, words, text::Style::Names, out)?;
        }
        out.write_str("}\n")
    }
}

/// Reads one line, with or without its line feed.
///
/// # Errors
/// When it is no datagram.
pub fn read<B: Body>(line: &str) -> Result<Datagram<B>, DatagramError> {
    let object = line.trim().strip_prefix('{').and_then(|rest| rest.strip_suffix('}')).ok_or(DatagramError::Syntax)?;
    let object = Object(object);
    if object.members().any(|member| member.is_none()) {
        return Err(DatagramError::Syntax);
    }
    if object.number::<u8>("@format")? != VERSION {
        return Err(DatagramError::Version);
    }
    let name = object.value("@kind")?;
    let is_named = |known: &str| name.strip_prefix('"').and_then(|name| name.strip_suffix('"')) == Some(known);
    let (kind, _) = B::KINDS.iter().find(|(_, known)| is_named(known)).ok_or(DatagramError::Kind)?;
    let (sequence, time) = (object.number("@sequence")?, Instant::from_micros(object.number("@time")?));
    Ok(Datagram { sequence, time, body: B::build(*kind, object)? })
}

/// What is between the braces.
#[derive(Clone, Copy)]
struct Object<'j>(&'j str);

impl<'j> Object<'j> {
    /// Names without their quotes, and values; `None` for what is no member.
    fn members(self) -> impl Iterator<Item = Option<(&'j str, &'j str)>> {
        self.0.split(',').map(|member| {
            let (name, value) = member.split_once(':')?;
            Some((name.trim().strip_prefix('"')?.strip_suffix('"')?, value.trim()))
        })
    }

    /// The value of this name, which must be there once.
    fn value(self, name: &str) -> Result<&'j str, DatagramError> {
        let mut found = self.members().flatten().filter(|(known, _)| *known == name);
        match (found.next(), found.next()) {
            (Some((_, value)), None) => Ok(value),
            _ => Err(DatagramError::Member),
        }
    }

    fn number<T: FromStr>(self, name: &str) -> Result<T, DatagramError> {
        self.value(name)?.parse().map_err(|_| DatagramError::Value)
    }
}

impl Source for Object<'_> {
    fn message<M: Message>(self) -> Result<M, DatagramError> {
        // Every known name is there once, so a member more is an unknown one.
        if self.members().count() != HEADER + M::FIELDS.len() {
            return Err(DatagramError::Member);
        }
        text::read(|field| self.value(field.name))?.ok_or(DatagramError::Value)
    }
}
