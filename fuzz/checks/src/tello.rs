//! Commands in words, from any program that reaches a port.

use crate::Input;
use stampfly_link::tello::{TelloCommand, TelloError, TelloReply, TelloState};
use std::f32::consts::PI;

/// Numbers of a state, and then datagrams, one a line.
pub fn tello_text(data: &[u8]) {
    let mut input = Input(data);
    state(&mut input);
    for datagram in input.0.split(|byte| *byte == b'\n') {
        let parsed = TelloCommand::parse(datagram);
        if datagram.len() < TelloCommand::LONGEST {
            assert_eq!(parsed, TelloCommand::parse(&[datagram, b"\n"].concat()), "the end of a line does not matter");
        }
        match parsed {
            Ok(command) => {
                assert!(datagram.len() <= TelloCommand::LONGEST);
                limits(&command);
            }
            Err(error) => {
                assert_eq!(error == TelloError::TooLong, datagram.len() > TelloCommand::LONGEST);
                let mut bytes = [0; TelloReply::LONGEST];
                let length = TelloReply::Refused(error).write(&mut bytes).expect("there is room");
                assert!(bytes[..length].starts_with(b"error "));
            }
        }
    }
}

/// What is accepted is something that a vehicle can be told.
fn limits(command: &TelloCommand) {
    let within = |value: f32, least: f32, most: f32| {
        assert!(least * 0.999 <= value && value <= most * 1.001, "{command:?}");
    };
    match *command {
        TelloCommand::Move { distance, .. } => within(distance, 0.1, 5.0),
        TelloCommand::Rotate { angle } => within(angle.abs(), PI / 180.0, 20.0 * PI),
        TelloCommand::Go { offset, speed } => {
            within(offset.amax(), 0.05, 5.0);
            within(speed, 0.1, 1.0);
        }
        TelloCommand::Speed { speed } => within(speed, 0.1, 1.0),
        TelloCommand::Sticks { right, forward, up, clockwise } => {
            [right, forward, up, clockwise].into_iter().for_each(|stick| within(stick.abs(), 0.0, 1.0));
        }
        TelloCommand::Identify { amplitude, duration, .. } => {
            within(amplitude, 0.0, 86.0 * PI / 180.0);
            within(duration, 0.0, 10.0);
        }
        TelloCommand::Autotune { bandwidth, phase_margin, .. } => {
            bandwidth.into_iter().for_each(|bandwidth| within(bandwidth, 1.0, 100.0));
            phase_margin.into_iter().for_each(|margin| within(margin, PI / 9.0, PI / 2.25));
        }
        _ => {}
    }
}

/// Whatever the vehicle knows, the line has its sixteen values, and each of them is a number.
fn state(input: &mut Input<'_>) {
    let state = TelloState {
        attitude: input.vector(10.0),
        velocity: input.vector(1e6),
        temperature: [i16::from_le_bytes([input.byte(), input.byte()]); 2],
        below: input.number(1e4),
        height: input.number(1e4),
        battery: input.byte(),
        barometer: input.number(1e9),
        time: input.byte().into(),
        force: input.vector(1e3),
    };
    let mut bytes = [0; TelloState::LONGEST];
    let length = state.write(&mut bytes).expect("there is room");
    let line = std::str::from_utf8(&bytes[..length]).expect("text").trim_end();
    let values: Vec<_> = line.split(';').filter_map(|field| field.split_once(':')).collect();
    assert_eq!(values.len(), 16, "{line}");
    assert!(values.iter().all(|(_, value)| value.parse::<f64>().is_ok_and(f64::is_finite)), "{line}");
}
