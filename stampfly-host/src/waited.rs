//! Reads and writes that wait for a limited time: which of their errors mean that nothing has
//! happened in that time, and reads that wait for less than half a second on Windows too.

use std::io::{self, Error, ErrorKind};
use std::net::{TcpStream, UdpSocket};
use std::time::{Duration, Instant};

/// Time between two looks.
const NAP: Duration = Duration::from_millis(1);

/// Has it only waited? Systems name that differently, and a computer that wakes up from sleep, or a program that goes on after it
/// was stopped, finds its reads interrupted (`man 7 signal`, "Interruption of system calls and library functions by stop signals").
pub(crate) fn has_only_waited(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

/// What streams and datagrams have in common.
pub(crate) trait Socket {
    fn set_read_timeout(&self, time: Option<Duration>) -> io::Result<()>;
    fn set_nonblocking(&self, nonblocking: bool) -> io::Result<()>;
    fn peek(&self, room: &mut [u8]) -> io::Result<usize>;
}

macro_rules! socket {
    ($($type:ty),*) => {
        $(impl Socket for $type {
            fn set_read_timeout(&self, time: Option<Duration>) -> io::Result<()> {
                self.set_read_timeout(time)
            }
            fn set_nonblocking(&self, nonblocking: bool) -> io::Result<()> {
                self.set_nonblocking(nonblocking)
            }
            fn peek(&self, room: &mut [u8]) -> io::Result<usize> {
                self.peek(room)
            }
        })*
    };
}

socket!(TcpStream, UdpSocket);

/// Limits how long the next read of a socket waits.
///
/// Windows takes half a second for every shorter timeout of a socket (`SO_RCVTIMEO`). There, this
/// function waits instead, and no read or write waits until [`wait_again`].
///
/// # Errors
/// When the system refuses it, for example because the connection is closed.
pub(crate) fn wait_at_most(socket: &impl Socket, time: Duration) -> io::Result<()> {
    if cfg!(windows) { ask_for(socket, time) } else { socket.set_read_timeout(Some(time)) }
}

/// Lets writes wait again, after a read.
///
/// # Errors
/// As [`wait_at_most`].
pub(crate) fn wait_again(socket: &impl Socket) -> io::Result<()> {
    if cfg!(windows) { socket.set_nonblocking(false) } else { Ok(()) }
}

/// Looks for something to read, data or an error, until there is some or the time is over.
fn ask_for(socket: &impl Socket, time: Duration) -> io::Result<()> {
    socket.set_nonblocking(true)?;
    let begun = Instant::now();
    while socket.peek(&mut [0]).is_err_and(|error| has_only_waited(&error)) && begun.elapsed() < time {
        std::thread::sleep(NAP);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read as _, Write as _};
    use std::net::TcpListener;

    const LONG: Duration = Duration::from_secs(20);

    #[test]
    fn a_socket_is_asked_until_something_comes_or_the_time_is_over() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let mut there = TcpStream::connect(listener.local_addr().expect("an address")).expect("it listens");
        let (mut here, _) = listener.accept().expect("a connection");
        let (begun, mut room) = (Instant::now(), [0; 4]);
        ask_for(&here, Duration::from_millis(50)).expect("a socket");
        assert!(begun.elapsed() >= Duration::from_millis(50));
        assert!(here.read(&mut room).is_err_and(|error| has_only_waited(&error)), "nothing has come");
        there.write_all(b"come").expect("sent");
        ask_for(&here, LONG).expect("a socket");
        assert_eq!((here.read(&mut room).expect("bytes"), room), (4, *b"come"));
        drop(there);
        ask_for(&here, LONG).expect("a socket");
        assert_eq!(here.read(&mut room).expect("the end"), 0);
        assert!(begun.elapsed() < LONG);
    }

    #[test]
    fn a_datagram_is_there_whole_after_it_was_asked_for() {
        let [here, there] = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").expect("a port"));
        there.send_to(b"datagram", here.local_addr().expect("an address")).expect("sent");
        ask_for(&here, LONG).expect("a socket");
        let mut room = [0; 16];
        assert_eq!(here.recv(&mut room).expect("a datagram"), 8);
    }
}
