//! The little HTTP that the page needs, as functions over bytes: no sockets here.
//!
//! Use [`request`] on what has arrived so far, until it gives something. It accepts three things:
//! the page, a log, and the handshake of a WebSocket (RFC 6455 section 4.2). Everything else is a
//! [`Refusal`]. Not a general server: no bodies, no encodings, one request a connection.
//!
//! It refuses requests that a page of another site makes in the same browser: those whose `Host` is
//! a name (DNS rebinding needs one), and those whose `Origin` is not this server.

use std::fmt;
use std::net::IpAddr;

/// Longest head of a request, bytes.
pub const LONGEST_HEAD: usize = 8192;
/// Most header lines.
const HEADERS: usize = 64;
/// Between a path and the secret.
const SECRET: &str = "?secret=";
/// Longest secret, characters: letters and digits.
const LONGEST_SECRET: usize = 128;
/// What a base64 text of 16 bytes is long.
const KEY: usize = 24;

/// A request that is granted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// What is wanted.
    pub wanted: Wanted,
    /// The secret that it knows: what follows `?secret=` in its path.
    pub secret: Option<String>,
    /// How many of the bytes are its head; what follows belongs to the WebSocket.
    pub length: usize,
}

/// What can be had.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// The page.
    Page,
    /// The log of this vehicle.
    Log(usize),
    /// A WebSocket; the client's key.
    Socket(String),
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// No HTTP/1.1 request.
    NotHttp,
    /// Longer than [`LONGEST_HEAD`], or too many lines.
    TooLong,
    /// Not `GET`.
    Method,
    /// With a body.
    Body,
    /// `Host` is missing, there twice, or names no address of this machine.
    ForeignHost,
    /// `Origin` is another server, or the request is made by a page of one.
    ForeignOrigin,
    /// The secret is missing or wrong.
    Secret,
    /// There is nothing of this name.
    NotFound,
    /// `/ws` without a handshake of WebSocket version 13.
    NotWebSocket,
    /// Too many connections.
    Busy,
    /// It is there, and cannot be read.
    Unreadable,
    /// The head did not come in time.
    Slow,
}

impl Refusal {
    /// Status code and reason.
    #[must_use]
    pub const fn status(self) -> &'static str {
        match self {
            Self::NotHttp | Self::Body => "400 Bad Request",
            Self::TooLong => "431 Request Header Fields Too Large",
            Self::Method => "405 Method Not Allowed",
            Self::ForeignHost | Self::ForeignOrigin | Self::Secret => "403 Forbidden",
            Self::NotFound => "404 Not Found",
            Self::NotWebSocket => "426 Upgrade Required",
            Self::Busy => "503 Service Unavailable",
            Self::Unreadable => "500 Internal Server Error",
            Self::Slow => "408 Request Timeout",
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotHttp => "no HTTP/1.1 request",
            Self::TooLong => "the head of the request is too long",
            Self::Method => "only GET",
            Self::Body => "a request with a body",
            Self::ForeignHost => "this server does not answer to that name; use localhost or an IP address",
            Self::ForeignOrigin => "a page of another server",
            Self::Secret => "the address of this page ends with a secret, as 'stampfly' has printed it",
            Self::NotFound => "there is nothing of this name",
            Self::NotWebSocket => "here is a WebSocket, version 13",
            Self::Busy => "too many connections",
            Self::Unreadable => "it cannot be read",
            Self::Slow => "the request did not come in time",
        })
    }
}

impl std::error::Error for Refusal {}

/// Who may be the host in a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hosts {
    /// `localhost`, and addresses of the loopback network.
    Loopback,
    /// Any address, and `localhost`. No other name: whoever owns a name can point it here.
    Addresses,
}

