//! What an INA3221 and its driver are told: channel, shunt, averages. How the registers say it is in
//! [`codec`](super::codec).

/// What the chip and the driver are told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Where the shunt is.
    pub channel: Channel,
    /// Resistance of the shunt, Ω.
    pub shunt_ohms: f32,
    /// Conversions in a sample.
    pub average: Average,
    /// Time of one conversion, of shunt and bus alike.
    pub time: ConversionTime,
}

impl Default for Config {
    /// The StampFly's: 0.01 Ω on channel 2 (R12 of its schematic); 64 times 588 µs, a sample every 75 ms.
    fn default() -> Self {
        Self { channel: Channel::Two, shunt_ohms: 0.01, average: Average::A64, time: ConversionTime::Us588 }
    }
}

/// Which pair of pins the shunt is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Channel {
    One,
    Two,
    Three,
}

/// Conversions averaged into one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Average {
    A1,
    A4,
    A16,
    A64,
    A128,
    A256,
    A512,
    A1024,
}

/// Time of one conversion, µs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum ConversionTime {
    Us140,
    Us204,
    Us332,
    Us588,
    Us1100,
    Us2116,
    Us4156,
    Us8244,
}
