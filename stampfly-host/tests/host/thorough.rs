//! Two sizes of the tests that repeat one thing over many seeds, sticks or flights.
//!
//! | command | flies |
//! |---|---|
//! | `cargo test` | a few of each kind: every mode, stick, fault or moment once, with the fewest seeds |
//! | `STAMPFLY_THOROUGH=1 cargo test` | all of them |
//! | `FLIGHTS=100 cargo test` | so many of each kind, where a test says that it reads this variable |
//!
//! The small size takes seconds and finds what is wrong with every flight of a kind. The thorough
//! size takes minutes and finds what is wrong with one specimen in ten. A number that a test demands
//! of its flights, such as how many had their motors on, is a share of the flights, so that both
//! sizes demand the same.
//!
//! The variables are read here and nowhere else.

/// Is it the thorough size?
pub fn is_thorough() -> bool {
    std::env::var_os("STAMPFLY_THOROUGH").is_some_and(|value| !value.is_empty() && value != "0")
}

/// `few` in the small size, `all` in the thorough one.
pub fn thorough<T>(few: T, all: T) -> T {
    if is_thorough() { all } else { few }
}

/// How many flights of each kind: what the variable `FLIGHTS` asks for, otherwise those of the size.
pub fn flights(few: u64, all: u64) -> u64 {
    asked_for().unwrap_or_else(|| thorough(few, all))
}

/// What the variable `FLIGHTS` asks for.
pub fn asked_for() -> Option<u64> {
    std::env::var("FLIGHTS").ok().map(|text| text.parse().expect("FLIGHTS is a number"))
}
