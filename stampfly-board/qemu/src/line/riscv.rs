//! The emulator's standard input and output, by semihosting.

use semihosting::io::{Read, Write, stdin, stdout};

/// Waits for bytes. The core stands still meanwhile.
pub fn receive(buffer: &mut [u8]) -> usize {
    stdin().and_then(|mut input| input.read(buffer)).unwrap_or_default()
}

/// Sends bytes.
pub fn send(bytes: &[u8]) {
    // What is lost is asked for again.
    let _ = stdout().and_then(|mut output| output.write_all(bytes));
}
