//! Where the generated code finds the bus.
//!
//! A crate that re-exports the bus, as `stampfly-flight` does, has users who never named `stampfly-bus` in their manifest; for
//! them `::stampfly_bus` is no path. So the tables are declared through macros by example, which know their own crate and pass it
//! in as `$crate`. The generators write `::stampfly_bus`; here that becomes the crate passed in.

use crate::input::{Error, Result};
use proc_macro2::{Group, Ident, TokenStream, TokenTree};

/// What a generator makes of a table, with the paths of the crate that stands before the table.
pub fn expand(input: TokenStream, generator: fn(TokenStream) -> Result<TokenStream>) -> TokenStream {
    let mut tokens = input.into_iter();
    let Some(TokenTree::Ident(bus)) = tokens.next() else { return TokenStream::new() };
    with_root(generator(tokens.collect()).unwrap_or_else(Error::into_tokens), &bus)
}

/// The same code with `bus` for every `::stampfly_bus`.
fn with_root(code: TokenStream, bus: &Ident) -> TokenStream {
    let mut out = Vec::new();
    for token in code {
        match token {
            TokenTree::Group(group) => {
                let mut inside = Group::new(group.delimiter(), with_root(group.stream(), bus));
                inside.set_span(group.span());
                out.push(TokenTree::Group(inside));
            }
            TokenTree::Ident(name) if name == "stampfly_bus" => {
                // Without the two colons before it.
                out.truncate(out.len().saturating_sub(2));
                let mut root = bus.clone();
                // An error is shown where the generator wanted it.
                root.set_span(bus.span().located_at(name.span()));
                out.push(TokenTree::Ident(root));
            }
            other => out.push(other),
        }
    }
    out.into_iter().collect()
}
