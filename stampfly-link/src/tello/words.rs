//! Words that are arguments of commands, or stand for many of them.

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
