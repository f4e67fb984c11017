//! Reads a compact record, on a PC, as a log: the flight is run again, and written down as a recorder would have done.

use super::contents::{Contents, ReadError, Samples};
use super::file::File;
use super::rerun::{Rerun, Stop};
use super::words::Words;
use crate::recorder::Recorder;
use alloc::vec::Vec;
use serde::{Serialize, de::DeserializeOwned};
use stampfly_bus::Schedule;
use stampfly_log::ulog::Sink;

/// Runs again what a file holds, from each key frame that follows a gap on, and writes it into a log, whose head the caller has
/// written.
///
/// In the log, what an activation read stands before it, and what it published behind it.
///
/// # Errors
/// When the file is no compact record of this vehicle and version, or the log takes no more. What came before is in the log.
/// A file that ends somewhere, or lacks something in the middle, is no error: see [`Contents::gaps`].
pub fn read<R: Schedule + Serialize + DeserializeOwned, S: Sink>(
    file: &[u8],
    config: &R::Config,
    samples: Samples,
    log: &mut Recorder<R, S>,
) -> Result<Contents, ReadError> {
    let mut stretches: Vec<Vec<u32>> = Vec::new();
    let (mut is_on, mut contents, mut has_begun) = (false, Contents::default(), false);
    for chunk in File::new(file).map_err(ReadError::File)? {
        match chunk {
            None => {
                contents.gaps += u64::from(has_begun);
                is_on = false;
            }
            Some(chunk) => {
                if chunk.begins && !is_on {
                    stretches.push(Vec::new());
                    is_on = true;
                }
                has_begun = true;
                if let Some(stretch) = stretches.last_mut().filter(|_| is_on) {
                    stretch.extend(chunk.words.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)));
                }
            }
        }
    }
    let mut rerun = Rerun { config, samples, log, contents, breaks: 0 };
    for stretch in &stretches {
        let mut words = Words::new(stretch);
        while rerun.part(&mut words)? == Stop::Lost {
            rerun.contents.gaps += 1;
        }
    }
    if rerun.contents.key_frames == 0 { Err(ReadError::NoKeyFrame) } else { Ok(rerun.contents) }
}
