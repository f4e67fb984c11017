//! A desk whose station says lines again, because the radio loses what is said: every answer is whole or has no end, and nothing is done twice.

use core::fmt;
use stampfly_bus::TopicInfo;
use stampfly_flight::console::{self, CommandError, Request, SensorLine};
use stampfly_flight::profile::Rows;
use stampfly_link::secure::Payload;
use stampfly_param::{ParameterError, ParameterInfo, Parameters};
use stampfly_services::requests::{Answer, Room, StationRequests};
use stampfly_types::Instant;

struct One(f32);
impl Parameters for One {
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
        (index == 0).then_some(ParameterInfo {
            name: "gain",
            unit: "1",
            min: 0.0,
            max: 10.0,
            meaning: "",
            in_flight: false,
        })
    }
    fn get(&self, index: usize) -> Option<f32> {
        (index == 0).then_some(self.0)
    }
    fn set(&mut self, _: usize, value: f32) -> Result<(), ParameterError> {
        self.0 = value;
        Ok(())
    }
}

#[derive(Debug, PartialEq)]
struct Save;
struct Board {
    gain: One,
    status: String,
    done: u32,
    counted: u32,
}
fn board() -> Board {
    Board { gain: One(1.0), status: String::new(), done: 0, counted: 0 }
}

const LONG: &str = "keep it level and still while it measures, which takes a few seconds; do not touch it or the table that it is on until it says so, please\r\n";

impl console::Vehicle for Board {
    type Command = &'static str;
    type Request = Save;
    const COMMANDS: &'static [(&'static str, &'static str)] = &[];
    const TOPICS: &'static [TopicInfo] = &[];
    fn is_armed(&self) -> Option<bool> {
        Some(false)
    }
    fn version(&self) -> &str {
        "1"
    }
    fn status(&self, _: Instant, reply: &mut dyn fmt::Write) -> fmt::Result {
        reply.write_str(&self.status)
    }
    fn newest(&self, _: usize) -> Option<(Instant, &[u32])> {
        None
    }
    fn sensors(&self) -> &[SensorLine<'_>] {
        &[]
    }
    fn profile(&self) -> Rows<'_> {
        Rows::default()
    }
    fn parameters(&mut self) -> &mut dyn Parameters {
        &mut self.gain
    }
    fn parse(words: &[&str]) -> Result<Self::Command, CommandError> {
        match words {
            ["accept"] => Ok("accept"),
            ["long"] => Ok("long"),
            ["count"] => Ok("count"),
            _ => Err(CommandError::Unknown),
        }
    }
    fn answer(
        &mut self,
        what: &'static str,
        _: Instant,
        reply: &mut dyn fmt::Write,
    ) -> Result<Option<Save>, fmt::Error> {
        match what {
            "accept" => reply.write_str("taken; it corrects from the next start on\r\n").map(|()| Some(Save)),
            "count" => {
                self.counted += 1;
                write!(reply, "{}\r\n", self.counted).map(|()| None)
            }
            _ => reply.write_str(LONG).map(|()| Some(Save)),
        }
    }
}

/// A station as `connect` has it, whose frames of the vehicle with these places are lost.
fn converse(board: &mut Board, line: &str, lost: &[usize], gap: bool) -> (String, bool) {
    let (mut requests, mut had, mut frame) = (StationRequests::new(), String::new(), 0);
    for turn in 0..400 {
        if turn % 15 == 0 || gap && turn % 3 == 0 {
            requests.ask(0, &Payload::Question { number: 9, from: had.len() as u16, line });
        }
        let mut room = Room::default();
        for _ in 0..2 {
            let Some(Answer { payload, request, .. }) = requests.answer(Instant::ZERO, board, &mut room) else { break };
            let Payload::Part { number: 9, from, text, last } = payload else { panic!("{payload:?}") };
            let is_lost = lost.contains(&frame);
            frame += 1;
            let mut end = false;
            if !is_lost && usize::from(from) == had.len() {
                had.push_str(text);
                end = last;
            }
            if request != Request::Nothing {
                board.done += 1;
                requests.report(&"saved");
            }
            if end {
                return (had, true);
            }
        }
    }
    (had, false)
}

#[test]
fn the_text_before_a_request_is_not_lost_with_its_frame() {
    let mut sound = board();
    let whole = converse(&mut sound, "accept", &[], false);
    assert_eq!(whole, ("taken; it corrects from the next start on\nsaved".into(), true));
    let mut lossy = board();
    let holed = converse(&mut lossy, "accept", &[0], false);
    assert_eq!((lossy.done, holed), (1, whole));
}

