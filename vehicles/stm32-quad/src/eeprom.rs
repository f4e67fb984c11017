//! The original's EEPROM, byte for byte: a memory that its firmware has written is read, and what is written here it reads.
//!
//! | at | bytes | what |
//! |---|---|---|
//! | 0 | 32 | transmitter: address (5), channels (20); a first channel of FF is none |
//! | 32 | 32 | offsets: accelerometer in g (3), gyro in rad/s (3) |
//! | 64 | 96 | parameters: gains of roll, pitch, yaw (9), and eleven more |
//!
//! Numbers are IEEE 754 in single precision, little-endian, as the processor has them. The image has no checksum: each number is looked at by itself,
//! and one that is none, or outside its range, is left as it was. Where the image is kept, and that a power cut leaves the old or the new one, is the firmware's
//! matter. What the original does not have (cells, reference, frame) is not in it.

use crate::parameters::Parameters;
use stampfly_link::hisky::HiskyLink;
use stampfly_param::ParameterTable;
use stampfly_param::parameters::validate;
use stampfly_types::GRAVITY;

/// Bytes of an image.
pub const SIZE: usize = 160;
/// Where the three parts begin.
const LINK: usize = 0;
const OFFSETS: usize = 32;
const PARAMETERS: usize = 64;
/// The first channel of a vehicle that knows no transmitter; also what erased memory holds.
const NOBODY: u8 = 0xFF;

/// The parameters in the order of the image.
const ORDER: [&str; 20] = [
    "roll.p",
    "roll.i",
    "roll.d",
    "pitch.p",
    "pitch.i",
    "pitch.d",
    "yaw.p",
    "yaw.i",
    "yaw.d",
    "stick.angle_max",
    "stick.rotation_max",
    "gain.rotation",
    "gain.throttle",
    "stick.threshold",
    "battery.scale",
    "battery.warning",
    "battery.critical",
    "filter.accel",
    "filter.gyro",
    "filter.derivative",
];
const OFFSET_NAMES: [&str; 6] =
    ["offset.accel_x", "offset.accel_y", "offset.accel_z", "offset.gyro_x", "offset.gyro_y", "offset.gyro_z"];

/// What an image holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stored {
    /// The transmitter, if there is one.
    pub link: Option<HiskyLink>,
    /// The parameters, offsets included.
    pub parameters: Parameters,
}

impl Stored {
    /// Reads an image. What cannot be used is as in `otherwise`; with it the set as a whole is one that may fly.
    ///
    /// ```
    /// use stampfly_stm32_quad::{Parameters, eeprom::{SIZE, Stored}};
    /// let new = Stored { link: None, parameters: Parameters::default() };
    /// assert_eq!(Stored::read(&[0xFF; SIZE], &Parameters::default()), new, "erased");
    /// assert_eq!(Stored::read(&new.image(), &Parameters::default()), new);
    /// ```
    #[must_use]
    pub fn read(image: &[u8; SIZE], otherwise: &Parameters) -> Self {
        let mut parameters = *otherwise;
        let numbers =
            |at: usize| image.get(at..).unwrap_or_default().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
        let values = ORDER.iter().zip(numbers(PARAMETERS));
        let offsets = OFFSET_NAMES.iter().zip(numbers(OFFSETS).zip(units()).map(|(value, unit)| value * unit));
        for (name, value) in values.chain(offsets) {
            if let Ok(row) = Parameters::find(name) {
                // Refused when it is no number or out of range.
                let _ = row.set(&mut parameters, value);
            }
        }
        if validate(&parameters).is_err() {
            parameters = *otherwise;
        }
        Self { link: read_link(image), parameters }
    }

    /// Writes an image.
    #[must_use]
    pub fn image(&self) -> [u8; SIZE] {
        let mut image = [0; SIZE];
        let mut put = |at: usize, bytes: &[u8]| {
            image.iter_mut().skip(at).zip(bytes).for_each(|(place, byte)| *place = *byte);
        };
        match &self.link {
            Some(link) => {
                put(LINK, &link.address);
                put(LINK + link.address.len(), &link.hops);
            }
            None => put(LINK, &[0, 0, 0, 0, 0, NOBODY]),
        }
        let get = |name: &str| Parameters::find(name).map(|row| row.get(&self.parameters)).unwrap_or_default();
        for (n, name) in ORDER.iter().enumerate() {
            put(PARAMETERS + 4 * n, &get(name).to_le_bytes());
        }
        for (n, (name, unit)) in OFFSET_NAMES.iter().zip(units()).enumerate() {
            put(OFFSETS + 4 * n, &(get(name) / unit).to_le_bytes());
        }
        image
    }
}

/// What the image's offsets are multiplied by.
fn units() -> [f32; 6] {
    [GRAVITY, GRAVITY, GRAVITY, 1.0, 1.0, 1.0]
}

fn read_link(image: &[u8; SIZE]) -> Option<HiskyLink> {
    let (address, rest) = image.split_first_chunk::<5>()?;
    let hops = rest.first_chunk::<20>()?;
    // Channels that the radio does not have are no transmitter's.
    (hops.iter().all(|hop| *hop <= 125)).then_some(HiskyLink { address: *address, hops: *hops })
}
