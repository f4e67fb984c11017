//! Empty: the programs are in the folder `examples` of each chip's crate and listed in
//! `Cargo.toml`.
#![no_std]
