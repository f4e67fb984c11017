//! Record of the inputs of each activation of a runnable, for exact replay.
//!
//! The outputs of a runnable are a function of its state, the time it was given and the samples it
//! read. The log contains the samples; this record states how far each input had been read. A
//! replay therefore gives every activation the same samples, independent of how the threads of the
//! flight were interleaved. A refused publish (a full queue) is an input, too, because the
//! publisher sees it.
//!
//! In the log the activations of each runnable are a topic, `activation_<name>`:
//!
//! | column | meaning |
//! |---|---|
//! | `uint64_t timestamp` | the time passed to the runnable, not the time at which it ran |
//! | `uint32_t index` | its index in the schedule |
//! | `uint32_t refused` | bit n: its n-th publish of this activation was refused |
//! | `uint32_t[n] generation` | per input: generation of the newest sample read so far, in this activation or an earlier one |
//! | `uint16_t[n] taken` | per input: number of samples read in this activation |
//!
//! A record is written when the runnable has read its inputs, in the order in which runnables read.
//! If a publish was refused, the record is written once more when the runnable has finished, with
//! `refused` filled in. The second record replaces the first.

use crate::ulog::{Format, Take};
use core::fmt::{self, Write};
use stampfly_types::activation::MAX_INPUTS;
use stampfly_types::{ActivationRecord, InputRecord, Instant};

/// The topic of one runnable's activations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ActivationTopic {
    /// The runnable's name; the topic is `activation_<name>`.
    pub name: &'static str,
    /// Index of the runnable in the schedule.
    pub index: u8,
    /// Number of its inputs, at most [`MAX_INPUTS`].
    pub inputs: usize,
}

/// Prefix of the names of activation topics.
pub const TOPIC_PREFIX: &str = "activation_";

/// Writes the bytes of a record that follow the topic's number.
pub(crate) fn encode(record: &ActivationRecord, out: &mut impl FnMut(&[u8])) {
    out(&record.now.as_micros().to_le_bytes());
    out(&u32::from(record.index).to_le_bytes());
    out(&record.refused.to_le_bytes());
    record.inputs().iter().for_each(|input| out(&input.generation.to_le_bytes()));
    record.inputs().iter().for_each(|input| out(&input.taken.to_le_bytes()));
}

impl ActivationTopic {
    /// Number of bytes of a record in the log.
    #[must_use]
    pub const fn size(&self) -> usize {
        16 + self.inputs * 6
    }

    /// Whether the format is the one that this crate writes for this runnable.
    #[must_use]
    pub fn is_format(&self, format: &Format<'_>) -> bool {
        format.name.strip_prefix(TOPIC_PREFIX) == Some(self.name) && Self::inputs_of(format) == Some(self.inputs)
    }

    /// Number of inputs of the activations in this format; `None` when it is not an activation
    /// format.
    #[must_use]
    pub fn inputs_of(format: &Format<'_>) -> Option<usize> {
        format.name.strip_prefix(TOPIC_PREFIX)?;
        let mut declarations = format.declarations().map_while(Result::ok).map(|d| (d.type_name, d.name, d.count));
        let head = [("uint64_t", "timestamp", None), ("uint32_t", "index", None), ("uint32_t", "refused", None)];
        if !head.iter().all(|expected| declarations.next() == Some(*expected)) {
            return None;
        }
        match (declarations.next(), declarations.next(), declarations.next()) {
            (None, None, None) => Some(0),
            (Some(("uint32_t", "generation", Some(n))), Some(("uint16_t", "taken", Some(m))), None)
                if n == m && n <= MAX_INPUTS =>
            {
                Some(n)
            }
            _ => None,
        }
    }

    /// Reads a record of `inputs` inputs from its payload; `None` when the payload has another
    /// size.
    #[must_use]
    pub fn decode(payload: &[u8], inputs: usize) -> Option<ActivationRecord> {
        let mut take = Take(payload);
        let now = Instant::from_micros(take.u64()?);
        let mut record = ActivationRecord::new(u8::try_from(take.u32()?).ok()?, now);
        record.refused = take.u32()?;
        // The generations of all inputs precede the numbers of samples.
        let mut taken = Take(take.0.get(inputs.checked_mul(4)?..)?);
        for _ in 0..inputs {
            record.push(InputRecord { generation: take.u32()?, taken: taken.u16()? }).ok()?;
        }
        taken.0.is_empty().then_some(record)
    }

    pub(crate) fn write_fields(&self, out: &mut impl Write) -> fmt::Result {
        out.write_str("uint64_t timestamp;uint32_t index;uint32_t refused;")?;
        match self.inputs {
            0 => Ok(()),
            n => write!(out, "uint32_t[{n}] generation;uint16_t[{n}] taken;"),
        }
    }
}
