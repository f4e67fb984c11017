//! The key of a vehicle: with it MAVLink is signed at ports that others can reach, and frames are sealed.

use stampfly_link::secure;
use stampfly_sim::vehicle::Signing;
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Signatures count time from 2015, in units of 10 µs.
const EPOCH: Duration = Duration::from_secs(1_420_070_400);
/// The number of a key that has none: the firmware gives its own this one.
const KEY_ID: u8 = 1;

/// A key. Is not printed.
///
/// ```
/// use stampfly_host::serve::Key;
/// let folder = std::env::temp_dir();
/// let file = folder.join("stampfly-example-key");
/// std::fs::write(&file, "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f\n")?;
/// let key = Key::read(&file)?;
/// assert_eq!(key.signing().key, core::array::from_fn(|index| index as u8));
/// assert_eq!(format!("{key:?}"), "Key");
/// # std::fs::remove_file(&file)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, PartialEq, Eq)]
pub struct Key {
    bytes: [u8; 32],
    id: u8,
    everywhere: bool,
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key")
    }
}

/// A file has no key.
#[derive(Debug)]
pub struct KeyError {
    path: PathBuf,
    /// `None` when it can be read and is no key.
    error: Option<std::io::Error>,
}

impl fmt::Display for KeyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.path.display();
        match &self.error {
            Some(error) => write!(f, "{path}: {error}"),
            None => write!(
                f,
                "{path}: a key is 64 hexadecimal digits, or the text that a vehicle's 'key' shows; 'openssl rand -hex 32 > {path}' makes one"
            ),
        }
    }
}

impl std::error::Error for KeyError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.error.as_ref().map(|error| error as _)
    }
}

impl Key {
    /// Reads a file whose first word is the key, as digits or as the text that a vehicle's `key` shows: what comes after it, as `sha256sum` writes a name, is passed over.
    ///
    /// # Errors
    /// When it cannot be read, or is no key.
    pub fn read(path: &Path) -> Result<Self, KeyError> {
        let failed = |error| KeyError { path: path.to_owned(), error };
        let text = std::fs::read_to_string(path).map_err(|error| failed(Some(error)))?;
        Self::parse(text.split_whitespace().next().unwrap_or_default()).ok_or_else(|| failed(None))
    }

    fn parse(digits: &str) -> Option<Self> {
        if let Ok(key) = secure::Key::from_uri(digits) {
            return Some(Self { bytes: *key.bytes(), id: key.id(), everywhere: false });
        }
        let mut key = [0; 32];
        if digits.len() != 2 * key.len() || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            return None;
        }
        for (place, byte) in key.iter_mut().enumerate() {
            *byte = u8::from_str_radix(digits.get(2 * place..2 * place + 2)?, 16).ok()?;
        }
        Some(Self { bytes: key, id: KEY_ID, everywhere: false })
    }

    /// The same, which is asked for at the ports of this machine, too.
    #[must_use]
    pub const fn everywhere(self, everywhere: bool) -> Self {
        Self { everywhere, ..self }
    }

    /// Is it asked for at the ports of this machine, too?
    #[must_use]
    pub const fn is_everywhere(&self) -> bool {
        self.everywhere
    }

    /// The same for sealed frames.
    ///
    /// # Errors
    /// When all its bytes are the same.
    pub fn sealing(&self) -> Result<secure::Key, secure::KeyError> {
        secure::Key::generate(self.id, self.bytes)
    }

    /// The key, and the present time.
    #[must_use]
    pub fn signing(&self) -> Signing {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().saturating_sub(EPOCH);
        Signing { key: self.bytes, time: (since.as_micros() / 10) as u64 }
    }
}

#[cfg(test)]
mod tests {
    use super::Key;
    use stampfly_link::secure;

    #[test]
    fn what_a_vehicle_shows_is_its_key() {
        let shown = secure::Key::generate(7, core::array::from_fn(|place| place as u8)).expect("random enough");
        let key = Key::parse(&shown.uri().to_string()).expect("a key");
        let sealing = key.sealing().expect("a key");
        assert_eq!((sealing.id(), sealing.bytes()), (7, shown.bytes()));
        assert_eq!(key.signing().key, *shown.bytes());
    }

    #[test]
    fn a_key_has_64_hexadecimal_digits_and_nothing_else_is_one() {
        assert!(Key::parse(&"aB".repeat(32)).is_some());
        for wrong in ["", "ab", &"ab".repeat(31), &"ab".repeat(33), &"xy".repeat(32), &"+1".repeat(32), &"é".repeat(32)]
        {
            assert_eq!(Key::parse(wrong), None, "{wrong}");
        }
    }
}
