//! A network's name and pass-phrase, and their form in flash.
//!
//! Nothing shows the pass-phrase: `Debug` does not print it, and there is no `Display`. It is in flash as it was typed, because the radio's libraries need it so.

use core::fmt;
use heapless::String;

/// Bytes of a record in flash: what a parameter store keeps as one value.
pub const RECORD: usize = 32;
/// The names of the records in flash: that of the network's name, which is written last, and those of both halves of its pass-phrase. They are no parameters: nothing lists or logs them.
pub const NAMES: [&str; 3] = ["network.name", "network.secret1", "network.secret2"];
/// A part of the credentials in flash, filled up with zeros.
pub type Record = [u8; RECORD];

/// Why something are no credentials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CredentialsError {
    /// A network's name has 1 to 32 bytes, none of them a zero.
    Name,
    /// A pass-phrase has 8 to 63 printable characters (IEEE 802.11, annex J.4).
    Passphrase,
}

impl fmt::Display for CredentialsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Name => "a network's name has 1 to 32 bytes",
            Self::Passphrase => "a pass-phrase has 8 to 63 printable characters",
        })
    }
}

impl core::error::Error for CredentialsError {}

/// A network's name and pass-phrase. There is none without: whoever is near could speak to the vehicle.
///
/// ```
/// use stampfly_services::association::{Credentials, CredentialsError};
/// let known = Credentials::new("workshop", "a long sentence")?;
/// assert_eq!(format!("{known:?}"), "Credentials { name: \"workshop\", passphrase: (secret) }");
/// assert_eq!(Credentials::from_records(&known.to_records()), Some(known));
/// assert_eq!(Credentials::new("workshop", "short"), Err(CredentialsError::Passphrase));
/// # Ok::<(), CredentialsError>(())
/// ```
#[derive(Clone, PartialEq, Eq)]
pub struct Credentials {
    name: String<RECORD>,
    passphrase: String<63>,
}

impl fmt::Debug for Credentials {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Credentials").field("name", &self.name).field("passphrase", &format_args!("(secret)")).finish()
    }
}

impl Credentials {
    /// These.
    ///
    /// # Errors
    /// When one of them is none.
    pub fn new(name: &str, passphrase: &str) -> Result<Self, CredentialsError> {
        let has_zero = name.bytes().any(|byte| byte == 0);
        let name = String::try_from(name).map_err(|_| CredentialsError::Name)?;
        if name.is_empty() || has_zero {
            return Err(CredentialsError::Name);
        }
        let is_printable = passphrase.bytes().all(|byte| (b' '..=b'~').contains(&byte));
        let passphrase = String::<63>::try_from(passphrase).map_err(|_| CredentialsError::Passphrase)?;
        if passphrase.len() < 8 || !is_printable {
            return Err(CredentialsError::Passphrase);
        }
        Ok(Self { name, passphrase })
    }

    /// The network's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The pass-phrase, for the radio alone.
    #[must_use]
    pub fn passphrase(&self) -> &str {
        &self.passphrase
    }

    /// Their form in flash: the name, and both halves of the pass-phrase. Write the name last, over zeros: then a power cut leaves these, or none.
    #[must_use]
    pub fn to_records(&self) -> [Record; 3] {
        let record = |bytes: &mut dyn Iterator<Item = u8>| {
            let mut record = [0; RECORD];
            record.iter_mut().zip(bytes).for_each(|(to, byte)| *to = byte);
            record
        };
        let mut passphrase = self.passphrase.bytes();
        let first = record(&mut passphrase.by_ref().take(RECORD));
        [record(&mut self.name.bytes()), first, record(&mut passphrase)]
    }

    /// From flash. `None` when these are none.
    #[must_use]
    pub fn from_records([name, first, second]: &[Record; 3]) -> Option<Self> {
        let end = |bytes: &[u8]| bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        let name = core::str::from_utf8(name.get(..end(name))?).ok()?;
        let mut passphrase = [0; 2 * RECORD];
        passphrase.iter_mut().zip(first.iter().chain(second)).for_each(|(to, byte)| *to = *byte);
        let passphrase = core::str::from_utf8(passphrase.get(..end(&passphrase))?).ok()?;
        Self::new(name, passphrase).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_kept_is_what_was_typed(name in "\\PC{1,8}", passphrase in "[ -~]{8,63}") {
            let known = Credentials::new(&name, &passphrase).unwrap();
            prop_assert_eq!(Credentials::from_records(&known.to_records()), Some(known));
        }

        #[test]
        fn damage_is_no_reason_to_panic(records in any::<[Record; 3]>()) {
            if let Some(known) = Credentials::from_records(&records) {
                prop_assert!(Credentials::new(known.name(), known.passphrase()).is_ok());
            }
        }
    }

    #[test]
    fn an_empty_name_is_no_network() {
        let [_, first, second] = Credentials::new("n", "12345678").unwrap().to_records();
        assert_eq!(Credentials::from_records(&[[0; RECORD], first, second]), None);
        let wide = "x".repeat(33);
        for (name, why) in
            [("", CredentialsError::Name), ("a\0", CredentialsError::Name), (&wide, CredentialsError::Name)]
        {
            assert_eq!(Credentials::new(name, "12345678"), Err(why));
        }
        for wrong in ["1234567", "1234567\u{e9}", "1234567\t", &"x".repeat(64)] {
            assert_eq!(Credentials::new("n", wrong), Err(CredentialsError::Passphrase), "{wrong}");
        }
    }
}
