//! Requests of one station other than commands: parameters by number, lines of the console.
//!
//! The vehicle's end of [`Payload`] kinds 20, 21, 30, 31 and 41, over the radio and over a cable. All
//! queues are bounded. An answer is made when there is room to send it; a long reply is sent in
//! parts. A radio loses parts: a repeated [question](Payload::Question) is answered from the first
//! byte that the station has not received, and is not carried out again. For a terminal use a
//! [`LineEditor`](stampfly_flight::console::LineEditor).

use core::fmt;
use heapless::{Deque, String};
use stampfly_flight::console::{Piece, Request, Vehicle, answer};
use stampfly_link::secure::Payload;
use stampfly_param::parameters;
use stampfly_types::Instant;

/// Bytes of a line.
pub const LINE: usize = 80;
/// Bytes of a reply's part: with its frame it fits into ESP-NOW and into a tunnel of MAVLink.
pub const PIECE: usize = 120;
/// Bytes of a reply that are kept: what a line says before the board does something, and what that says.
const KEPT: usize = 2 * PIECE;
/// Questions for parameters that wait.
const QUESTIONS: usize = 8;

#[derive(Clone, Copy, Debug)]
enum Question {
    Read { index: u16 },
    Write { index: u16, value: f32 },
}

/// Who has typed a line: over a cable, which loses nothing, the question with this number; over the radio the line with this one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Cable(u16),
    Radio(u32),
}

/// How far a line is.
#[derive(Clone, Debug)]
enum Stage {
    /// What it says is being said.
    Answering,
    /// The board does what was asked.
    Board,
    /// What it has said and what came of it is kept, so that nothing is done again for a station that has not heard it.
    Done,
}

#[derive(Clone, Debug)]
struct Line {
    asked: Asked,
    text: String<LINE>,
    stage: Stage,
    /// Bytes of the reply that are sent.
    sent: usize,
    /// Of a reply that is kept, the end, and where that begins.
    kept: String<KEPT>,
    kept_at: usize,
    /// Everything is said. A station that has not heard it all asks again.
    is_said: bool,
}

/// A reply's part, as it is made: without carriage returns, which are for terminals.
#[derive(Clone, Debug, Default)]
pub struct Room(Piece<PIECE>);

impl fmt::Write for Room {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.split('\r').try_for_each(|part| self.0.write_str(part))
    }
}

/// What is to be sent, and what the board is to do then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer<'r, R> {
    /// Number of the question.
    pub number: u16,
    /// The answer.
    pub payload: Payload<'r>,
    /// What only the board can do; it [reports](StationRequests::report) what came of it.
    pub request: Request<R>,
}

/// A payload that waits to be sent: on a radio, sealing and sending are one, so that no frame overtakes another.
#[derive(Clone, Debug, PartialEq)]
pub struct QueuedPayload(Copied);

#[derive(Clone, Debug, PartialEq)]
enum Copied {
    Parameter { index: u16, value: f32, taken: bool },
    Reply { text: String<PIECE>, last: bool },
    Part { number: u32, from: u16, text: String<PIECE>, last: bool },
}

impl QueuedPayload {
    /// A copy of what a desk has answered. `None` of anything else.
    #[must_use]
    pub fn of(payload: &Payload<'_>) -> Option<Self> {
        let copy = |text| String::try_from(text).ok();
        Some(Self(match *payload {
            Payload::Parameter { index, value, taken } => Copied::Parameter { index, value, taken },
            Payload::Reply { text, last } => Copied::Reply { text: copy(text)?, last },
            Payload::Part { number, from, text, last } => Copied::Part { number, from, text: copy(text)?, last },
            _ => return None,
        }))
    }

    /// What is to be sent.
    #[must_use]
    pub fn payload(&self) -> Payload<'_> {
        match &self.0 {
            Copied::Parameter { index, value, taken } => {
                Payload::Parameter { index: *index, value: *value, taken: *taken }
            }
            Copied::Reply { text, last } => Payload::Reply { text, last: *last },
            Copied::Part { number, from, text, last } => {
                Payload::Part { number: *number, from: *from, text, last: *last }
            }
        }
    }
}

/// Questions of one station.
///
/// Give it what is asked with [`ask`](Self::ask), and send what [`answer`](Self::answer) returns as long as there is room for more. `stampfly-board`'s tests have
/// it on both ends of the air.
#[derive(Clone, Debug, Default)]
pub struct StationRequests {
    questions: Deque<(u16, Question), QUESTIONS>,
    line: Option<Line>,
    record: Option<bool>,
}

impl StationRequests {
    /// Nothing is asked.
    #[must_use]
    pub const fn new() -> Self {
        Self { questions: Deque::new(), line: None, record: None }
    }

