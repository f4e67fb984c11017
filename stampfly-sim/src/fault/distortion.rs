//! Changes of samples between their sensor and the bus.

/// A change of one kind of sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// Affected values by their names in the message's schema: `distance`, `gyro` (all three),
    /// `gyro[0]`. Empty for the whole message.
    pub fields: &'static [&'static str],
    /// The effect on them.
    pub effect: Effect,
    /// Number of samples affected; `None` for the whole duration of the fault.
    pub samples: Option<u32>,
}

/// Effect of a fault on values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effect {
    /// The sample does not arrive.
    Silent,
    /// The values stay as in the last sample before the fault.
    Stuck,
    /// The values are replaced.
    Set(f32),
    /// The words are replaced, for fields other than `f32`: flags, counts, booleans.
    Word(u32),
    /// A constant is added.
    Add(f32),
    /// The values are multiplied.
    Scale(f32),
    /// The remainder of a division remains, as for a phase that has wrapped around.
    Wrap(f32),
    /// With a probability per sample, the values are replaced.
    Outliers {
        /// Probability for each sample, 0 to 1.
        share: f64,
        /// Replacement value.
        value: f32,
    },
    /// With a probability for each value, the size is added or subtracted.
    Spikes {
        /// Probability for each sample, 0 to 1.
        share: f64,
        /// The size.
        size: f32,
    },
    /// The first half of the values is exchanged with the second half.
    Swap,
    /// Samples are missing for `off` seconds, then arrive for `on` seconds, periodically.
    Gaps {
        /// Duration of each gap, s.
        off: f64,
        /// Duration between gaps, s.
        on: f64,
    },
}

impl Distortion {
    /// The sample does not arrive.
    pub const SILENT: Self = Self::whole(Effect::Silent);

    /// An effect on the whole message.
    #[must_use]
    pub const fn whole(effect: Effect) -> Self {
        Self::of(&[], effect)
    }

    /// An effect on these fields.
    #[must_use]
    pub const fn of(fields: &'static [&'static str], effect: Effect) -> Self {
        Self { fields, effect, samples: None }
    }

    /// Limits the effect to a number of samples.
    #[must_use]
    pub const fn for_samples(self, samples: u32) -> Self {
        Self { samples: Some(samples), ..self }
    }
}
