//! A Tello that stands on a desk: it answers programs at a UDP port and flies nowhere. To try a program with before anything can fall down.
//!
//! `cargo run -p stampfly-link --example tello -- 127.0.0.1:8889 60` listens for a minute. Without arguments it talks to itself and ends.

use stampfly_link::tello::{STATE_PORT, TelloCommand, TelloQuery, TelloReply, TelloState};
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

/// What the vehicle on the desk knows of itself.
#[derive(Default)]
struct Desk {
    listening: bool,
    state: TelloState,
}

impl Desk {
    /// `None` is no answer: sticks get none.
    fn answer(&mut self, datagram: &[u8]) -> Option<TelloReply<'static>> {
        let command = match TelloCommand::parse(datagram) {
            Ok(command) => command,
            Err(error) => return Some(TelloReply::Refused(error)),
        };
        self.listening |= command == TelloCommand::Command;
        if !self.listening {
            return Some(TelloReply::Error("not in command mode"));
        }
        Some(match command {
            TelloCommand::Sticks { .. } => return None,
            TelloCommand::TakeOff => {
                self.state.height = 0.5;
                TelloReply::Ok
            }
            TelloCommand::Land | TelloCommand::Emergency => {
                self.state.height = 0.0;
                TelloReply::Ok
            }
            TelloCommand::Query(query) => match query {
                TelloQuery::Battery => TelloReply::Number(self.state.battery.into()),
                TelloQuery::Height => TelloReply::Number((self.state.height * 100.0) as i32),
                TelloQuery::Distance => TelloReply::Distance(self.state.below),
                TelloQuery::Attitude => TelloReply::Attitude(self.state.attitude),
                TelloQuery::Acceleration => TelloReply::Acceleration(self.state.force),
                TelloQuery::SerialNumber => TelloReply::Text("DESK"),
                TelloQuery::Sdk => TelloReply::Text("20"),
                _ => TelloReply::Number(0),
            },
            TelloCommand::Other(_) => TelloReply::Error("not supported"),
            _ => TelloReply::Ok,
        })
    }
}

fn serve(socket: &UdpSocket, time: Duration) -> std::io::Result<()> {
    socket.set_read_timeout(Some(Duration::from_millis(100)))?;
    let mut desk = Desk { state: TelloState { battery: 87, below: 0.1, ..Default::default() }, ..Default::default() };
    let (end, mut program) = (Instant::now() + time, None::<SocketAddr>);
    let mut bytes = [0; TelloState::LONGEST];
    while Instant::now() < end {
        if let Ok((length, from)) = socket.recv_from(&mut bytes) {
            println!("{from}: {}", bytes[..length].escape_ascii());
            program = Some(from);
            if let Some(reply) = desk.answer(&bytes[..length]) {
                let length = reply.write(&mut bytes).expect("short answers");
                socket.send_to(&bytes[..length], from)?;
            }
        }
        if let Some(program) = program {
            let length = desk.state.write(&mut bytes).expect("there is room");
            // Nobody may be listening there.
            let _ = socket.send_to(&bytes[..length], (program.ip(), STATE_PORT));
        }
    }
    Ok(())
}

fn main() -> std::io::Result<()> {
    let mut arguments = std::env::args().skip(1);
    if let Some(address) = arguments.next() {
        let seconds = arguments.next().and_then(|seconds| seconds.parse().ok()).unwrap_or(60);
        return serve(&UdpSocket::bind(address)?, Duration::from_secs(seconds));
    }
    let mut desk = Desk::default();
    for said in ["takeoff", "command", "takeoff", "height?", "forward 5", "flip up", "rc 0 0 0 0", "land"] {
        match desk.answer(said.as_bytes()) {
            Some(reply) => println!("{said}: {reply}"),
            None => println!("{said}"),
        }
    }
    print!("{}", desk.state);
    Ok(())
}
