//! The vehicle's console over a serial port: a line is typed, the answer is what comes up to the next prompt.

use super::visit::Lost;
use crate::waited::has_only_waited;
use serialport::{SerialPortInfo, SerialPortType};
use std::io;
use std::time::{Duration, Instant};

/// What the vehicle writes when it is ready for the next line.
const PROMPT: &str = "> ";
/// A port waits so long for bytes.
const PATIENCE: Duration = Duration::from_millis(50);
/// So often a port is asked again before the vehicle counts as lost: 3 s on a real one.
const TRIES: u32 = 60;

/// Bytes to and from a console.
pub trait Port {
    /// Sends bytes.
    ///
    /// # Errors
    /// When the port is gone.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// What has come since; empty when nothing came for some time.
    ///
    /// # Errors
    /// When the port is gone.
    fn receive(&mut self) -> io::Result<String>;
}

/// Types a line and returns the answer, without the echo and the prompt.
///
/// # Errors
/// When no prompt comes.
pub fn ask(port: &mut impl Port, line: &str) -> Result<String, Lost> {
    let lost = |error: io::Error| Lost(error.to_string());
    port.send(format!("{line}\r").as_bytes()).map_err(lost)?;
    let mut said = String::new();
    for _ in 0..TRIES {
        said += &port.receive().map_err(lost)?;
        if let Some(answer) = answer(&said, line) {
            return Ok(answer.to_owned());
        }
    }
    Err(Lost(format!("no prompt after '{line}'")))
}

/// The answer in what was said, when it is complete: after the echo of the line, up to the prompt.
fn answer<'s>(said: &'s str, line: &str) -> Option<&'s str> {
    let from = said.find(line)? + line.len();
    let rest = said.get(from..)?.trim_start_matches(['\r', '\n']);
    let rest = rest.strip_suffix(PROMPT)?;
    (rest.is_empty() || rest.ends_with('\n')).then_some(rest)
}

/// A serial port of this computer.
pub struct Serial {
    path: String,
    port: Box<dyn serialport::SerialPort>,
}

impl Serial {
    /// Opens a port, for up to this long: a vehicle that starts has none yet.
    ///
    /// # Errors
    /// When there is no such port, or it may not be opened.
    pub fn open(path: &str, patience: Duration) -> Result<Self, Lost> {
        let begun = Instant::now();
        loop {
            // USB needs no speed; the number is what other tools show.
            match serialport::new(path, 115_200).timeout(PATIENCE).open() {
                Ok(port) => return Ok(Self { path: path.to_owned(), port }),
                Err(error) if begun.elapsed() > patience => return Err(Lost(format!("{path}: {error}"))),
                Err(_) => std::thread::sleep(PATIENCE),
            }
        }
    }

    /// The ports that look like a vehicle's: the ESP32-S3's own USB.
    #[must_use]
    pub fn candidates() -> Vec<String> {
        let ports = serialport::available_ports().unwrap_or_default();
        ports.into_iter().filter(looks_like_one).map(|port| port.port_name).collect()
    }
}

/// Linux has `/dev/ttyACM0`. macOS has two names for it: `/dev/tty.usbmodem1` waits for a carrier,
/// `/dev/cu.usbmodem1` does not. Windows has `COM5`, and calls the ports of the mainboard alike.
fn looks_like_one(port: &SerialPortInfo) -> bool {
    let is_usb = matches!(port.port_type, SerialPortType::UsbPort(_));
    let name = port.port_name.as_str();
    name.contains("ttyACM") || name.starts_with("/dev/cu.usbmodem") || (name.starts_with("COM") && is_usb)
}

impl Port for Serial {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.write_all(bytes)
    }

    fn receive(&mut self) -> io::Result<String> {
        let mut bytes = [0; 1024];
        match self.port.read(&mut bytes) {
            Ok(count) => Ok(String::from_utf8_lossy(bytes.get(..count).unwrap_or_default()).into_owned()),
            Err(error) if has_only_waited(&error) => Ok(String::new()),
            Err(error) => Err(io::Error::new(error.kind(), format!("{}: {error}", self.path))),
        }
    }
}

/// The same bytes, for hardware in the loop.
impl stampfly_sim::vehicle::Port for Serial {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        self.port.set_timeout(patience.min(PATIENCE))?;
        match self.port.read(buffer) {
            Err(error) if has_only_waited(&error) => Ok(0),
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serialport::UsbPortInfo;

    #[test]
    fn an_answer_ends_at_the_prompt_and_begins_after_the_echo() {
        assert_eq!(answer("status\r\nIdleGround\r\n> ", "status"), Some("IdleGround\r\n"));
        assert_eq!(answer("> > \r\npair\r\n> ", "pair"), Some(""));
        for unfinished in ["sta", "status\r\n", "status\r\nIdle", "status\r\na > b > "] {
            assert_eq!(answer(unfinished, "status"), None, "{unfinished}");
        }
    }

    #[test]
    fn one_vehicle_is_one_port_on_every_system() {
        let usb = || {
            let (vid, pid) = (0x303A, 0x1001);
            SerialPortType::UsbPort(UsbPortInfo { vid, pid, serial_number: None, manufacturer: None, product: None })
        };
        let look =
            |port_name: &str, port_type| looks_like_one(&SerialPortInfo { port_name: port_name.into(), port_type });
        assert!(look("/dev/ttyACM0", usb()) && look("/dev/cu.usbmodem1101", usb()) && look("COM5", usb()));
        let unknown = SerialPortType::Unknown;
        for other in ["/dev/tty.usbmodem1101", "/dev/ttyS0", "/dev/cu.Bluetooth-Incoming-Port", "COM1"] {
            assert!(!look(other, unknown.clone()), "{other}");
        }
    }

    struct Slow(Vec<&'static str>);

    impl Port for Slow {
        fn send(&mut self, _: &[u8]) -> io::Result<()> {
            Ok(())
        }
        fn receive(&mut self) -> io::Result<String> {
            Ok(if self.0.is_empty() { String::new() } else { self.0.remove(0).to_owned() })
        }
    }

    #[test]
    fn an_answer_may_come_in_parts_or_not_at_all() {
        let answered = ask(&mut Slow(vec!["vers", "", "ion\r\n1.", "0\r\n", "> "]), "version");
        assert_eq!(answered.ok().as_deref(), Some("1.0\r\n"));
        assert!(ask(&mut Slow(vec!["version\r\n1.0"]), "version").is_err());
    }
}
