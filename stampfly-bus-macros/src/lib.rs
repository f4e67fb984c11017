//! The tables of `stampfly-bus`, as procedural macros.
//!
//! `stampfly-bus` re-exports both macros and documents what they generate; use them from there. They are written on
//! tokens alone, without `syn`: the two grammars are small, a vehicle's build does not wait for a parser of all of Rust,
//! and every error is reported at the word that caused it.
//!
//! | file | what it holds |
//! |---|---|
//! | `input` | a cursor over tokens: expect a word, a list, a number, or fail with a position |
//! | `topics` | the topic table: grammar, checks, generated code |
//! | `schedule` | the activation table: the same |
//! | `root` | where the generated code finds the bus |

mod ends;
mod input;
mod root;
mod schedule;
mod topic;
mod topics;

use proc_macro::TokenStream;

/// See `stampfly_bus::topics!`. The table stands behind the path to the bus.
#[proc_macro]
pub fn topics(table: TokenStream) -> TokenStream {
    root::expand(table.into(), topics::expand).into()
}

/// See `stampfly_bus::schedule!`. The table stands behind the path to the bus.
#[proc_macro]
pub fn schedule(table: TokenStream) -> TokenStream {
    root::expand(table.into(), schedule::expand).into()
}
