//! The page with the whole simulation inside: one file that anybody can open, without a server and without a network.
//!
//! It is the ground station's page; where that has a socket, this has a worker with the flight stack as WebAssembly.

use super::page::{self, Parts};

const PARTS: Parts = Parts { socket: include_str!("demo/socket.js"), more: include_str!("demo/again.js") };

/// The page, with this WebAssembly module of `stampfly-board/browser`.
#[must_use]
pub fn html(module: &[u8]) -> String {
    // Nothing from outside; WebAssembly, and the worker made of this file.
    let policy = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
                  script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; worker-src blob:; style-src 'unsafe-inline'; \
                  img-src data:; base-uri 'none'; form-action 'none'\">";
    let inside = format!(
        "<script type=\"text/plain\" id=\"module\">{}</script>\n<script type=\"text/plain\" id=\"worker\">{}</script>\n",
        base64(module),
        include_str!("demo/worker.js")
    );
    let page = page::assemble("", &PARTS);
    let page = page.replacen("<meta charset=\"utf-8\">", &format!("<meta charset=\"utf-8\">\n{policy}"), 1);
    // Before the script that looks for them.
    match page.rfind("<script nonce") {
        Some(place) => [&page[..place], &inside, &page[place..]].concat(),
        None => page,
    }
}

/// Bytes as letters, RFC 4648 section 4.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let word = three.iter().fold(0, |word, byte| word << 8 | u32::from(*byte)) << (8 * (3 - three.len()));
        for place in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * place)) as usize & 63];
            text.push(if place <= three.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The test vectors of RFC 4648, section 10.
    #[test]
    fn letters_are_those_of_the_rfc() {
        let vectors =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")];
        for (bytes, text) in vectors {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn the_page_refers_to_nothing_outside() {
        let html = html(b"module").replace("http://www.w3.org/2000/svg", "");
        for outside in ["http:", "https:", "//cdn", "src=\"", "@import", "url(", "WebSocket("] {
            assert!(!html.contains(outside), "{outside}");
        }
        assert!(html.contains("bW9kdWxl"), "the module is in it");
    }
}
