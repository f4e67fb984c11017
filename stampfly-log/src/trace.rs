//! What each activation of a runnable saw: the part of a log that makes replay exact.
//!
//! The outputs of a runnable are a function of its state, of the time it was told and of the samples it read. The
//! samples are in the log already; this record says how far each input had been read, so a replay gives every
//! activation the same samples again, however the threads of the flight were interleaved. A publish that was
//! refused (a full queue) is an input too, for the publisher sees it.
//!
//! In the log every activation is a topic of its own, `activation_<name>`:
//!
//! | column | meaning |
//! |---|---|
//! | `uint64_t timestamp` | the time the runnable was told, not the time it ran |
//! | `uint32_t index` | its place in the schedule |
//! | `uint32_t refused` | bit n: its n-th publish of this activation was refused |
//! | `uint32_t[n] generation` | per input: number of the newest sample it has read, of now or of before |
//! | `uint16_t[n] taken` | per input: how many samples it took this time |
//!
//! Activations appear in the order they ran. Not a profiler: nothing here says how long anything took.

use crate::ulog::{Format, Take};
use core::fmt::{self, Write};
use stampfly_types::Instant;

/// The largest number of inputs of one activation.
pub const MAX_INPUTS: usize = 16;

/// How far one input had been read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Input {
    /// Generation of the newest sample read so far; zero before the first.
    pub generation: u32,
    /// Samples taken in this activation.
    pub taken: u16,
}

/// One activation of one runnable.
///
/// ```
/// use stampfly_log::{Activation, Input};
/// use stampfly_types::Instant;
///
/// let mut record = Activation::new(2, Instant::from_micros(5_000));
/// record.read(Input { generation: 17, taken: 1 })?;
/// record.read(Input { generation: 4, taken: 0 })?;
/// record.refuse(0);
/// assert_eq!((record.inputs().len(), record.refused), (2, 0b1));
/// # Ok::<(), stampfly_log::trace::TooManyInputs>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Activation {
    /// The runnable's place in the schedule.
    pub index: u8,
    /// The time it was told.
    pub now: Instant,
    /// Bit n: its n-th publish was refused. Bit 31 stands for every publish from the 32nd on.
    pub refused: u32,
    inputs: [Input; MAX_INPUTS],
    count: usize,
}

/// An activation has more than [`MAX_INPUTS`] inputs. Holds the one that did not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooManyInputs(pub Input);

impl fmt::Display for TooManyInputs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "an activation has at most {MAX_INPUTS} inputs")
    }
}

impl core::error::Error for TooManyInputs {}

impl Activation {
    /// An activation that has not read anything yet.
    #[must_use]
    pub const fn new(index: u8, now: Instant) -> Self {
        Self { index, now, refused: 0, inputs: [Input { generation: 0, taken: 0 }; MAX_INPUTS], count: 0 }
    }

    /// Adds the next input, in the order of the schedule.
    ///
    /// # Errors
    /// When there are [`MAX_INPUTS`] already; the record is unchanged.
    pub fn read(&mut self, input: Input) -> Result<(), TooManyInputs> {
        let room = self.inputs.get_mut(self.count).ok_or(TooManyInputs(input))?;
        *room = input;
        self.count += 1;
        Ok(())
    }

    /// Notes that the publish with this number, counted from zero within the activation, was refused.
    pub const fn refuse(&mut self, publish: u32) {
        self.refused |= 1 << if publish < 31 { publish } else { 31 };
    }

    /// The inputs, in the order they were added.
    #[must_use]
    pub fn inputs(&self) -> &[Input] {
        self.inputs.get(..self.count).unwrap_or_default()
    }

    pub(crate) fn encode(&self, out: &mut impl FnMut(&[u8])) {
        out(&self.now.as_micros().to_le_bytes());
        out(&u32::from(self.index).to_le_bytes());
        out(&self.refused.to_le_bytes());
        self.inputs().iter().for_each(|input| out(&input.generation.to_le_bytes()));
        self.inputs().iter().for_each(|input| out(&input.taken.to_le_bytes()));
    }
}

/// The topic that holds the activations of one runnable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ActivationTopic {
    /// The runnable's name; the topic is `activation_<name>`.
    pub name: &'static str,
    /// Its place in the schedule.
    pub index: u8,
    /// How many inputs it has, at most [`MAX_INPUTS`].
    pub inputs: usize,
}

/// Topics of activations begin with this.
pub const TOPIC_PREFIX: &str = "activation_";

impl ActivationTopic {
    /// Number of bytes of a record in the log.
    #[must_use]
    pub const fn size(&self) -> usize {
        16 + self.inputs * 6
    }

    /// Is this format the one a log of ours has for this runnable?
    #[must_use]
    pub fn is_format(&self, format: &Format<'_>) -> bool {
        format.name.strip_prefix(TOPIC_PREFIX) == Some(self.name) && Self::inputs_of(format) == Some(self.inputs)
    }

    /// How many inputs the activations of this format have; `None` when it is no format of activations.
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

    /// Reads a record of `inputs` inputs from its payload; `None` when it has another size.
    #[must_use]
    pub fn decode(payload: &[u8], inputs: usize) -> Option<Activation> {
        let mut take = Take(payload);
        let now = Instant::from_micros(take.u64()?);
        let mut record = Activation::new(u8::try_from(take.u32()?).ok()?, now);
        record.refused = take.u32()?;
        let mut taken = Take(take.0.get(inputs.checked_mul(4)?..)?);
        for _ in 0..inputs {
            record.read(Input { generation: take.u32()?, taken: taken.u16()? }).ok()?;
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
