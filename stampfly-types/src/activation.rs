//! Record of the inputs of one activation of a runnable, for repeatable replay.
//!
//! The outputs of a runnable are a function of its state, the instant it was given and the samples
//! it read. The log stores the samples; this record states how far each input had been read. A
//! replay therefore gives every activation the same samples, independent of how the threads of the
//! flight preempted each other. A refused publish (a full queue) is an input, too, because the
//! publisher sees it.
//!
//! The bus fills the record in, the log stores it, and a replay returns it to the bus. It is part
//! of this crate because bus and log do not depend on each other. Not for profiling: it contains no
//! execution times.

use crate::Instant;

/// Maximum number of inputs of one runnable.
pub const MAX_INPUTS: usize = 16;

/// How far one input has been read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct InputRecord {
    /// Generation of the newest sample read so far, in this activation or an earlier one; zero
    /// before the first.
    pub generation: u32,
    /// Number of samples read in this activation.
    pub taken: u16,
}

/// One activation of one runnable.
///
/// ```
/// use stampfly_types::{ActivationRecord, InputRecord, Instant};
///
/// let mut record = ActivationRecord::new(2, Instant::from_millis(5));
/// record.push(InputRecord { generation: 17, taken: 1 })?;
/// record.push(InputRecord { generation: 4, taken: 0 })?;
/// assert_eq!(record.inputs().len(), 2);
/// # Ok::<(), stampfly_types::activation::TooManyInputs>(())
/// ```
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ActivationRecord {
    /// Index of the runnable in the activation table.
    pub index: u8,
    /// The instant passed to the runnable. The runnable may have run later.
    pub now: Instant,
    /// Bit n: its n-th publish on a queue was refused. Bit 31 covers all from the 32nd on.
    pub refused: u32,
    inputs: [InputRecord; MAX_INPUTS],
    #[cfg_attr(feature = "serde", serde(deserialize_with = "up_to_max_inputs"))]
    count: u8,
}

#[cfg(feature = "serde")]
fn up_to_max_inputs<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<u8, D::Error> {
    let count: u8 = serde::Deserialize::deserialize(deserializer)?;
    if usize::from(count) <= MAX_INPUTS { Ok(count) } else { Err(serde::de::Error::custom("too many inputs")) }
}

/// Compares only the inputs in use.
impl PartialEq for ActivationRecord {
    fn eq(&self, other: &Self) -> bool {
        (self.index, self.now, self.refused, self.inputs()) == (other.index, other.now, other.refused, other.inputs())
    }
}

impl Eq for ActivationRecord {}

/// The record already has [`MAX_INPUTS`] inputs. Returns the one that did not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooManyInputs(pub InputRecord);

impl core::fmt::Display for TooManyInputs {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "an activation has at most {MAX_INPUTS} inputs")
    }
}

impl core::error::Error for TooManyInputs {}

impl ActivationRecord {
    /// An activation that has not read any input yet.
    #[inline]
    #[must_use]
    pub const fn new(index: u8, now: Instant) -> Self {
        Self { index, now, refused: 0, inputs: [InputRecord { generation: 0, taken: 0 }; MAX_INPUTS], count: 0 }
    }

    /// Starts the record of another activation in the same memory.
    #[inline]
    pub const fn begin(&mut self, index: u8, now: Instant) {
        self.index = index;
        self.now = now;
        self.refused = 0;
        self.count = 0;
    }

    /// Adds the next input, in the order of the topic table.
    ///
    /// # Errors
    /// When there are [`MAX_INPUTS`] inputs already. The record is unchanged then.
    #[inline]
    pub fn push(&mut self, input: InputRecord) -> Result<(), TooManyInputs> {
        let place = self.inputs.get_mut(usize::from(self.count)).ok_or(TooManyInputs(input))?;
        *place = input;
        self.count += 1;
        Ok(())
    }

    /// Replaces the inputs with `N` slots to be filled in the order of the topic table. Always
    /// `Some`.
    ///
    /// Faster than [`push`](Self::push): the length is checked at compile time. Until they are
    /// written, the slots hold the values of an earlier activation.
    #[inline]
    pub const fn places<const N: usize>(&mut self) -> Option<&mut [InputRecord; N]> {
        const { assert!(N <= MAX_INPUTS, "an activation has at most MAX_INPUTS inputs") };
        // The assertion bounds N, so the cast is exact and the slice exists.
        self.count = N as u8;
        self.inputs.first_chunk_mut()
    }

    /// The inputs, in the order in which they were added.
    #[inline]
    #[must_use]
    pub fn inputs(&self) -> &[InputRecord] {
        self.inputs.get(..usize::from(self.count)).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_record_gives_the_input_back() {
        let mut record = ActivationRecord::new(0, Instant::ZERO);
        for generation in 1..=MAX_INPUTS as u32 {
            assert_eq!(record.push(InputRecord { generation, taken: 1 }), Ok(()));
        }
        let one_more = InputRecord { generation: 99, taken: 1 };
        assert_eq!(record.push(one_more), Err(TooManyInputs(one_more)));
        assert_eq!(record.inputs().len(), MAX_INPUTS);
    }

    #[test]
    fn inputs_set_at_once_are_those_added_one_by_one() {
        let inputs = [3, 0, 9].map(|generation| InputRecord { generation, taken: 1 });
        let mut one_by_one = ActivationRecord::new(1, Instant::ZERO);
        for input in inputs {
            one_by_one.push(input).expect("there is room");
        }
        let mut at_once = ActivationRecord::new(1, Instant::ZERO);
        at_once.push(InputRecord { generation: 7, taken: 7 }).expect("there is room");
        *at_once.places().expect("few enough") = inputs;
        assert_eq!(at_once, one_by_one);
    }

    #[test]
    fn what_an_earlier_activation_read_does_not_count() {
        let mut record = ActivationRecord::new(1, Instant::from_micros(1));
        record.push(InputRecord { generation: 3, taken: 3 }).expect("there is room");
        record.begin(2, Instant::from_micros(7));
        assert_eq!(record, ActivationRecord::new(2, Instant::from_micros(7)));
    }
}
