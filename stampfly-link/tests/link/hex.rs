//! Bytes of vectors, which are written in hexadecimal digits.

use serde_json::Value;

/// The bytes of a text.
pub fn hex(value: &Value) -> Vec<u8> {
    let text = value.as_str().expect("hexadecimal digits");
    (0..text.len()).step_by(2).map(|at| u8::from_str_radix(&text[at..at + 2], 16).expect("a byte")).collect()
}
