//! Standard input and output of this PC.

use std::io::{Read, Write, stdin, stdout};

/// Waits for bytes. When there will be none any more, the program is over.
pub fn receive(buffer: &mut [u8]) -> usize {
    match stdin().lock().read(buffer) {
        Ok(count @ 1..) => count,
        _ => std::process::exit(1),
    }
}

/// Sends bytes.
pub fn send(bytes: &[u8]) {
    let mut output = stdout().lock();
    // What is lost is asked for again.
    let _ = output.write_all(bytes).and_then(|()| output.flush());
}