/// The request in these bytes; `None` while it is not all there.
///
/// ```
/// use stampfly_ground::http::{Hosts, Refusal, Wanted, request};
///
/// let bytes = b"GET /log/2 HTTP/1.1\r\nHost: localhost:8000\r\n\r\n";
/// let granted = request(bytes, Hosts::Loopback)?.expect("a whole one");
/// assert_eq!(granted.wanted, Wanted::Log(2));
/// assert_eq!(request(&bytes[..20], Hosts::Loopback), Ok(None));
/// assert_eq!(request(b"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n", Hosts::Loopback), Err(Refusal::ForeignHost));
/// # Ok::<(), Refusal>(())
/// ```
///
/// # Errors
/// [`Refusal`]; more bytes would not change it.
pub fn request(bytes: &[u8], hosts: Hosts) -> Result<Option<Request>, Refusal> {
    let head = bytes.get(..LONGEST_HEAD).unwrap_or(bytes);
    let mut headers = [httparse::EMPTY_HEADER; HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    let length = match parsed.parse(head) {
        Ok(httparse::Status::Complete(length)) => length,
        Ok(httparse::Status::Partial) if head.len() < LONGEST_HEAD => return Ok(None),
        Ok(httparse::Status::Partial) | Err(httparse::Error::TooManyHeaders) => return Err(Refusal::TooLong),
        Err(_) => return Err(Refusal::NotHttp),
    };
    let (Some(method), Some(path), Some(1)) = (parsed.method, parsed.path, parsed.version) else {
        return Err(Refusal::NotHttp);
    };
    if method != "GET" {
        return Err(Refusal::Method);
    }
    let headers = Headers(parsed.headers);
    let host = headers.only("Host")?.ok_or(Refusal::ForeignHost)?;
    if !is_here(host, hosts) {
        return Err(Refusal::ForeignHost);
    }
    if let Some(origin) = headers.only("Origin").map_err(|_| Refusal::ForeignOrigin)?
        && !origin.strip_prefix("http://").is_some_and(|server| server.eq_ignore_ascii_case(host))
    {
        return Err(Refusal::ForeignOrigin);
    }
    let length_of_body = headers.only("Content-Length").map_err(|_| Refusal::Body)?;
    if length_of_body.is_some_and(|length| length != "0") || headers.all("Transfer-Encoding").next().is_some() {
        return Err(Refusal::Body);
    }
    let (path, secret) = match path.split_once(SECRET) {
        Some((path, secret)) if is_secret(secret) => (path, Some(secret.to_owned())),
        Some(_) => return Err(Refusal::NotFound),
        None => (path, None),
    };
    let wanted = match path {
        "/" => Wanted::Page,
        "/ws" => Wanted::Socket(headers.socket_key().ok_or(Refusal::NotWebSocket)?.to_owned()),
        _ => path.strip_prefix("/log/").and_then(number).map(Wanted::Log).ok_or(Refusal::NotFound)?,
    };
    // A person may come from anywhere. What only the page itself needs, no other page may have
    // fetched, nor an image in one.
    let site = headers.only("Sec-Fetch-Site").map_err(|_| Refusal::ForeignOrigin)?;
    if wanted != Wanted::Page && site.is_some_and(|site| !matches!(site, "same-origin" | "none")) {
        return Err(Refusal::ForeignOrigin);
    }
    Ok(Some(Request { wanted, secret, length }))
}

fn is_secret(text: &str) -> bool {
    (1..=LONGEST_SECRET).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_alphanumeric())
}

/// Digits alone: the standard parser would take a sign.
fn number(text: &str) -> Option<usize> {
    (text.len() <= 4 && text.bytes().all(|byte| byte.is_ascii_digit())).then(|| text.parse().ok()).flatten()
}

fn is_here(host: &str, hosts: Hosts) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => {
            let Some((address, port)) = rest.split_once(']') else { return false };
            if !(port.is_empty() || port.strip_prefix(':').is_some_and(is_port)) {
                return false;
            }
            address
        }
        None => match host.split_once(':') {
            Some((name, port)) if is_port(port) => name,
            Some(_) => return false,
            None => host,
        },
    };
    if name.eq_ignore_ascii_case("localhost") {
        return true;
    }
    name.parse::<IpAddr>().is_ok_and(|address| hosts == Hosts::Addresses || address.is_loopback())
}

