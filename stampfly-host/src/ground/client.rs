//! One WebSocket: asks in; state, answers and events out.
//!
//! One thread does both. Writing gives up after a few milliseconds when the client does not take
//! what is sent; then state is left out and counted until it does, and asks are still heard.
//! Answers and events are not left out: a client that takes nothing for too long is cut off. A
//! client that breaks the protocol is told so with a close code.

use super::limits::Limits;
use super::pulse::Pulse;
use super::wire::Wire;
use crate::waited::{has_only_waited, wait_at_most};
use stampfly_ground::Feed;
use stampfly_ground::ask::{Ask, AskError, Asked, Incoming, Reply};
use stampfly_ground::{Connection, Hub};
use std::io::{self, ErrorKind, Read};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

/// Longest wait for an ask: as long may an answer wait.
const LOOK: Duration = Duration::from_millis(10);
/// Longest wait for a client to take something.
const WRITE: Duration = Duration::from_millis(5);
/// Texts a second at first.
const RATE: u8 = 50;
/// What may wait to be written, bytes.
const WAITING: usize = 4 << 20;
/// Longest wait for a client to take a close frame, and to end the connection behind it.
const PART: Duration = Duration::from_secs(1);

struct Page {
    hub: Arc<Hub>,
    connection: Connection,
    socket: WebSocket<Wire>,
    feed: Feed,
    period: Duration,
    pulse: Pulse,
}

/// Serves a client whose handshake has been answered; `rest` are the bytes that came behind it.
pub(super) fn serve(hub: Arc<Hub>, stream: TcpStream, rest: Vec<u8>, limits: &Limits, is_over: &dyn Fn() -> bool) {
    let config = WebSocketConfig::default()
        .max_message_size(Some(2 * stampfly_ground::ask::LONGEST))
        .max_frame_size(Some(2 * stampfly_ground::ask::LONGEST))
        .read_buffer_size(16 << 10)
        .write_buffer_size(0)
        .max_write_buffer_size(WAITING);
    if stream.set_nodelay(true).and_then(|()| stream.set_write_timeout(Some(WRITE))).is_err() {
        return;
    }
    let socket = WebSocket::from_raw_socket(Wire::new(stream, rest), Role::Server, Some(config));
    let session = session();
    let connection = if session.is_empty() { hub.connect() } else { hub.connect_as(&session) };
    let feed = Feed::new(hub.clone());
    let mut page = Page { hub, connection, socket, feed, period: period(RATE), pulse: Pulse::new(super::now()) };
    match page.run(&session, limits, is_over) {
        Ok(code) => page.part(code),
        // After another error the client is gone, or takes nothing.
        Err(error) => close_code(&error).into_iter().for_each(|code| page.part(Some(code))),
    }
}

/// What a client is told that has made this error (RFC 6455 section 7.4.1); `None` when the error is
/// not of its making.
fn close_code(error: &Error) -> Option<CloseCode> {
    match error {
        Error::Protocol(_) => Some(CloseCode::Protocol),
        Error::Io(error) if Wire::is_breach(error) => Some(CloseCode::Protocol),
        Error::Capacity(_) => Some(CloseCode::Size),
        Error::Utf8(_) => Some(CloseCode::Invalid),
        _ => None,
    }
}

/// What no other page can guess.
fn session() -> String {
    let mut bytes = [0; 16];
    // Without random numbers of the system there is no session that could be resumed.
    let is_random = getrandom::fill(&mut bytes).is_ok();
    if is_random { bytes.iter().map(|byte| format!("{byte:02x}")).collect() } else { String::new() }
}

fn period(rate: u8) -> Duration {
    Duration::from_secs(1) / u32::from(rate.max(1))
}

/// Was it only not possible now?
fn is_full(error: &Error) -> bool {
    matches!(error, Error::Io(error) if has_only_waited(error))
}

