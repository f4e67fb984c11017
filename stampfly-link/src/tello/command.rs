//! Commands: a name and its arguments, separated by spaces.

use super::number::number;
use stampfly_types::Vec3;
use stampfly_types::messages::FlipDirection;

/// The longest command. A network's name and its password are the longest arguments.
const LONGEST: usize = 128;
const CENTI: f32 = 0.01;
const DEGREE: f32 = core::f32::consts::PI / 180.0;

/// What a program asks, lengths in m, angles in rad, times in s.
///
/// ```
/// use stampfly_link::tello::{TelloCommand, TelloDirection, TelloError};
/// let forward = TelloCommand::Move { direction: TelloDirection::Forward, distance: 0.5 };
/// assert_eq!(TelloCommand::parse(b"forward 50"), Ok(forward));
/// assert_eq!(TelloCommand::parse(b"forward fifty"), Err(TelloError::NotANumber));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum TelloCommand {
    /// `command`: from now on do what I say.
    Command,
    /// `takeoff`
    TakeOff,
    /// `land`
    Land,
    /// `emergency`: motors off now.
    Emergency,
    /// `stop`: stay where you are.
    Stop,
    /// `keepalive`: I am still here.
    KeepAlive,
    /// `up`, `down`, `left`, `right`, `forward`, `back` 10 to 500. A Tello takes no less than 20, the ecosystem's vehicle goes no farther than 300.
    Move {
        /// Which way, as the vehicle looks.
        direction: TelloDirection,
        /// How far, m.
        distance: f32,
    },
    /// `cw`, `ccw` 1 to 3600.
    Rotate {
        /// How far, rad, clockwise seen from above is positive.
        angle: f32,
    },
    /// `go x y z speed`: -500 to 500 each and 10 in all at least, 10 to 100.
    Go {
        /// Where to, forward, right and down, m. In words it is forward, left and up.
        offset: Vec3,
        /// How fast, m/s.
        speed: f32,
    },
    /// `flip l`, `r`, `f`, `b`
    Flip(FlipDirection),
    /// `speed` 10 to 100.
    Speed {
        /// How fast moves without a speed of their own are, m/s.
        speed: f32,
    },
    /// `rc a b c d`: -100 to 100 each. Sticks, until the next; not answered.
    Sticks {
        /// -1 to 1, right positive.
        right: f32,
        /// -1 to 1, forward positive.
        forward: f32,
        /// -1 to 1, up positive.
        up: f32,
        /// -1 to 1, clockwise positive.
        clockwise: f32,
    },
    /// `battery?` and others
    Query(TelloQuery),
    /// `streamon` and `streamoff`: the camera.
    Video {
        /// On.
        on: bool,
    },
    /// `sysid axis chirp|doublet amplitude duration`: shake, to find out how the vehicle answers. Up to 86 °/s and 10 s.
    Identify {
        /// Which axis.
        axis: TelloAxis,
        /// How.
        wave: TelloWave,
        /// rad/s.
        amplitude: f32,
        /// s.
        duration: f32,
    },
    /// `autotune axis [bandwidth] [phase margin]`: find gains of the rate controller. 1 to 100 rad/s, 20° to 80°.
    Autotune {
        /// Which axis.
        axis: TelloAxis,
        /// rad/s.
        bandwidth: Option<f32>,
        /// rad.
        phase_margin: Option<f32>,
    },
    /// What a Tello has and this vehicle is not likely to have. Its arguments are not looked at.
    Other(TelloOther),
}

/// Which way, as the vehicle looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TelloDirection {
    /// Up.
    Up,
    /// Down.
    Down,
    /// Left.
    Left,
    /// Right.
    Right,
    /// Forward.
    Forward,
    /// Back.
    Back,
}

/// An axis of rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TelloAxis {
    /// About x.
    Roll,
    /// About y.
    Pitch,
    /// About z.
    Yaw,
}

/// How a vehicle is shaken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TelloWave {
    /// A sine whose frequency rises.
    Chirp,
    /// One way and the other.
    Doublet,
}

/// What a program wants to know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TelloQuery {
    /// `battery?`: %.
    Battery,
    /// `height?`: cm.
    Height,
    /// `attitude?`
    Attitude,
    /// `speed?`: of moves, cm/s.
    Speed,
    /// `sn?`: the serial number.
    SerialNumber,
    /// `time?`: s in the air.
    Time,
    /// `temp?`: °C.
    Temperature,
    /// `baro?`: m.
    Barometer,
    /// `tof?`: the distance below.
    Distance,
    /// `acceleration?`
    Acceleration,
    /// `wifi?`: signal to noise.
    Wifi,
    /// `sdk?`: the version of the protocol.
    Sdk,
    /// `active?`: has it been activated?
    Active,
    /// `hardware?`: a Tello, or one with an expansion board?
    Hardware,
}

