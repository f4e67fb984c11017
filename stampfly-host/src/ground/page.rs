//! The page: elements, style and script become one file.

use std::hash::{BuildHasher, RandomState};

/// What a page has of its own.
pub(super) struct Parts {
    /// Where its vehicles are.
    pub socket: &'static str,
    /// What else it can do.
    pub more: &'static str,
}

/// The script up to the socket, and from there on, in the order its parts need each other.
const SCRIPT: [&str; 2] = [
    concat!(include_str!("../page/base.js"), include_str!("../page/canvas.js"), include_str!("../page/scene.js")),
    concat!(
        include_str!("page/vehicle.js"),
        include_str!("page/link.js"),
        include_str!("page/ulog.js"),
        include_str!("page/view.js"),
        include_str!("page/horizon.js"),
        include_str!("page/strips.js"),
        include_str!("page/status.js"),
        include_str!("page/controls.js"),
        include_str!("page/stick_file.js"),
        include_str!("page/sticks.js"),
        include_str!("page/panels.js"),
        include_str!("page/calibration.js"),
        include_str!("page/topics.js"),
        include_str!("page/playback.js"),
        include_str!("page/main.js"),
    ),
];

/// One file of everything.
pub(super) fn assemble(nonce: &str, parts: &Parts) -> String {
    let [before, after] = SCRIPT;
    format!(
        include_str!("page/page.html"),
        nonce = nonce,
        style = [include_str!("../page/page.css"), include_str!("page/page.css")].concat(),
        script = ["'use strict';\n(() => {\n", before, parts.socket, after, parts.more, "})();\n"].concat()
    )
}

/// The page, and the header lines that say what it may do: its own style and script, and talk to this server.
///
/// The nonce is new each time and comes from the system's random numbers, as the keys of hash maps do.
pub(super) fn html() -> (String, String) {
    let random = || RandomState::new().hash_one(0_u8);
    let nonce = format!("{:016x}{:016x}", random(), random());
    let html = assemble(&nonce, &Parts { socket: include_str!("page/socket.js"), more: "" });
    let policy = format!(
        "Content-Security-Policy: default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; \
         connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; \
         require-trusted-types-for 'script'; trusted-types 'none'\r\n"
    );
    (html, policy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_refers_to_nothing_outside() {
        let (html, policy) = html();
        // The name spaces of XML are no addresses.
        let names = html.replace("http://www.w3.org/2000/svg", "");
        for outside in ["http:", "https:", "//cdn", "src=", "@import", "url("] {
            assert!(!names.contains(outside), "{outside}");
        }
        assert!(!html.contains(" style="), "the policy would not let it be");
        let nonce = policy.split("'nonce-").nth(1).and_then(|rest| rest.split('\'').next()).expect("a nonce");
        assert_eq!(html.matches(&format!("nonce=\"{nonce}\"")).count(), 2);
        assert_ne!(self::html().1, policy);
    }
}
