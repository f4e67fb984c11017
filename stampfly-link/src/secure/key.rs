//! A key that vehicle and station share, and its form as text, to be handed over by USB or as a QR
//! code.
//!
//! `stampfly://key?id=7&key=HEX&sum=HEX`: the number of the key, its 32 bytes, and the CRC-32 (IEEE
//! 802.3) of number and bytes, most significant digit first. All digits are lower case, nothing may
//! be left out, and nothing may follow.
//!
//! A key never goes over the air. Nobody needs to type it; the checksum is for a line that was cut
//! off. What can be printed is [`Key::uri`] alone: `Debug` prints the number, and no error contains
//! what was read.

use super::cipher::{KEY, Secret};
use crate::datagram::crc32;
use core::fmt;

const BEFORE: &str = "stampfly://key?id=";
const KEY_WORD: &str = "&key=";
const SUM_WORD: &str = "&sum=";

/// What is signed in MAVLink is signed with a key that is made for it.
const MAVLINK: &[u8; 16] = b"stampfly-mavlink";

/// Why something is no key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum KeyError {
    /// All bytes are the same: what made them is no generator of random numbers.
    NotRandom,
    /// The text does not begin as a key's, a part is missing, or something follows.
    Form,
    /// The number of the key is none from 0 to 255.
    Id,
    /// A digit that is none.
    Digit,
    /// Not what was printed.
    Checksum,
}

impl fmt::Display for KeyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotRandom => "the bytes are not random",
            Self::Form => "not the form of a key",
            Self::Id => "the number of the key is none from 0 to 255",
            Self::Digit => "not a hexadecimal digit",
            Self::Checksum => "wrong checksum",
        })
    }
}

impl core::error::Error for KeyError {}

/// 32 bytes that vehicle and station share, and a number to tell keys apart.
///
/// ```
/// use stampfly_link::secure::{Key, KeyError};
/// # let random = core::array::from_fn(|place| place as u8);
/// // 32 bytes of the vehicle's generator of random numbers.
/// let key = Key::generate(7, random)?;
/// let text = format!("{}", key.uri());
/// assert!(text.starts_with("stampfly://key?id=7&key=00010203"));
/// assert_eq!(Key::from_uri(&text)?.id(), 7);
/// assert_eq!(format!("{key:?}"), "Key { id: 7, bytes: (secret) }");
/// assert_eq!(Key::from_uri(&text.replace("id=7", "id=8")).err(), Some(KeyError::Checksum));
/// # Ok::<(), KeyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Key {
    id: u8,
    bytes: Secret,
}

impl Key {
    /// A key of bytes of a generator of random numbers; an ESP32's is one only while its radio is
    /// on. Give every station a key and a number of its own.
    ///
    /// # Errors
    /// When all bytes are the same.
    pub fn generate(id: u8, random: [u8; KEY]) -> Result<Self, KeyError> {
        let bytes = Secret::new(random);
        let [first, rest @ ..] = bytes.bytes();
        if rest.iter().all(|byte| byte == first) { Err(KeyError::NotRandom) } else { Ok(Self { id, bytes }) }
    }

    /// Reads a key from its text. White space around it is not looked at.
    ///
    /// # Errors
    /// When it is none.
    pub fn from_uri(text: &str) -> Result<Self, KeyError> {
        let rest = text.trim().strip_prefix(BEFORE).ok_or(KeyError::Form)?;
        // No search for a word in a text: what the library has for that may panic, for all a linker
        // knows.
        let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
        let (id, rest) = rest.split_at_checked(digits).ok_or(KeyError::Form)?;
        let rest = rest.strip_prefix(KEY_WORD).ok_or(KeyError::Form)?;
        let (key, rest) = rest.split_at_checked(2 * KEY).ok_or(KeyError::Form)?;
        let sum = rest.strip_prefix(SUM_WORD).ok_or(KeyError::Form)?;
        if id.is_empty() || (id.len() > 1 && id.starts_with('0')) {
            return Err(KeyError::Id);
        }
        let id = id.parse().map_err(|_| KeyError::Id)?;
        let key = Self::generate(id, hexadecimal(key)?)?;
        if hexadecimal::<4>(sum)? == key.sum() { Ok(key) } else { Err(KeyError::Checksum) }
    }

