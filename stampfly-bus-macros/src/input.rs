//! A cursor over the tokens of a table. Every failure knows the token it is about.

use proc_macro2::{Delimiter, Group, Ident, Literal, Punct, Span, TokenStream, TokenTree};
use quote::quote_spanned;

/// What is wrong with a table, and where.
pub struct Error {
    at: Span,
    message: String,
}

impl Error {
    pub fn new(at: Span, message: impl Into<String>) -> Self {
        Self { at, message: message.into() }
    }

    /// The error as the compiler shall report it.
    pub fn into_tokens(self) -> TokenStream {
        let Self { at, message } = self;
        quote_spanned!(at => ::core::compile_error!(#message);)
    }
}

pub type Result<T> = core::result::Result<T, Error>;

/// The tokens still to be read.
pub struct Input {
    rest: std::iter::Peekable<proc_macro2::token_stream::IntoIter>,
    /// Where the last token stood: an error about a missing token points here.
    last: Span,
}

impl Input {
    pub fn new(tokens: TokenStream) -> Self {
        Self { rest: tokens.into_iter().peekable(), last: Span::call_site() }
    }

    pub fn is_empty(&mut self) -> bool {
        self.rest.peek().is_none()
    }

    pub fn next(&mut self) -> Option<TokenTree> {
        let token = self.rest.next();
        if let Some(token) = &token {
            self.last = token.span();
        }
        token
    }

    /// An error at the next token, or behind the last one.
    pub fn error(&mut self, message: impl Into<String>) -> Error {
        let at = self.rest.peek().map_or(self.last, TokenTree::span);
        Error::new(at, message)
    }

    /// Is the next token this word?
    pub fn is_word(&mut self, word: &str) -> bool {
        matches!(self.rest.peek(), Some(TokenTree::Ident(ident)) if ident == word)
    }

    /// Is the next token this character?
    pub fn is_mark(&mut self, mark: char) -> bool {
        matches!(self.rest.peek(), Some(TokenTree::Punct(punct)) if punct.as_char() == mark)
    }

    /// Takes this word if it comes next.
    pub fn take_word(&mut self, word: &str) -> bool {
        let found = self.is_word(word);
        if found {
            self.next();
        }
        found
    }

    /// Takes this character if it comes next.
    pub fn take_mark(&mut self, mark: char) -> bool {
        let found = self.is_mark(mark);
        if found {
            self.next();
        }
        found
    }

    pub fn word(&mut self, expected: &str) -> Result<()> {
        if self.take_word(expected) { Ok(()) } else { Err(self.error(format!("expected `{expected}`"))) }
    }

    pub fn mark(&mut self, expected: char) -> Result<()> {
        if self.take_mark(expected) { Ok(()) } else { Err(self.error(format!("expected `{expected}`"))) }
    }

    /// The two characters of an arrow.
    pub fn arrow(&mut self) -> Result<()> {
        let message = "expected `=>` and the readers in brackets";
        if !self.take_mark('=') || !self.take_mark('>') {
            return Err(self.error(message));
        }
        Ok(())
    }

    /// A name; `what` says whose.
    pub fn name(&mut self, what: &str) -> Result<Ident> {
        match self.rest.peek() {
            Some(TokenTree::Ident(_)) => match self.next() {
                Some(TokenTree::Ident(ident)) => Ok(ident),
                _ => Err(self.error(format!("expected {what}"))),
            },
            _ => Err(self.error(format!("expected {what}"))),
        }
    }

    /// The next group in these delimiters, if one comes next.
    pub fn group(&mut self, delimiter: Delimiter) -> Option<Group> {
        match self.rest.peek() {
            Some(TokenTree::Group(group)) if group.delimiter() == delimiter => match self.next() {
                Some(TokenTree::Group(group)) => Some(group),
                _ => None,
            },
            _ => None,
        }
    }

    /// Attributes, documentation comments among them, as they stand in front of an item.
    pub fn attributes(&mut self) -> Result<Attributes> {
        let mut attributes = Attributes::default();
        while self.is_mark('#') {
            let hash = self.next();
            let Some(group) = self.group(Delimiter::Bracket) else { return Err(self.error("expected an attribute")) };
            if let Some(line) = documentation(group.stream()) {
                attributes.doc.push(line);
            }
            attributes.all.extend(hash);
            attributes.all.extend([TokenTree::Group(group)]);
        }
        Ok(attributes)
    }

    /// Everything up to a character at this level, which is taken, too. A `::` does not end at a `:`.
    pub fn until(&mut self, end: char, what: &str) -> Result<TokenStream> {
        let mut taken = TokenStream::new();
        loop {
            match self.rest.peek() {
                Some(TokenTree::Punct(punct)) if punct.as_char() == ':' && is_joint(punct) => {
                    taken.extend(self.next());
                    taken.extend(self.next());
                }
                Some(TokenTree::Punct(punct)) if punct.as_char() == end => {
                    self.next();
                    break;
                }
                Some(_) => taken.extend(self.next()),
                None => return Err(self.error(format!("expected {what}"))),
            }
        }
        if taken.is_empty() { Err(Error::new(self.last, format!("expected {what}"))) } else { Ok(taken) }
    }

    /// Names between commas, up to the end of the input.
    pub fn names(&mut self, what: &str) -> Result<Vec<Ident>> {
        let mut names = Vec::new();
        while !self.is_empty() {
            names.push(self.name(what)?);
            if !self.is_empty() {
                self.mark(',')?;
            }
        }
        Ok(names)
    }

    /// A positive number, whole or with a fraction.
    pub fn number(&mut self, what: &str) -> Result<Number> {
        let Some(TokenTree::Literal(literal)) = self.rest.peek() else {
            return Err(self.error(format!("expected {what}")));
        };
        let literal: Literal = literal.clone();
        self.next();
        let text = literal.to_string();
        let value = text.replace('_', "").parse::<f64>().ok().filter(|value| *value > 0.0 && value.is_finite());
        let value = value.ok_or_else(|| Error::new(literal.span(), format!("expected {what}, above zero")))?;
        Ok(Number { value, text, at: literal.span() })
    }

    /// A span of time: `5 ms`, in microseconds.
    pub fn time(&mut self, what: &str) -> Result<u64> {
        let number = self.number(what)?;
        let factor = [("us", 1.0), ("ms", 1e3), ("s", 1e6)].into_iter().find(|(unit, _)| self.take_word(unit));
        let Some((_, factor)) = factor else { return Err(self.error("expected a unit of time: `us`, `ms` or `s`")) };
        whole_micros(number.value * factor, number.at)
    }
}

/// A number of microseconds that is whole, as the tables need it.
pub fn whole_micros(value: f64, at: Span) -> Result<u64> {
    let rounded = value.round();
    if !(1.0..=1e15).contains(&rounded) {
        return Err(Error::new(at, "this is less than a microsecond, or more than thirty years"));
    }
    Ok(rounded as u64)
}

fn is_joint(punct: &Punct) -> bool {
    punct.spacing() == proc_macro2::Spacing::Joint
}

/// A number as written.
pub struct Number {
    pub value: f64,
    pub text: String,
    pub at: Span,
}

/// The attributes of a line.
#[derive(Default)]
pub struct Attributes {
    /// All of them, to be repeated where the item is generated.
    pub all: TokenStream,
    /// The documentation's lines, as string literals.
    pub doc: Vec<Literal>,
}

/// The text of `doc = "…"`.
fn documentation(attribute: TokenStream) -> Option<Literal> {
    let mut tokens = attribute.into_iter();
    match (tokens.next(), tokens.next(), tokens.next()) {
        (Some(TokenTree::Ident(doc)), Some(TokenTree::Punct(_)), Some(TokenTree::Literal(text))) if doc == "doc" => {
            Some(text)
        }
        _ => None,
    }
}

/// For generated code that is about this name: an error is shown at the name, local variables are the generator's. Without that, a
/// variable of the code around would be another one of the same name.
pub fn located(name: &Ident) -> Span {
    Span::call_site().located_at(name.span())
}

/// `sensor_imu` as a type's name: `SensorImu`, with an ending.
pub fn type_name(name: &Ident, ending: &str) -> Ident {
    let text = name.to_string();
    let parts = text.trim_start_matches("r#").split('_').map(|part| {
        let mut letters = part.chars();
        letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
    });
    Ident::new(&(parts.collect::<String>() + ending), name.span())
}

/// Refuses a name that stands twice.
pub fn once<'a>(names: impl Iterator<Item = &'a Ident>, what: &str) -> Result<()> {
    let mut seen = std::collections::BTreeSet::new();
    for name in names {
        if !seen.insert(name.to_string()) {
            return Err(Error::new(name.span(), format!("{what} `{name}` stands here twice")));
        }
    }
    Ok(())
}
