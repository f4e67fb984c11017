//! Configuration of an INA3221 and its driver: channels, shunts, averaging. The register codes are
//! in [`codec`](super::codec).

/// Configuration of the chip and the driver.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Channel of [`PowerMonitor::next`](crate::PowerMonitor::next) and of the self test: the
    /// battery's.
    pub channel: Channel,
    /// Resistance of each channel's shunt, Ω; `None` for a channel that is not measured. Each
    /// measured channel lengthens the time per sample.
    pub shunts_ohms: [Option<f32>; 3],
    /// Number of conversions per sample and channel.
    pub average: Average,
    /// Time of one conversion, for shunt and bus.
    pub time: ConversionTime,
}

impl Config {
    /// Resistance of a channel's shunt, Ω; `None` for a channel that is not measured.
    #[must_use]
    pub const fn shunt(&self, channel: Channel) -> Option<f32> {
        let [one, two, three] = self.shunts_ohms;
        match channel {
            Channel::One => one,
            Channel::Two => two,
            Channel::Three => three,
        }
    }
}

impl Default for Config {
    /// For the StampFly: 0.01 Ω on channel 2 (R12 of its schematic), 64 times 588 µs, which gives a
    /// sample every 75 ms.
    fn default() -> Self {
        Self {
            channel: Channel::Two,
            shunts_ohms: [None, Some(0.01), None],
            average: Average::A64,
            time: ConversionTime::Us588,
        }
    }
}

/// Pair of pins to which a shunt is connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Channel {
    One,
    Two,
    Three,
}

impl Channel {
    /// All channels in the chip's order.
    pub const ALL: [Self; 3] = [Self::One, Self::Two, Self::Three];
}

/// Number of conversions averaged into one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
