//! The newest value of something, and when it was valid.

use stampfly_types::Micros;

/// A value with the instant it is valid for.
///
/// ```
/// use stampfly_mode::Dated;
/// use stampfly_types::Micros;
/// let voltage = Dated { at: Micros::from_millis(100), data: 3.9f32 };
/// assert_eq!(voltage.age(Micros::from_millis(150)), Micros::from_millis(50));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dated<T> {
    /// When it was valid.
    pub at: Micros,
    /// The value.
    pub data: T,
}

impl<T> Dated<T> {
    /// How old it is.
    #[must_use]
    pub fn age(&self, now: Micros) -> Micros {
        now.since(self.at)
    }
}
