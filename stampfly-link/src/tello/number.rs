//! Numbers in words: a sign, digits, a point and digits. No exponent, no infinity and nothing that is no number.

/// So many digits make a number that has no rounding error before its point is set.
const DIGITS: u32 = 7;

/// Reads a number; `None` when the word is none, or its whole part has more than seven digits. Later digits are cut off.
pub fn number(word: &str) -> Option<f32> {
    let (negative, digits) = match word.as_bytes() {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        all => (false, all),
    };
    let (mut value, mut count, mut divisor, mut point) = (0_u32, 0, 1_u32, false);
    let mut any = false;
    for byte in digits {
        match byte {
            b'.' if !point => point = true,
            b'0'..=b'9' => {
                any = true;
                if count < DIGITS {
                    value = value * 10 + u32::from(byte - b'0');
                    // Zeros in front are no digits.
                    count += u32::from(value > 0 || point);
                    divisor *= if point { 10 } else { 1 };
                } else if !point {
                    return None;
                }
            }
            _ => return None,
        }
    }
    // Both are below 2²⁴: one rounding.
    let value = value as f32 / divisor as f32;
    any.then_some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::number;
    use proptest::prelude::*;

    #[test]
    fn what_is_a_number_and_what_is_none() {
        for (word, value) in [
            ("0", 0.0),
            ("-0", 0.0),
            ("+7", 7.0),
            ("0050", 50.0),
            (".5", 0.5),
            ("5.", 5.0),
            ("-12.25", -12.25),
            ("33.333333333333336", 33.33333),
            ("9999999", 9_999_999.0),
            ("0.0000001", 1e-7),
        ] {
            assert_eq!(number(word), Some(value), "{word}");
        }
        for word in ["", "-", ".", "+-1", "1e3", "inf", "nan", "1,5", "1.2.3", "0x10", "12345678", "٣", " 1"] {
            assert_eq!(number(word), None, "{word}");
        }
    }

    proptest! {
        #[test]
        fn as_the_standard_library_reads_it(whole in 0u32..10_000, places in 0usize..=3, negative: bool) {
            let word = std::format!("{}{:.places$}", if negative { "-" } else { "" }, f64::from(whole) / 8.0);
            prop_assert_eq!(number(&word), word.parse().ok());
        }
    }
}
