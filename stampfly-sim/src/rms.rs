//! Root mean square of a series, for figures of a flight.

/// Accumulates a root mean square.
///
/// ```
/// use stampfly_sim::Rms;
/// let mut rms = Rms::default();
/// assert_eq!(rms.value(), None);
/// rms.add(3.0);
/// rms.add_square(25.0);
/// assert_eq!(rms.value(), Some(17.0f64.sqrt()));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rms {
    sum: f64,
    count: u64,
}

impl Rms {
    /// Adds a value.
    pub fn add(&mut self, value: f64) {
        self.add_square(value * value);
    }

    /// Adds a value given as its square, such as the squared norm of a vector.
    pub fn add_square(&mut self, square: f64) {
        self.sum += square;
        self.count += 1;
    }

    /// The root mean square; `None` without values.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.sum / self.count as f64).sqrt())
    }
}
