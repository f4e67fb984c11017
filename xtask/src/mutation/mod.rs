//! Mutants: small changes of the program that some test has to notice. See [`mutants`](crate::steps::mutants).

pub mod list;
pub mod page;
pub mod tool;
