//! Topics, tables and schedules. One binary, because each would link their macros again:
//! `cargo test -p stampfly-bus --test bus flows` runs one file. Models for loom are a program of their own.
#![cfg(not(loom))]

mod compile_fail;
mod flows;
mod model;
mod response;
