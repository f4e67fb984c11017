//! A black box read out over a terminal.

use crate::common::topics::{COUNT, Id, TOPICS};
use stampfly_flight::black_box::{BlackBox, DumpError, LogRate, Refused, Retention, dump};
use stampfly_log::ulog::{Definitions, Message as LogMessage, ParameterValue, Reader, Topic};
use stampfly_types::{Instant, Message, messages::TofData};
use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

const RETENTION: Retention = Retention { topics: &TOPICS, rate: |_| LogRate::EverySample, armed: |_, _| Some(true) };
const RANGE: usize = Id::sensor_range as usize;

fn recording() -> BlackBox<1024, COUNT> {
    let mut black_box = BlackBox::new(RETENTION);
    for n in 1..=20u32 {
        let range = TofData { distance: n as f32, ..Default::default() };
        black_box.note(RANGE, Instant::from_millis(u64::from(n)), n, &range.to_words());
    }
    black_box
}

/// Dumps with a head of several pieces, to a terminal that takes so many lines.
fn dumped(black_box: &BlackBox<1024, COUNT>, lines: usize) -> (Vec<String>, Result<(), DumpError>) {
    let topics = TOPICS.map(|info| Topic { name: info.name, fields: info.fields });
    let (mut cursor, mut text) = (black_box.begin(), Vec::new());
    let finished = dump(
        || black_box.next(&mut cursor),
        |sink, at| {
            let mut head = Definitions::start(sink, at)?;
            for n in 0..100 {
                head.parameter(&format!("parameter.{n}"), ParameterValue::Float(n as f32))?;
            }
            head.data(&topics[..])
        },
        async |line: &str| {
            if text.len() == lines {
                return Err(Refused);
            }
            text.push(line.strip_suffix("\r\n").expect("ends as terminals want it").to_owned());
            Ok(())
        },
    );
    let Poll::Ready(result) = pin!(finished).poll(&mut Context::from_waker(Waker::noop())) else {
        panic!("the terminal is always ready")
    };
    (text, result)
}

#[test]
fn the_text_is_the_log() {
    let (mut text, result) = dumped(&recording(), usize::MAX);
    assert_eq!(result, Ok(()));
    let end = text.pop().expect("a last line");
    let digits = text.concat();
    let byte = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).expect("two digits");
    let log: Vec<u8> = (0..digits.len()).step_by(2).map(byte).collect();
    assert_eq!(end, format!("end of log: {} lines, {} bytes", text.len(), log.len()));
    let messages: Vec<_> = Reader::new(&log).expect("a log").map(|message| message.expect("intact")).collect();
    let parameters = messages.iter().filter(|message| matches!(message, LogMessage::Parameter { .. })).count();
    assert_eq!(parameters, 100, "the pieces of the head fit together");
    let samples = messages.iter().filter(|message| matches!(message, LogMessage::Data { .. })).count();
    assert_eq!(samples, 20);
}

#[test]
fn an_incomplete_log_says_so() {
    let (text, result) = dumped(&recording(), 3);
    assert!(matches!(result, Err(DumpError::Refused(dumped)) if dumped.lines == 3 && dumped.bytes == 96));
    assert_eq!(text.len(), 3);
    assert_eq!(dumped(&BlackBox::new(RETENTION), 10), (vec![], Err(DumpError::Empty)));
}