    /// Takes a question. `false` when it is none, or as many wait as there is room for; one line at a time. A line with another number than that
    /// before ends what is being said of that: its station has given up.
    pub fn ask(&mut self, number: u16, payload: &Payload<'_>) -> bool {
        match *payload {
            Payload::ReadParameter { index } => self.questions.push_back((number, Question::Read { index })).is_ok(),
            Payload::WriteParameter { index, value } => {
                self.questions.push_back((number, Question::Write { index, value })).is_ok()
            }
            Payload::Line(text) if self.line.as_ref().is_none_or(|line| line.is_said) => {
                self.begin(Asked::Cable(number), text)
            }
            Payload::Question { number, from, line } => match &mut self.line {
                Some(again) if again.asked == Asked::Radio(number) && again.text == line => {
                    // While the board works, what comes next is its report.
                    if !matches!(again.stage, Stage::Board) {
                        // What is before it is not kept: its station is left waiting rather than told the rest alone.
                        let first = if matches!(again.stage, Stage::Done) { again.kept_at } else { 0 };
                        (again.sent, again.is_said) = (first.max(from.into()), false);
                    }
                    true
                }
                Some(Line { stage: Stage::Board, .. }) => false,
                _ => self.begin(Asked::Radio(number), line),
            },
            Payload::Record { wanted } => {
                self.record = Some(wanted);
                true
            }
            _ => false,
        }
    }

    fn begin(&mut self, asked: Asked, text: &str) -> bool {
        let (stage, kept) = (Stage::Answering, String::new());
        let text = String::try_from(text).ok();
        self.line = text.map(|text| Line { asked, text, stage, sent: 0, kept, kept_at: 0, is_said: false });
        self.line.is_some()
    }

    /// What was said last of the flight record: that it is wanted, or is not; once. It is answered with chunks.
    pub const fn record(&mut self) -> Option<bool> {
        self.record.take()
    }

    /// Whoever has asked is gone.
    pub fn clear(&mut self) {
        self.questions.clear();
        (self.line, self.record) = (None, None);
    }

    /// The next answer. `None` when nothing waits, or the board is to say something first.
    pub fn answer<'r, V: Vehicle>(
        &mut self,
        now: Instant,
        vehicle: &mut V,
        room: &'r mut Room,
    ) -> Option<Answer<'r, V::Request>> {
        if let Some((number, question)) = self.questions.pop_front() {
            let payload = parameter(vehicle, question)?;
            return Some(Answer { number, payload, request: Request::Nothing });
        }
        let line = self.line.as_mut().filter(|line| !line.is_said)?;
        let request = match &line.stage {
            Stage::Board => return None,
            // An error is the end of the part. Longer replies than one only show something: those lines are answered again.
            Stage::Answering => {
                room.0.start_at(line.sent);
                answer(&line.text, now, vehicle, room).unwrap_or(Request::Nothing)
            }
            Stage::Done => {
                room.0.start_at(line.sent.saturating_sub(line.kept_at));
                _ = fmt::Write::write_str(room, &line.kept);
                Request::Nothing
            }
        };
        let (asked, from) = (line.asked, line.sent);
        let text = whole(room);
        // A part that is empty has begun within a character, of a text that has changed since the part before: its station is left waiting, and gives up.
        let is_over = room.0.is_cut() && (text.is_empty() || from > usize::from(u16::MAX));
        let is_request = !request_is_nothing(&request);
        let last = !room.0.is_cut() && !is_request;
        line.sent += text.len();
        if matches!(line.stage, Stage::Answering) && (is_request || (last && from == 0)) {
            // A part is shorter.
            _ = line.kept.push_str(text);
            (line.kept_at, line.stage) = (from, if is_request { Stage::Board } else { Stage::Done });
        }
        line.is_said = last || is_over;
        let (number, payload) = match asked {
            Asked::Cable(number) => (number, Payload::Reply { text, last }),
            Asked::Radio(number) => (0, Payload::Part { number, from: from as u16, text, last }),
        };
        Some(Answer { number, payload, request })
    }

    /// The board has done what it was asked for, or not.
    pub fn report(&mut self, what: &dyn fmt::Display) {
        if let Some(Line { stage: stage @ Stage::Board, kept, .. }) = &mut self.line {
            let mut text = String::<PIECE>::new();
            // What is too long is cut.
            _ = fmt::Write::write_fmt(&mut text, format_args!("{what}"));
            _ = kept.push_str(&text);
            *stage = Stage::Done;
        }
    }
}

fn request_is_nothing<R>(request: &Request<R>) -> bool {
    matches!(request, Request::Nothing)
}

/// What is in the room, up to its last whole character.
fn whole(room: &Room) -> &str {
    let bytes = room.0.bytes();
    match core::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            bytes.get(..error.valid_up_to()).and_then(|whole| core::str::from_utf8(whole).ok()).unwrap_or_default()
        }
    }
}

fn parameter<'r, V: Vehicle>(vehicle: &mut V, question: Question) -> Option<Payload<'r>> {
    let is_disarmed = vehicle.is_armed() == Some(false);
    let parameters = vehicle.parameters();
    let (index, taken) = match question {
        Question::Read { index } => (index, true),
        Question::Write { index, value } => {
            let may = is_disarmed || parameters.describe(index.into()).is_some_and(|info| info.in_flight);
            (index, may && parameters::set_at(parameters, index.into(), value).is_ok())
        }
    };
    // Behind the last there is none: its value is zero, and nothing was taken.
    let value = parameters.get(index.into());
    Some(Payload::Parameter { index, value: value.unwrap_or_default(), taken: taken && value.is_some() })
}