impl Page {
    /// Serves until there is an end. Returns the code to close with; `None` when the client has
    /// closed.
    fn run(&mut self, session: &str, limits: &Limits, is_over: &dyn Fn() -> bool) -> Result<Option<CloseCode>, Error> {
        let hello = self.hub.hello(self.connection.client(), session, super::now());
        self.put(hello.into())?;
        let mut due = Instant::now();
        let mut stalled: Option<Instant> = None;
        while !is_over() {
            if self.connection.has_overflown() || stalled.is_some_and(|since| since.elapsed() > limits.stall) {
                return Err(io::Error::from(ErrorKind::TimedOut).into());
            }
            for text in self.connection.take() {
                self.put(Message::text(&*text))?;
            }
            let now = Instant::now();
            if now >= due {
                match stalled {
                    None => {
                        let text = self.feed.text(super::now());
                        self.put(text.into())?;
                    }
                    Some(_) => self.feed.dropped += 1,
                }
                // A late one keeps the plan; time that is lost is not made up for.
                due = (due + self.period).max(now);
            }
            match self.socket.flush() {
                Ok(()) => stalled = None,
                Err(error) if is_full(&error) => stalled = stalled.or(Some(now)),
                Err(error) => return Err(error),
            }
            // No time at all would be refused.
            let wait = due.saturating_duration_since(Instant::now()).clamp(Duration::from_millis(1), LOOK);
            // On Windows writes do not wait after this either. What the client does not take is
            // flushed later.
            wait_at_most(&self.socket.get_ref().stream, wait)?;
            match self.socket.read() {
                Ok(Message::Text(text)) => self.hear(&text),
                Ok(Message::Binary(_)) => return Ok(Some(CloseCode::Unsupported)),
                Ok(Message::Close(_)) => return Ok(None),
                Ok(_) => {}
                Err(error) if is_full(&error) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(Some(CloseCode::Away))
    }

    /// Closes with this code, or answers the client's own, so that the client hears it: a connection
    /// that is ended with bytes unread is reset, and what was said last may be lost.
    fn part(&mut self, code: Option<CloseCode>) {
        let until = Instant::now() + PART;
        let mut said = match code {
            Some(code) => self.socket.close(Some(CloseFrame { code, reason: "".into() })),
            None => self.socket.flush(),
        };
        while said.is_err_and(|error| is_full(&error)) && Instant::now() < until {
            said = self.socket.flush();
        }
        let stream = &mut self.socket.get_mut().stream;
        if stream.shutdown(Shutdown::Write).is_err() {
            return;
        }
        let mut rest = [0; 4096];
        while let Some(left) = until.checked_duration_since(Instant::now()).filter(|left| !left.is_zero()) {
            if wait_at_most(stream, left).is_err() {
                return;
            }
            match stream.read(&mut rest) {
                Ok(1..) => {}
                Err(error) if has_only_waited(&error) => {}
                _ => return,
            }
        }
    }

    /// Writes, or leaves it to a later flush.
    fn put(&mut self, message: Message) -> Result<(), Error> {
        match self.socket.write(message) {
            Err(error) if is_full(&error) => Ok(()),
            result => result,
        }
    }

    fn hear(&mut self, text: &str) {
        let client = self.connection.client();
        let refuse = |vehicle, id, why: String| self.hub.answer_to(client, vehicle, id, Err(why));
        match Incoming::parse(text) {
            Ok(Incoming::Subscribe { id, topics, rate }) => {
                self.period = period(rate);
                self.feed.subscribe(topics);
                self.hub.answer_to(client, None, id, Ok(Reply::text("subscribed")));
            }
            Ok(Incoming::Resume { id, session }) => {
                let is_known = self.hub.resume(&self.connection, &session);
                let answer = if is_known { Ok(Reply::text("resumed")) } else { Err("no such session".into()) };
                self.hub.answer_to(self.connection.client(), None, id, answer);
            }
            Ok(Incoming::Ask(asked)) => {
                let (Asked { vehicle, id, at, .. }, is_repeated) = (&asked, asked.ask.is_repeated());
                let (vehicle, id) = (*vehicle, *id);
                let now = super::now();
                let held = self.pulse.hear(now, matches!(asked.ask, Ask::Alive {}));
                let taken = match at {
                    Some(_) => self.hub.ask(client, asked, now),
                    None => self.hub.ask_since(client, asked, held, now),
                };
                // What is said again and again has no answer.
                if let Err(why) = taken
                    && !is_repeated
                {
                    refuse(Some(vehicle), id, why.to_string());
                }
            }
            Err((id, why)) => refuse(None, id, AskError::to_string(&why)),
        }
    }
}
