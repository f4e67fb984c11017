//! Prints the datagrams that other programs are tested against, as `tests/vectors/datagrams.json` holds them.
//!
//! `cargo xtask vectors --fix` writes the file.

#[path = "../tests/vectors/datagrams.rs"]
mod vectors;

fn main() {
    print!("{}", vectors::vectors());
}