/// What a Tello has and this vehicle is not likely to have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TelloOther {
    /// `motoron` and `motoroff`: turn slowly, to cool.
    IdleMotors,
    /// `throwfly`: take off when thrown.
    ThrowToFly,
    /// `curve`: fly an arc.
    Curve,
    /// `mon`, `moff`, `mdirection`, `jump`, and `go` with a mission pad.
    MissionPad,
    /// `wifi`, `ap`: name and password of a network.
    Network,
    /// `port`: of state and video.
    Port,
    /// `reboot`
    Reboot,
    /// `setbitrate`, `setresolution`, `setfps`, `downvision`
    VideoSetting,
    /// `EXT`: for an expansion board.
    Expansion,
}

/// Why a datagram is no command, in the order it is looked for. What it says is what the program is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TelloError {
    /// More than 128 bytes.
    TooLong,
    /// Bytes that are no letters, digits, signs or spaces.
    NotText,
    /// No such command, or none at all.
    Unknown,
    /// Too few or too many arguments.
    Arguments,
    /// An argument that should be a number.
    NotANumber,
    /// An argument that should be one of some words.
    Word,
    /// A number that is too small or too large.
    Range,
}

impl core::fmt::Display for TelloError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::TooLong => "too long",
            Self::NotText => "not text",
            Self::Unknown => "unknown command",
            Self::Arguments => "wrong number of arguments",
            Self::NotANumber => "not a number",
            Self::Word => "unknown argument",
            Self::Range => "out of range",
        })
    }
}

impl core::error::Error for TelloError {}

/// Arguments of a command, taken off the front.
struct Arguments<'t>(core::str::SplitAsciiWhitespace<'t>);

impl<'t> Arguments<'t> {
    fn word(&mut self) -> Result<&'t str, TelloError> {
        self.0.next().ok_or(TelloError::Arguments)
    }

    /// A number within these limits.
    fn number(&mut self, least: f32, most: f32) -> Result<f32, TelloError> {
        let number = number(self.word()?).ok_or(TelloError::NotANumber)?;
        if least <= number && number <= most { Ok(number) } else { Err(TelloError::Range) }
    }

    fn more(&self) -> bool {
        self.0.clone().next().is_some()
    }

    fn axis(&mut self) -> Result<TelloAxis, TelloError> {
        match self.word()? {
            "roll" => Ok(TelloAxis::Roll),
            "pitch" => Ok(TelloAxis::Pitch),
            "yaw" => Ok(TelloAxis::Yaw),
            _ => Err(TelloError::Word),
        }
    }
}

impl TelloCommand {
    /// The longest command, bytes.
    pub const LONGEST: usize = LONGEST;

    /// Reads a datagram. Spaces, zeros and ends of lines around it do not matter; the case of letters does.
    ///
    /// # Errors
    /// When it is no command; nothing of it may be done then.
    pub fn parse(datagram: &[u8]) -> Result<Self, TelloError> {
        if datagram.len() > LONGEST {
            return Err(TelloError::TooLong);
        }
        let text = core::str::from_utf8(datagram).map_err(|_| TelloError::NotText)?;
        let text = text.trim_matches([' ', '\r', '\n', '\0']);
        if !text.bytes().all(|byte| byte == b' ' || byte.is_ascii_graphic()) {
            return Err(TelloError::NotText);
        }
        let mut words = Arguments(text.split_ascii_whitespace());
        let name = words.word().map_err(|_| TelloError::Unknown)?;
        if let Some(other) = Self::other(name, &words) {
            return Ok(Self::Other(other));
        }
        let command = Self::known(name, &mut words)?;
        if words.more() { Err(TelloError::Arguments) } else { Ok(command) }
    }