    /// The number of the key.
    #[must_use]
    pub const fn id(&self) -> u8 {
        self.id
    }

    /// The key as text, for who may know it.
    #[must_use]
    pub const fn uri(&self) -> Uri<'_> {
        Uri(self)
    }

    /// The bytes, to be stored where no log and no console reads.
    #[must_use]
    pub const fn bytes(&self) -> &[u8; KEY] {
        self.bytes.bytes()
    }

    /// A key for one other purpose: who knows it knows neither this one nor that of another
    /// purpose.
    ///
    /// ```
    /// use stampfly_link::secure::Key;
    /// # let key = Key::generate(7, core::array::from_fn(|place| place as u8))?;
    /// assert_ne!(key.purpose(b"a page's address"), key.purpose(b"signs of MAVLink"));
    /// # Ok::<(), stampfly_link::secure::KeyError>(())
    /// ```
    #[must_use]
    pub fn purpose(&self, label: &[u8; 16]) -> [u8; KEY] {
        *self.bytes.derive(*label).bytes()
    }

    /// The pass-phrase of stations that speak MAVLink: 64 digits, to be typed or pasted where a
    /// ground station asks for one. Who knows it can [sign](crate::mavlink::signing) and not seal.
    #[must_use]
    pub fn phrase(&self) -> Phrase {
        let mut digits = [0; 2 * KEY];
        for (pair, byte) in digits.as_chunks_mut::<2>().0.iter_mut().zip(self.purpose(MAVLINK)) {
            *pair = [byte >> 4, byte & 0xF].map(|digit| if digit < 10 { b'0' + digit } else { b'a' + digit - 10 });
        }
        Phrase(digits)
    }

    pub(super) const fn secret(&self) -> &Secret {
        &self.bytes
    }

    fn sum(&self) -> [u8; 4] {
        crc32(core::iter::once(&self.id).chain(self.bytes.bytes())).to_be_bytes()
    }
}

/// The text of a [`Key`]: the one thing that prints it.
pub struct Uri<'k>(&'k Key);

impl fmt::Display for Uri<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{BEFORE}{}{KEY_WORD}", self.0.id)?;
        self.0.bytes.bytes().iter().try_for_each(|byte| write!(f, "{byte:02x}"))?;
        f.write_str(SUM_WORD)?;
        self.0.sum().iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// The pass-phrase of a [`Key`] for stations that speak MAVLink: 64 hexadecimal digits.
pub struct Phrase([u8; 2 * KEY]);

impl Phrase {
    /// The digits.
    #[must_use]
    pub fn as_str(&self) -> &str {
        // They are.
        core::str::from_utf8(&self.0).unwrap_or_default()
    }
}

impl fmt::Display for Phrase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Exactly so many bytes.
fn hexadecimal<const N: usize>(text: &str) -> Result<[u8; N], KeyError> {
    let (pairs, rest) = text.as_bytes().as_chunks::<2>();
    if pairs.len() != N || !rest.is_empty() {
        return Err(KeyError::Form);
    }
    let mut bytes = [0; N];
    for (byte, [high, low]) in bytes.iter_mut().zip(pairs) {
        *byte = digit(*high)? << 4 | digit(*low)?;
    }
    Ok(bytes)
}

fn digit(text: u8) -> Result<u8, KeyError> {
    match text {
        b'0'..=b'9' => Ok(text - b'0'),
        b'a'..=b'f' => Ok(text - b'a' + 10),
        _ => Err(KeyError::Digit),
    }
}
