//! What browsers and programs send to the ground station: requests as bytes, asks as text.

use stampfly_ground::ask::{Ask, Asked, Incoming, LONGEST};
use stampfly_ground::http::{Hosts, LONGEST_HEAD, Request, Wanted, refuse, request, upgrade};
use stampfly_types::messages::{GuidedCommand, PilotInput};

/// Bytes of a connection.
pub fn ground_http(data: &[u8]) {
    let [near, any] = [Hosts::Loopback, Hosts::Addresses].map(|hosts| request(data, hosts));
    match &near {
        Ok(None) => assert!(data.len() < LONGEST_HEAD, "a head without an end"),
        Ok(Some(granted)) => {
            assert_eq!(near, any, "what is near is granted anywhere");
            accepted(data, granted);
        }
        Err(refusal) => {
            let text = refuse(*refusal);
            let (head, body) = text.split_once("\r\n\r\n").expect("a head");
            assert!(head.contains(&format!("Content-Length: {}\r\n", body.len())));
            // Bytes that come later do not change a refusal.
            let more = [data, b"\r\nHost: localhost\r\n\r\n"].concat();
            assert!(request(&more, Hosts::Loopback).is_err(), "refused, then granted");
        }
    }
}

fn accepted(data: &[u8], granted: &Request) {
    assert!(granted.length <= data.len().min(LONGEST_HEAD));
    let (head, _) = data.split_at(granted.length);
    assert!(head.ends_with(b"\n"), "the head ends with a line");
    // What follows belongs to the WebSocket and means nothing here.
    assert_eq!(request(head, Hosts::Loopback).as_ref(), Ok(&Some(granted.clone())));
    match &granted.wanted {
        Wanted::Page => {}
        Wanted::Log(number) => assert!(*number < 10_000),
        Wanted::Socket(key) => assert_eq!(upgrade(key).lines().filter(|line| line.contains(':')).count(), 3),
    }
}

/// A text of a WebSocket.
pub fn ground_ask(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(incoming) = Incoming::parse(text) else { return };
    assert!(text.len() <= LONGEST);
    let Incoming::Ask(asked) = incoming else { return };
    let again = serde_json::to_string(&asked).expect("it has a JSON form");
    assert_eq!(Asked::parse(&again).as_ref(), Ok(&asked), "{again}");
    match asked.ask {
        Ask::Guided(guided) => {
            let GuidedCommand { position, yaw, speed, dwell, .. } = guided.into();
            let numbers = [position.x, position.y, position.z, yaw, speed, dwell];
            assert!(numbers.iter().all(|number| number.is_finite()), "{guided:?}");
        }
        Ask::Sticks(sticks) => {
            let input = PilotInput::from(sticks);
            assert_eq!(input.cleaned(), input);
        }
        Ask::ParamSet { value, .. } => assert!(value.is_finite()),
        Ask::MotorTest { duty, motor } => assert!((0.0..=1.0).contains(&duty) && motor > 0),
        _ => {}
    }
}
