//! Tests of writing, reading and damaged logs. They are one binary, because each binary would link
//! writer and reader again; `cargo test -p stampfly-log --test log hostile` runs one file.

mod common;
mod hostile;
mod words;
