//! Nothing: the programs are in the folder `examples` of each chip's crate, and `Cargo.toml` lists them.
#![no_std]
