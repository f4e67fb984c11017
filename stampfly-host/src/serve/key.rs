//! The key of a vehicle: with it MAVLink is signed at ports that others can reach, and frames are
//! sealed.

use stampfly_link::secure;
use stampfly_sim::vehicle::Signing;
use std::fmt;
use std::io::Write as _;
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
/// let file = folder.join(format!("stampfly-example-key-{}", std::process::id()));
/// let key = Key::create(&file)?;
/// assert!(Key::read(&file)? == key && key.phrase().len() == 64);
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
    why: Why,
}

#[derive(Debug)]
enum Why {
    Failed(std::io::Error),
    /// It can be read, and is no key.
    NoKey,
    /// Other accounts of this machine can read it.
    Open,
}

impl fmt::Display for KeyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.path.display();
        match &self.why {
            Why::Failed(error) => write!(f, "{path}: {error}"),
            Why::Open => {
                write!(f, "{path}: other accounts of this machine can read the key; 'chmod 600 {path}' closes it")
            }
            Why::NoKey => write!(
                f,
                "{path}: a key is 64 random hexadecimal digits and nothing else, or the text that a vehicle's 'key' shows; \
                 'stampfly key new {path}' makes one. The hash of a phrase is none: phrases can be guessed"
            ),
        }
    }
}

impl std::error::Error for KeyError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &self.why {
            Why::Failed(error) => Some(error),
            Why::NoKey | Why::Open => None,
        }
    }
}

impl Key {
    /// Reads a file with nothing but the key, as digits or as the text that a vehicle's `key`
    /// shows.
    ///
    /// # Errors
    /// When it cannot be read, when it can be read by others, or is no key.
    pub fn read(path: &Path) -> Result<Self, KeyError> {
        let failed = |why| KeyError { path: path.to_owned(), why };
        let text = std::fs::read_to_string(path).map_err(|error| failed(Why::Failed(error)))?;
        if is_open(path).map_err(|error| failed(Why::Failed(error)))? {
            return Err(failed(Why::Open));
        }
        Self::parse(text.trim()).ok_or_else(|| failed(Why::NoKey))
    }

    /// Makes a key of the system's random numbers, and a file for it that no other account can
    /// read. A file that is there already is kept.
    ///
    /// # Errors
    /// When there is one already, or it cannot be made.
    pub fn create(path: &Path) -> std::io::Result<Self> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes).map_err(std::io::Error::other)?;
        let mut options = std::fs::OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        writeln!(options.open(path)?, "{digits}")?;
        Ok(Self { bytes, id: KEY_ID, everywhere: false })
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
        let key = Self { bytes: key, id: KEY_ID, everywhere: false };
        // One whose bytes are all the same is none.
        key.sealing().is_ok().then_some(key)
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

    /// The end of the page's address, where others can reach it.
    #[must_use]
    pub fn page_secret(&self) -> String {
        let secret = self.sealing().map(|key| key.purpose(b"stampfly-webpage")).unwrap_or_default();
        secret.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The same for sealed frames.
    ///
    /// # Errors
    /// When all its bytes are the same.
    pub fn sealing(&self) -> Result<secure::Key, secure::KeyError> {
        secure::Key::generate(self.id, self.bytes)
    }

    /// The pass-phrase of stations that speak MAVLink.
    #[must_use]
    pub fn phrase(&self) -> String {
        self.sealing().map(|key| key.phrase().as_str().to_owned()).unwrap_or_default()
    }

    /// The key, and the present time.
    #[must_use]
    pub fn signing(&self) -> Signing {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().saturating_sub(EPOCH);
        Signing { key: self.bytes, phrase: self.phrase(), time: (since.as_micros() / 10) as u64 }
    }
}

/// Can other accounts read it?
#[cfg(unix)]
fn is_open(path: &Path) -> std::io::Result<bool> {
    Ok(std::os::unix::fs::PermissionsExt::mode(&std::fs::metadata(path)?.permissions()) & 0o077 != 0)
}

/// The folders of an account are closed to others here, unless it opens them.
#[cfg(not(unix))]
fn is_open(_: &Path) -> std::io::Result<bool> {
    Ok(false)
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

    #[cfg(unix)]
    #[test]
    fn a_file_that_others_can_read_is_refused_with_the_cure_and_the_hash_of_a_phrase_is_no_key() {
        use std::os::unix::fs::PermissionsExt;
        let path = std::env::temp_dir().join(format!("stampfly-key-{}", std::process::id()));
        let key = Key::create(&path).expect("a file");
        assert!(Key::create(&path).is_err(), "the key that is there stays");
        assert_eq!(Key::read(&path).expect("a key"), key);
        for mode in [0o640, 0o604, 0o644] {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).expect("set");
            let error = Key::read(&path).expect_err("others can read it").to_string();
            assert!(error.contains("chmod 600"), "{error}");
        }
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).expect("set");
        // As `sha256sum` writes it.
        std::fs::write(&path, format!("{}  -\n", "aBcD".repeat(16))).expect("written");
        assert!(Key::read(&path).expect_err("no key").to_string().contains("guessed"));
        std::fs::remove_file(&path).expect("the file");
    }

    #[test]
    fn a_key_has_64_hexadecimal_digits_and_nothing_else_is_one() {
        assert!(Key::parse(&"aBcD".repeat(16)).is_some());
        assert_eq!(Key::parse(&"ab".repeat(32)), None, "not random");
        for wrong in ["", "ab", &"ab".repeat(31), &"ab".repeat(33), &"xy".repeat(32), &"+1".repeat(32), &"é".repeat(32)]
        {
            assert_eq!(Key::parse(wrong), None, "{wrong}");
        }
    }
}