fn is_port(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit()) && text.parse::<u16>().is_ok()
}

struct Headers<'h>(&'h [httparse::Header<'h>]);

impl<'h> Headers<'h> {
    fn all(&self, name: &'static str) -> impl Iterator<Item = &'h [u8]> {
        self.0.iter().filter(move |header| header.name.eq_ignore_ascii_case(name)).map(|header| header.value)
    }

    /// The value of a header that must not be there twice.
    fn only(&self, name: &'static str) -> Result<Option<&'h str>, Refusal> {
        let mut all = self.all(name);
        let first = all.next();
        if all.next().is_some() {
            return Err(Refusal::ForeignHost);
        }
        first.map(|value| std::str::from_utf8(value).map(str::trim)).transpose().map_err(|_| Refusal::ForeignHost)
    }

    /// Is this word in the header's list?
    fn lists(&self, name: &'static str, word: &str) -> bool {
        let texts = self.all(name).filter_map(|value| std::str::from_utf8(value).ok());
        texts.flat_map(|text| text.split(',')).any(|part| part.trim().eq_ignore_ascii_case(word))
    }

    /// RFC 6455 section 4.2.1.
    fn socket_key(&self) -> Option<&'h str> {
        let asks = self.lists("Upgrade", "websocket") && self.lists("Connection", "upgrade");
        let version = self.only("Sec-WebSocket-Version").ok()??;
        let key = self.only("Sec-WebSocket-Key").ok()??;
        let base64 = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'+' | b'/' | b'=');
        (asks && version == "13" && key.len() == KEY && key.bytes().all(base64)).then_some(key)
    }
}

/// What keeps a page within itself, on every answer.
const GUARDS: &str = "X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\nCross-Origin-Opener-Policy: same-origin\r\nCache-Control: no-store\r\n";

/// The head of an answer with a body of this length. `extra` are header lines, each with its end.
#[must_use]
pub fn head(status: &str, content: &str, length: u64, extra: &str) -> String {
    format!(
        "HTTP/1.1 {status}\r\nContent-Type: {content}\r\nContent-Length: {length}\r\nConnection: close\r\n{GUARDS}{extra}\r\n"
    )
}

/// A refusal as an answer.
#[must_use]
pub fn refuse(refusal: Refusal) -> String {
    let extra = match refusal {
        Refusal::Method => "Allow: GET\r\n",
        Refusal::NotWebSocket => "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n",
        _ => "",
    };
    let body = format!("{refusal}\n");
    head(refusal.status(), "text/plain; charset=utf-8", body.len() as u64, extra) + &body
}

/// The answer to a WebSocket's handshake, with what follows from the client's key (RFC 6455 section
/// 4.2.2, 5.4), which libraries of WebSockets compute.
#[must_use]
pub fn upgrade(accept: &str) -> String {
    format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn get(path: &str, headers: &str, hosts: Hosts) -> Result<Wanted, Refusal> {
        let text = format!("GET {path} HTTP/1.1\r\n{headers}\r\n");
        request(text.as_bytes(), hosts).map(|granted| granted.expect("a whole request").wanted)
    }

    #[test]
    fn only_names_and_addresses_of_this_machine_are_answered() {
        let asked = |host: &str, hosts| get("/", &format!("Host: {host}\r\n"), hosts);
        for host in ["localhost", "localhost:8000", "LOCALHOST:1", "127.0.0.1:8000", "127.8.8.8", "[::1]", "[::1]:8000"]
        {
            assert_eq!(asked(host, Hosts::Loopback), Ok(Wanted::Page), "{host}");
        }
        let foreign = [
            "",
            "evil.example",
            "localhost.evil.example",
            "localhost:",
            "localhost:x",
            "localhost:99999",
            "127.0.0.1.evil.example",
            "[::1",
            "[::1]x",
            "::1",
            "127.1",
            "0x7f.0.0.1",
            "localhost@evil.example",
        ];
        for host in foreign {
            assert_eq!(asked(host, Hosts::Loopback), Err(Refusal::ForeignHost), "{host}");
            assert_eq!(asked(host, Hosts::Addresses), Err(Refusal::ForeignHost), "{host}");
        }
        assert_eq!(asked("192.168.4.1:80", Hosts::Addresses), Ok(Wanted::Page));
        assert_eq!(asked("192.168.4.1:80", Hosts::Loopback), Err(Refusal::ForeignHost));
        assert_eq!(get("/", "", Hosts::Loopback), Err(Refusal::ForeignHost));
        assert_eq!(get("/", "Host: localhost\r\nHost: localhost\r\n", Hosts::Loopback), Err(Refusal::ForeignHost));
    }

    #[test]
    fn a_page_of_another_server_is_refused() {
        let from = |origin: &str| get("/", &format!("Host: localhost:8000\r\nOrigin: {origin}\r\n"), Hosts::Loopback);
        assert_eq!(from("http://localhost:8000"), Ok(Wanted::Page));
        for origin in
            ["http://evil.example", "null", "https://localhost:8000", "http://localhost:8001", "http://127.0.0.1:8000"]
        {
            assert_eq!(from(origin), Err(Refusal::ForeignOrigin), "{origin}");
        }
    }

    #[test]
    fn other_spellings_of_this_server_and_two_origins_are_refused() {
        let from = |host: &str, origins: &[&str]| {
            let origins: String = origins.iter().map(|origin| format!("Origin: {origin}\r\n")).collect();
            get("/", &format!("Host: {host}\r\n{origins}"), Hosts::Loopback)
        };
        // With a dot behind it, a browser asks for another cookie jar and another permission.
        for host in ["localhost.:8000", "127.0.0.1.:8000", "[::ffff:127.0.0.1]:8000", "0.0.0.0:8000"] {
            let own = format!("http://{host}");
            assert_eq!(from(host, &[&own]), Err(Refusal::ForeignHost), "{host}");
            assert_eq!(from(host, &[]), Err(Refusal::ForeignHost), "{host}");
            assert_eq!(from("localhost:8000", &[&own]), Err(Refusal::ForeignOrigin), "{host}");
        }
        let own = "http://localhost:8000";
        for origins in [[own, "http://evil.example"], ["http://evil.example", own], [own, own]] {
            assert_eq!(from("localhost:8000", &origins), Err(Refusal::ForeignOrigin), "{origins:?}");
        }
    }

    #[test]
    fn only_the_page_itself_is_shown_to_who_comes_from_another_site() {
        for (site, path, wanted) in [
            ("cross-site", "/", Ok(Wanted::Page)),
            ("cross-site", "/log/0", Err(Refusal::ForeignOrigin)),
            ("same-site", "/log/0", Err(Refusal::ForeignOrigin)),
            ("same-origin", "/log/0", Ok(Wanted::Log(0))),
            ("none", "/log/0", Ok(Wanted::Log(0))),
        ] {
            let headers = format!("Host: localhost\r\nSec-Fetch-Site: {site}\r\n");
            assert_eq!(get(path, &headers, Hosts::Loopback), wanted, "{site} {path}");
        }
    }

    #[test]
    fn a_secret_follows_the_path() {
        let secret = |path: &str| {
            let text = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n");
            request(text.as_bytes(), Hosts::Loopback).map(|granted| granted.expect("a whole request").secret)
        };
        assert_eq!(secret("/log/0"), Ok(None));
        assert_eq!(secret("/log/0?secret=aB3"), Ok(Some("aB3".to_owned())));
        let long = format!("/?secret={}", "a".repeat(LONGEST_SECRET + 1));
        for path in ["/log/0?secret=", "/?secret=a&b", "/?secret=a/..", "/?secret=%61", &long] {
            assert_eq!(secret(path), Err(Refusal::NotFound), "{path}");
        }
    }

    #[test]
    fn there_are_three_things_and_no_others() {
        let asked = |path| get(path, "Host: localhost\r\n", Hosts::Loopback);
        assert_eq!(asked("/log/0"), Ok(Wanted::Log(0)));
        assert_eq!(asked("/log/12"), Ok(Wanted::Log(12)));
        for path in [
            "/log/",
            "/log/+1",
            "/log/-1",
            "/log/1/",
            "/log/99999",
            "/log/..",
            "/index.html",
            "//",
            "/?x",
            "/../etc/passwd",
            "*",
        ] {
            assert_eq!(asked(path), Err(Refusal::NotFound), "{path}");
        }
        assert_eq!(asked("/ws"), Err(Refusal::NotWebSocket));
        let refused = |text: &str| request(text.as_bytes(), Hosts::Loopback);
        assert_eq!(refused("POST / HTTP/1.1\r\nHost: localhost\r\n\r\n"), Err(Refusal::Method));
        assert_eq!(refused("GET / HTTP/1.0\r\nHost: localhost\r\n\r\n"), Err(Refusal::NotHttp));
        assert_eq!(refused("hello\r\n\r\n"), Err(Refusal::NotHttp));
        assert_eq!(get("/", "Host: localhost\r\nContent-Length: 3\r\n", Hosts::Loopback), Err(Refusal::Body));
        assert_eq!(get("/", "Host: localhost\r\nTransfer-Encoding: chunked\r\n", Hosts::Loopback), Err(Refusal::Body));
    }

    #[test]
    fn a_head_has_an_end() {
        let long = format!("GET / HTTP/1.1\r\nHost: localhost\r\nX: {}", "x".repeat(LONGEST_HEAD));
        assert_eq!(request(long.as_bytes(), Hosts::Loopback), Err(Refusal::TooLong));
        let many = format!("Host: localhost\r\n{}", "X: 1\r\n".repeat(HEADERS));
        assert_eq!(get("/", &many, Hosts::Loopback), Err(Refusal::TooLong));
    }

    /// The example of RFC 6455 section 1.3.
    const HANDSHAKE: &str = "Host: localhost\r\nUpgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n\
        Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n";

    #[test]
    fn a_handshake_is_answered_as_the_standard_says() {
        let key = get("/ws", HANDSHAKE, Hosts::Loopback);
        assert_eq!(key, Ok(Wanted::Socket("dGhlIHNhbXBsZSBub25jZQ==".to_owned())));
        assert!(
            upgrade("s3pPLMBiTxaQ9kYGzzhZRbK+xOo=").contains("Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n")
        );
        for (from, to) in
            [("13", "8"), ("websocket", "h2c"), ("keep-alive, Upgrade", "close"), ("bm9uY2U==", "bm9uY2U=")]
        {
            let broken = HANDSHAKE.replace(from, to);
            if broken != HANDSHAKE {
                assert_eq!(get("/ws", &broken, Hosts::Loopback), Err(Refusal::NotWebSocket), "{from}");
            }
        }
    }

    proptest! {
        #[test]
        fn bytes_that_come_one_by_one_end_as_those_that_come_at_once(rest in "[ -~\r\n]{0,60}") {
            let text = format!("GET /ws HTTP/1.1\r\n{HANDSHAKE}\r\n{rest}");
            let whole = request(text.as_bytes(), Hosts::Loopback);
            let first = (0..=text.len()).map(|length| request(&text.as_bytes()[..length], Hosts::Loopback));
            let first = first.into_iter().find(|result| *result != Ok(None));
            prop_assert_eq!(first, Some(whole.clone()));
            let length = whole.ok().flatten().map(|granted| granted.length);
            prop_assert_eq!(length, Some(text.len() - rest.len()));
        }
    }
}