#[test]
fn a_text_before_a_request_that_is_too_long_to_be_kept_is_whole_or_has_no_end() {
    let whole = converse(&mut board(), "long", &[], false);
    assert!(whole.1 && whole.0.len() > 130);
    for lost in 0..3 {
        let mut lossy = board();
        let holed = converse(&mut lossy, "long", &[lost], true);
        assert_eq!(lossy.done, 1);
        assert!(holed == whole || !holed.1, "frame {lost} lost: {holed:?}");
    }
}

#[test]
fn a_line_that_changes_a_parameter_is_done_once() {
    let (mut requests, mut board, mut room) = (StationRequests::new(), board(), Room::default());
    let line = Payload::Question { number: 9, from: 0, line: "param set gain 3" };
    requests.ask(0, &line);
    while requests.answer(Instant::ZERO, &mut board, &mut room).is_some() {}
    assert_eq!(board.gain.0, 3.0);
    // The answer is lost, and a page writes a newer value meanwhile.
    requests.ask(0, &Payload::WriteParameter { index: 0, value: 5.0 });
    while requests.answer(Instant::ZERO, &mut board, &mut room).is_some() {}
    assert_eq!(board.gain.0, 5.0);
    requests.ask(0, &line);
    while requests.answer(Instant::ZERO, &mut board, &mut room).is_some() {}
    assert_eq!(board.gain.0, 5.0, "the older line was done again over the newer write");
}

#[test]
fn a_command_of_the_vehicles_own_without_a_request_is_done_once() {
    let mut board = board();
    let said = converse(&mut board, "count", &[0], false);
    assert_eq!((board.counted, said), (1, ("1\n".into(), true)));
}

#[test]
fn answers_of_every_length_and_loss_are_whole() {
    for length in (0..130).chain(236..244).chain(355..365) {
        for unit in ["a", "µ", "→", "\u{1F600}", "a\r\n", "aµ"] {
            let text: String = unit.repeat(length);
            let whole = text.replace('\r', "");
            for lost in [&[][..], &[0], &[1], &[0, 1, 3]] {
                let mut board = Board { status: text.clone(), ..board() };
                let said = converse(&mut board, "status", lost, true);
                assert_eq!(said, (whole.clone(), true), "{unit} {length} {lost:?}");
            }
        }
    }
}

#[test]
fn a_text_that_changes_between_two_parts_is_not_ended_within_a_character() {
    let (mut requests, mut room) = (StationRequests::new(), Room::default());
    let mut board = Board { status: format!("9{}", "µ".repeat(200)), ..board() };
    requests.ask(0, &Payload::Question { number: 9, from: 0, line: "status" });
    let Some(Answer { payload: Payload::Part { text, last: false, .. }, .. }) =
        requests.answer(Instant::ZERO, &mut board, &mut room)
    else {
        panic!()
    };
    assert_eq!(text.len(), 119);
    // One digit more.
    board.status = format!("10{}", "µ".repeat(200));
    let Some(Answer { payload: Payload::Part { text, last, .. }, .. }) =
        requests.answer(Instant::ZERO, &mut board, &mut room)
    else {
        panic!()
    };
    assert!(!last, "280 bytes are missing, and this is said to be the end: {text:?}");
}

#[test]
fn a_changed_line_under_the_same_number_is_not_answered_with_the_old_lines_answer() {
    let (mut requests, mut board, mut room) = (StationRequests::new(), board(), Room::default());
    requests.ask(0, &Payload::Question { number: 9, from: 0, line: "version" });
    while requests.answer(Instant::ZERO, &mut board, &mut room).is_some() {}
    let taken = requests.ask(0, &Payload::Question { number: 9, from: 0, line: "param get gain" });
    if taken {
        let Some(Answer { payload: Payload::Part { text, .. }, .. }) =
            requests.answer(Instant::ZERO, &mut board, &mut room)
        else {
            panic!()
        };
        assert!(text.contains("gain"), "{text:?} is the answer to `version`");
    }
}

#[test]
fn a_question_that_is_malicious_does_no_harm() {
    for from in [0, 1, 119, 120, 121, 1_000, u16::MAX - 1, u16::MAX] {
        for line in ["", "status", "accept", "long", "help", "param list", &"x".repeat(300)] {
            let (mut requests, mut board, mut room) =
                (StationRequests::new(), Board { status: "µ".repeat(40_000), ..board() }, Room::default());
            for number in [9, 9, 10] {
                requests.ask(0, &Payload::Question { number, from, line });
                let mut count = 0;
                while let Some(answer) = requests.answer(Instant::ZERO, &mut board, &mut room) {
                    count += 1;
                    if answer.request != Request::Nothing {
                        requests.report(&"µ".repeat(100));
                    }
                    assert!(count < 2_000);
                }
            }
        }
    }
}