    fn known(name: &str, words: &mut Arguments<'_>) -> Result<Self, TelloError> {
        Ok(match name {
            "command" => Self::Command,
            "takeoff" => Self::TakeOff,
            "land" => Self::Land,
            "emergency" => Self::Emergency,
            "stop" => Self::Stop,
            "keepalive" => Self::KeepAlive,
            "streamon" => Self::Video { on: true },
            "streamoff" => Self::Video { on: false },
            "cw" => Self::Rotate { angle: words.number(1.0, 3_600.0)? * DEGREE },
            "ccw" => Self::Rotate { angle: -words.number(1.0, 3_600.0)? * DEGREE },
            "go" => {
                let mut along = || words.number(-500.0, 500.0);
                // Forward, left and up.
                let offset = Vec3::new(along()?, -along()?, -along()?);
                let speed = words.number(10.0, 100.0)?;
                if offset.norm_squared() < 100.0 {
                    return Err(TelloError::Range);
                }
                Self::Go { offset: offset * CENTI, speed: speed * CENTI }
            }
            "flip" => Self::Flip(match words.word()? {
                "l" => FlipDirection::Left,
                "r" => FlipDirection::Right,
                "f" => FlipDirection::Forward,
                "b" => FlipDirection::Back,
                _ => return Err(TelloError::Word),
            }),
            "speed" => Self::Speed { speed: words.number(10.0, 100.0)? * CENTI },
            "rc" => {
                let mut stick = || Ok(words.number(-100.0, 100.0)? * CENTI);
                Self::Sticks { right: stick()?, forward: stick()?, up: stick()?, clockwise: stick()? }
            }
            "sysid" => {
                let axis = words.axis()?;
                let wave = match words.word()? {
                    "chirp" => TelloWave::Chirp,
                    "doublet" => TelloWave::Doublet,
                    _ => return Err(TelloError::Word),
                };
                let amplitude = words.number(f32::MIN_POSITIVE, 86.0)? * DEGREE;
                Self::Identify { axis, wave, amplitude, duration: words.number(f32::MIN_POSITIVE, 10.0)? }
            }
            "autotune" => {
                let axis = words.axis()?;
                let bandwidth = words.more().then(|| words.number(1.0, 100.0)).transpose()?;
                let margin = words.more().then(|| words.number(20.0, 80.0)).transpose()?;
                Self::Autotune { axis, bandwidth, phase_margin: margin.map(|margin| margin * DEGREE) }
            }
            _ => return Self::asked(name).map(Self::Query).map_or_else(|| Self::moved(name, words), Ok),
        })
    }

    fn moved(name: &str, words: &mut Arguments<'_>) -> Result<Self, TelloError> {
        let direction = match name {
            "up" => TelloDirection::Up,
            "down" => TelloDirection::Down,
            "left" => TelloDirection::Left,
            "right" => TelloDirection::Right,
            "forward" => TelloDirection::Forward,
            "back" => TelloDirection::Back,
            _ => return Err(TelloError::Unknown),
        };
        Ok(Self::Move { direction, distance: words.number(10.0, 500.0)? * CENTI })
    }

    fn asked(name: &str) -> Option<TelloQuery> {
        Some(match name {
            "battery?" => TelloQuery::Battery,
            "height?" => TelloQuery::Height,
            "attitude?" => TelloQuery::Attitude,
            "speed?" => TelloQuery::Speed,
            "sn?" => TelloQuery::SerialNumber,
            "time?" => TelloQuery::Time,
            "temp?" => TelloQuery::Temperature,
            "baro?" => TelloQuery::Barometer,
            "tof?" => TelloQuery::Distance,
            "acceleration?" => TelloQuery::Acceleration,
            "wifi?" => TelloQuery::Wifi,
            "sdk?" => TelloQuery::Sdk,
            "active?" => TelloQuery::Active,
            "hardware?" => TelloQuery::Hardware,
            _ => return None,
        })
    }

    fn other(name: &str, words: &Arguments<'_>) -> Option<TelloOther> {
        Some(match name {
            "motoron" | "motoroff" => TelloOther::IdleMotors,
            "throwfly" => TelloOther::ThrowToFly,
            "curve" => TelloOther::Curve,
            "mon" | "moff" | "mdirection" | "jump" => TelloOther::MissionPad,
            // The fifth argument is the pad.
            "go" if words.0.clone().nth(4).is_some_and(|pad| pad.starts_with('m')) => TelloOther::MissionPad,
            "wifi" | "ap" => TelloOther::Network,
            "port" => TelloOther::Port,
            "reboot" => TelloOther::Reboot,
            "setbitrate" | "setresolution" | "setfps" | "downvision" => TelloOther::VideoSetting,
            "EXT" => TelloOther::Expansion,
            _ => return None,
        })
    }
}
