//! The two ways to a vehicle, behind one interface: a line to its cable, or sealed frames to its radio.

use super::place::{LOOK, Line, Place};
use super::sealed::{RadioPlace, Sealed};
use stampfly_link::secure::Key;
use std::fmt;
use std::io;

/// Where the vehicle is, and what it takes to speak with it there.
pub enum Way {
    /// A line, and its speed.
    Line(Place, u32),
    /// A vehicle in a network, and its key.
    Radio(RadioPlace, Key),
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(place, _) => place.fmt(f),
            Self::Radio(place, _) => place.fmt(f),
        }
    }
}

impl Way {
    pub fn open(&self) -> io::Result<Open> {
        match self {
            Self::Line(place, baud) => place.open(*baud).map(Open::Line),
            Self::Radio(place, key) => Sealed::open(place, key, LOOK).map(|sealed| Open::Radio(Box::new(sealed))),
        }
    }
}

/// The way is open.
pub enum Open {
    Line(Line),
    /// Nobody says that a vehicle is gone: it is silent.
    Radio(Box<Sealed>),
}

impl Open {
    /// What has come, after a short wait if nothing has: so many bytes.
    pub fn read(&mut self, room: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Line(line) => line.read(room),
            Self::Radio(sealed) => sealed.read(room),
        }
    }

    /// Sends.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            Self::Line(line) => line.write(bytes),
            Self::Radio(sealed) => {
                sealed.write(bytes);
                Ok(())
            }
        }
    }
}
