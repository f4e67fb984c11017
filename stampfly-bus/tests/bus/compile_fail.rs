//! Wiring errors that the compiler must find. Each file in `ui` is one mistake, with the message it earns beside it.
//!
//! A new compiler may word a message differently: `TRYBUILD=overwrite cargo test -p stampfly-bus --test bus compile_fail`
//! renews them, and the difference is there to be read.

#[test]
fn wiring_errors_do_not_compile() {
    trybuild::TestCases::new().compile_fail("tests/ui/*.rs");
}
