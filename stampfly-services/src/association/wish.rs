//! What a person types about the network: `wifi`, `wifi join NAME PASSPHRASE`, `wifi forget`.
//!
//! For the terminal at the cable alone: a pass-phrase is nothing for the air.

use super::credentials::{Credentials, CredentialsError};

/// How it is typed.
pub const USAGE: &str = "wifi | wifi join NAME PASSPHRASE | wifi forget; a name with spaces in \"quotation marks\"";

/// What a line asks for.
///
/// ```
/// use stampfly_services::association::{Credentials, Wish};
/// let known = Credentials::new("my place", "open the door").unwrap();
/// assert_eq!(Wish::of("wifi join \"my place\" open the door"), Some(Ok(Wish::Join(known))));
/// assert_eq!(Wish::of(" wifi "), Some(Ok(Wish::Show)));
/// assert_eq!(Wish::of("status"), None);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wish {
    /// How it is.
    Show,
    /// To join this network from now on.
    Join(Credentials),
    /// To forget it.
    Forget,
    /// How it is typed.
    Usage,
}

impl Wish {
    /// What the line asks for, if it is about the network.
    ///
    /// # Errors
    /// When no network has such a name or pass-phrase.
    #[must_use]
    pub fn of(line: &str) -> Option<Result<Self, CredentialsError>> {
        let rest = line.trim().strip_prefix("wifi")?;
        if !rest.is_empty() && !rest.starts_with(' ') {
            return None;
        }
        let (word, rest) = word(rest.trim_start());
        Some(Ok(match word {
            "" => Self::Show,
            "forget" => Self::Forget,
            "join" => {
                let (name, passphrase) = name(rest);
                return Some(Credentials::new(name, passphrase).map(Self::Join));
            }
            _ => Self::Usage,
        }))
    }
}

/// The first word, and what comes after the spaces behind it.
fn word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(' ').unwrap_or((text, ""));
    (word, rest.trim_start())
}

/// A network's name, and the pass-phrase behind it.
fn name(text: &str) -> (&str, &str) {
    match text.strip_prefix('"').and_then(|text| text.split_once('"')) {
        Some((name, rest)) => (name, rest.strip_prefix(' ').unwrap_or(rest)),
        None => word(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_or_explained() {
        let join = |name: &str, passphrase: &str| Some(Credentials::new(name, passphrase).map(Wish::Join));
        assert_eq!(Wish::of("wifi join workshop 12345678"), join("workshop", "12345678"));
        assert_eq!(Wish::of("wifi  join  workshop  12345678 9 "), join("workshop", "12345678 9"));
        assert_eq!(Wish::of("wifi forget"), Some(Ok(Wish::Forget)));
        assert_eq!(Wish::of("wifi help"), Some(Ok(Wish::Usage)));
        assert_eq!(Wish::of("wifi join"), Some(Err(CredentialsError::Name)));
        assert_eq!(Wish::of("wifi join workshop"), Some(Err(CredentialsError::Passphrase)));
        assert_eq!(Wish::of("wifi join \"workshop 12345678"), join("\"workshop", "12345678"));
        assert_eq!(Wish::of("wifis"), None);
    }
}
