//! What the doctor can do with a vehicle and with whoever stands beside it.

use std::fmt;
use std::time::Duration;

/// The vehicle does not answer any more.
#[derive(Debug)]
pub struct Lost(pub String);

impl fmt::Display for Lost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the vehicle does not answer: {}", self.0)
    }
}

impl std::error::Error for Lost {}

/// A stick of the transmitter, named by what it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stick {
    /// The right one to the right.
    Roll,
    /// The right one forward.
    Pitch,
    /// The left one to the right.
    Yaw,
    /// The left one forward.
    Throttle,
}

impl Stick {
    /// Each.
    pub const ALL: [Self; 4] = [Self::Roll, Self::Pitch, Self::Yaw, Self::Throttle];

    /// The field of `command_pilot`, and part of the names of findings.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Roll => "roll",
            Self::Pitch => "pitch",
            Self::Yaw => "yaw",
            Self::Throttle => "throttle",
        }
    }
}

/// Something to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// Switch the vehicle on, on the floor, its nose to the north.
    PowerOn,
    /// Hold it with its right side down.
    RightSideDown,
    /// Hold it with its nose up.
    NoseUp,
    /// Put it back where it was, its nose to the north.
    PutDown,
    /// Turn it on the spot, clockwise, by a quarter. Begins when the doctor was told.
    QuarterTurn,
    /// Hold it half a metre above the floor.
    LiftHalf,
    /// Hold it a metre and a half above the floor.
    LiftHigh,
    /// Hold it level, a hand's length above the floor.
    HoldOver,
    /// Move it forward. Begins when the doctor was told.
    SlideForward,
    /// Move it to the right. Begins when the doctor was told.
    SlideRight,
    /// Hold it with its nose straight down.
    NoseDown,
    /// Press the button and hold it.
    HoldButton,
    /// Let go of it.
    ReleaseButton,
    /// Switch the transmitter on, arm switch off.
    SwitchOn,
    /// Push a stick to its end and hold it.
    Push(Stick),
    /// Let go of the sticks.
    Centre,
}

impl Act {
    /// How long it takes, where the doctor watches meanwhile.
    #[must_use]
    pub const fn moving(self) -> Option<Duration> {
        match self {
            Self::QuarterTurn | Self::SlideForward | Self::SlideRight => Some(Duration::from_secs(3)),
            _ => None,
        }
    }
}

impl fmt::Display for Act {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PowerOn => {
                "Put the vehicle on the floor, level, its nose to the north (a phone's compass is good enough), transmitter \
                 off. Plug the battery in, then USB, and leave it alone."
            }
            Self::RightSideDown => "Lift it and hold it with its right side straight down.",
            Self::NoseUp => "Hold it with its nose straight up.",
            Self::PutDown => "Put it back on the floor, level, its nose to the north, and let go.",
            Self::QuarterTurn => "Turn it on the spot by a quarter, clockwise as seen from above, within three seconds.",
            Self::LiftHalf => "Lift it level to half a metre above the floor and hold it there.",
            Self::LiftHigh => "Lift it level to a metre and a half above the floor and hold it there.",
            Self::HoldOver => "Hold it level, 30 cm above a floor with a pattern, in good light.",
            Self::SlideForward => "Move it forward by 40 cm at the same height, within three seconds.",
            Self::SlideRight => "Move it to its right by 40 cm at the same height, within three seconds.",
            Self::NoseDown => "Hold it with its nose straight down, 30 cm above the floor.",
            Self::HoldButton => "Press its button and hold it. As soon as the doctor asks for it, let go.",
            Self::ReleaseButton => "Let go of the button.",
            Self::SwitchOn => "Switch the transmitter on, its arm switch off.",
            Self::Push(Stick::Roll) => "Push the right stick to the right and hold it.",
            Self::Push(Stick::Pitch) => "Push the right stick forward and hold it.",
            Self::Push(Stick::Yaw) => "Push the left stick to the right and hold it.",
            Self::Push(Stick::Throttle) => "Push the left stick forward and hold it.",
            Self::Centre => "Let go of the sticks.",
        })
    }
}

/// Something to say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// Is the status light lit?
    Light,
    /// Has it sounded?
    Notes,
    /// Which motor turns?
    Motor,
    /// Which way round does this motor turn? From 1.
    Direction(usize),
}

impl Question {
    /// What can be answered. An answer is a place in this.
    #[must_use]
    pub const fn choices(self) -> &'static [&'static str] {
        match self {
            Self::Light | Self::Notes => &["no", "yes"],
            Self::Motor => &["none", "front right", "rear right", "rear left", "front left"],
            Self::Direction(_) => &["clockwise", "counter-clockwise"],
        }
    }
}

impl fmt::Display for Question {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Light => f.write_str(
                "Is the status light lit or blinking? It is the one on the small board with the USB socket.",
            ),
            Self::Notes => f.write_str("Did you hear notes when it started?"),
            Self::Motor => f.write_str("Which motor turns?"),
            Self::Direction(_) => f.write_str(
                "Which way does it turn, seen from above? A strip of paper that touches its shaft shows it.",
            ),
        }
    }
}

/// A vehicle, and somebody beside it.
pub trait Visit {
    /// Types a line at the vehicle's console and returns the answer.
    ///
    /// # Errors
    /// When no answer comes.
    fn ask(&mut self, line: &str) -> Result<String, Lost>;

    /// Time since the examination began.
    fn elapsed(&self) -> Duration;

    /// Waits.
    fn wait(&mut self, time: Duration);

    /// Asks somebody to do something. Returns when it is done; when it [moves](Act::moving), as it begins.
    fn please(&mut self, act: Act);

    /// Asks somebody what he sees. Returns the place in [`Question::choices`].
    fn question(&mut self, question: Question) -> usize;
}
