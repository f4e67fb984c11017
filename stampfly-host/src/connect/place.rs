//! Where a vehicle's line is: a serial port of this computer, or a TCP port that carries one.

use crate::waited::{has_only_waited, wait_again, wait_at_most};
use serialport::{SerialPort, SerialPortBuilder};
use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::str::FromStr;
use std::time::Duration;

/// A look at the line waits so long for bytes: half of the time between two sticks of a page.
pub(super) const LOOK: Duration = Duration::from_millis(10);
/// Whoever takes nothing for this long is not there any more.
const STUCK: Duration = Duration::from_millis(500);
/// A connection is there by then.
const CONNECTED: Duration = Duration::from_secs(2);

/// Where a vehicle's line is.
///
/// ```
/// use stampfly_host::connect::Place;
/// assert_eq!("/dev/ttyACM0".parse(), Ok(Place::Serial("/dev/ttyACM0".into())));
/// assert_eq!("tcp:localhost:5763".parse(), Ok(Place::Tcp("localhost:5763".into())));
/// assert!("tcp:5763".parse::<Place>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A serial port, or a pseudo-terminal.
    Serial(String),
    /// Host and port.
    Tcp(String),
}

/// The text says no place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlaceError(String);

impl fmt::Display for PlaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "'{}' is neither a serial port nor tcp:HOST:PORT", self.0)
    }
}

impl std::error::Error for PlaceError {}

impl FromStr for Place {
    type Err = PlaceError;

    fn from_str(text: &str) -> Result<Self, PlaceError> {
        let wrong = || PlaceError(text.to_owned());
        match text.strip_prefix("tcp:") {
            None if text.is_empty() => Err(wrong()),
            None => Ok(Self::Serial(text.to_owned())),
            Some(address) => {
                let (host, port) = address.rsplit_once(':').ok_or_else(wrong)?;
                let is_one = !host.is_empty() && port.parse::<u16>().is_ok();
                if is_one { Ok(Self::Tcp(address.to_owned())) } else { Err(wrong()) }
            }
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(path) => f.write_str(path),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
        }
    }
}

impl Place {
    /// Opens it. USB has no speed, and takes any; a UART has its own.
    ///
    /// # Errors
    /// When nothing is there, or somebody else has it.
    pub fn open(&self, baud: u32) -> io::Result<Line> {
        match self {
            Self::Serial(path) => {
                // Its two other wires are left as they are: an ESP32-S3 restarts, or starts its boot loader, by them.
                let is_real = !is_pseudo_terminal(path);
                // macOS refuses to set the speed of a pseudo-terminal; 0 leaves it as it is.
                let baud = if is_real || !cfg!(target_os = "macos") { baud } else { 0 };
                // A pseudo-terminal is held by the program that made it; no other port has two
                // users.
                Ok(Line::Serial(open(serialport::new(path, baud).timeout(STUCK), is_real)?))
            }
            Self::Tcp(address) => {
                let mut last = io::Error::from(ErrorKind::NotFound);
                for place in address.to_socket_addrs()? {
                    match TcpStream::connect_timeout(&place, CONNECTED) {
                        Ok(stream) => {
                            stream.set_nodelay(true)?;
                            stream.set_write_timeout(Some(STUCK))?;
                            return Ok(Line::Tcp(stream));
                        }
                        Err(error) => last = error,
                    }
                }
                Err(last)
            }
        }
    }
}

/// Does a program of this computer hold the other end? Linux names them `/dev/pts/3`, macOS
/// `/dev/ttys003`; its real ports are called `/dev/tty.*` and `/dev/cu.*`.
fn is_pseudo_terminal(path: &str) -> bool {
    ["/dev/pts/", "/dev/ttys"].iter().any(|begin| path.starts_with(begin))
}

#[cfg(unix)]
fn open(port: SerialPortBuilder, alone: bool) -> io::Result<Box<dyn SerialPort>> {
    Ok(port.exclusive(alone).open()?)
}

#[cfg(not(unix))]
fn open(port: SerialPortBuilder, _: bool) -> io::Result<Box<dyn SerialPort>> {
    Ok(port.open()?)
}

/// An open line.
pub enum Line {
    /// A serial port.
    Serial(Box<dyn SerialPort>),
    /// A connection.
    Tcp(TcpStream),
}

impl fmt::Debug for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Line")
    }
}

impl Line {
    /// What has come, after a short wait if nothing has: so many bytes.
    ///
    /// # Errors
    /// When the line is gone.
    pub fn read(&mut self, room: &mut [u8]) -> io::Result<usize> {
        let read = match self {
            Self::Serial(port) => {
                port.set_timeout(LOOK)?;
                port.read(room)
            }
            Self::Tcp(stream) => {
                wait_at_most(stream, LOOK)?;
                let read = stream.read(room);
                wait_again(stream)?;
                read
            }
        };
        match read {
            // A connection that was closed, a device that was pulled out.
            Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
            // A signal is no fault of the line's.
            Err(error) if has_only_waited(&error) => Ok(0),
            other => other,
        }
    }

    /// Sends.
    ///
    /// # Errors
    /// When the line is gone, or nobody takes it.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            Self::Serial(port) => {
                port.set_timeout(STUCK)?;
                port.write_all(bytes)
            }
            Self::Tcp(stream) => stream.write_all(bytes),
        }
    }
}
