//! What can happen to a sample between its sensor and the bus.

/// A change of one kind of sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// The numbers it changes, by their names in the message's schema: `distance`, `gyro` (all three), `gyro[0]`. Empty
    /// for the whole message.
    pub fields: &'static [&'static str],
    /// What happens to them.
    pub effect: Effect,
    /// Only to so many samples; `None` for as long as the fault lasts.
    pub samples: Option<u32>,
}

/// What happens to a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effect {
    /// The sample does not arrive.
    Silent,
    /// It stays as it was in the last sample before the fault.
    Stuck,
    /// It is this.
    Set(f32),
    /// It is this word, for fields that are no `f32`: flags, counts, truth values.
    Word(u32),
    /// This is added.
    Add(f32),
    /// It is multiplied.
    Scale(f32),
    /// It is the remainder of a division by this, as of a phase that has wrapped around.
    Wrap(f32),
    /// With this probability it is the value instead.
    Outliers {
        /// Probability for each sample, 0 to 1.
        share: f64,
        /// What it is then.
        value: f32,
    },
    /// With this probability the size is added or subtracted, for each number alone.
    Spikes {
        /// Probability for each sample, 0 to 1.
        share: f64,
        /// The size.
        size: f32,
    },
    /// The first half of the numbers changes places with the second half.
    Swap,
    /// Samples arrive for the second time of each pair only: missing for the first, present for the second, seconds.
    Gaps {
        /// How long samples are missing.
        off: f64,
        /// How long they arrive.
        on: f64,
    },
}

impl Distortion {
    /// The sample does not arrive.
    pub const SILENT: Self = Self::whole(Effect::Silent);

    /// Of the whole message.
    #[must_use]
    pub const fn whole(effect: Effect) -> Self {
        Self::of(&[], effect)
    }

    /// Of these fields.
    #[must_use]
    pub const fn of(fields: &'static [&'static str], effect: Effect) -> Self {
        Self { fields, effect, samples: None }
    }

    /// Of so many samples.
    #[must_use]
    pub const fn for_samples(self, samples: u32) -> Self {
        Self { samples: Some(samples), ..self }
    }
}
