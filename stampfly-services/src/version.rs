//! A version as numbers, which protocols have room for, from the text that Cargo has.

/// Major, minor and patch of a version as Cargo writes it. What stands behind a `-` or `+` has no number; a number above 255 is 255.
///
/// ```
/// use stampfly_services::version;
/// const VERSION: [u8; 3] = version("1.12.3-rc.4");
/// assert_eq!(VERSION, [1, 12, 3]);
/// ```
#[must_use]
pub const fn version(text: &str) -> [u8; 3] {
    let (mut numbers, mut rest) = ([0u8; 3], text.as_bytes());
    let mut place = 0;
    while let [byte, others @ ..] = rest {
        rest = others;
        match *byte {
            digit @ b'0'..=b'9' => {
                let [major, minor, patch] = &mut numbers;
                let number = match place {
                    0 => major,
                    1 => minor,
                    _ => patch,
                };
                *number = number.saturating_mul(10).saturating_add(digit - b'0');
            }
            b'.' if place < 2 => place += 1,
            _ => break,
        }
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_three_numbers_count() {
        assert_eq!(version("0.2.0"), [0, 2, 0]);
        assert_eq!(version("10.0.255+build.7"), [10, 0, 255]);
        assert_eq!(version("1.999.3.4"), [1, 255, 3]);
        assert_eq!((version(""), version("2"), version("v1")), ([0; 3], [2, 0, 0], [0; 3]));
        let [major, minor, patch] = version(env!("CARGO_PKG_VERSION"));
        assert_eq!(std::format!("{major}.{minor}.{patch}"), env!("CARGO_PKG_VERSION"));
    }
}
