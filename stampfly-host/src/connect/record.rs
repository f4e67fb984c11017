//! The compact flight record that a vehicle streams over its line, in a file: the chunks as they come.
//!
//! Nothing of it is understood here; `stampfly replay` and `stampfly log` read it. A vehicle that starts anew counts its chunks from zero, and begins another file.

use super::budget::Budget;
use crate::serve::write_chunk;
use stampfly_flight::compact::{ChunkError, MAGIC, Receiver};
use stampfly_types::Instant;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// A file that grows.
#[derive(Debug)]
pub(super) struct Record {
    path: PathBuf,
    file: BufWriter<File>,
    receiver: Receiver,
    /// Of the files before this one.
    before: [u64; 2],
    starts: usize,
    may_start: Budget,
}

fn begin(path: &Path) -> io::Result<BufWriter<File>> {
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(&MAGIC)?;
    Ok(file)
}

impl Record {
    /// Nothing has come yet.
    pub fn create(path: PathBuf) -> io::Result<Self> {
        let (receiver, may_start) = (Receiver::default(), super::STARTS);
        Ok(Self { file: begin(&path)?, path, receiver, before: [0; 2], starts: 0, may_start })
    }

    /// Takes a chunk. What is none, or damaged, is missing in the file, and so is what comes from a
    /// vehicle that starts anew more often than vehicles can.
    pub fn take(&mut self, now: Instant, bytes: &[u8]) -> io::Result<()> {
        match self.receiver.take(bytes) {
            Ok(_) => {}
            // A line keeps the order: it counts anew.
            Err(ChunkError::Late) if self.may_start.takes(now) => {
                self.begin_again()?;
                _ = self.receiver.take(bytes);
            }
            Err(_) => return Ok(()),
        }
        write_chunk(&mut self.file, bytes)
    }

    fn begin_again(&mut self) -> io::Result<()> {
        self.file.flush()?;
        self.before = self.counts();
        (self.starts, self.receiver) = (self.starts + 1, Receiver::default());
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let extension = self.path.extension().map(|extension| format!(".{}", extension.to_string_lossy()));
        let name = format!("{stem}-restart-{}{}", self.starts, extension.unwrap_or_default());
        self.file = begin(&self.path.with_file_name(name))?;
        Ok(())
    }

    /// Has the disk take what has come.
    pub fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }

    /// Chunks that have come, and that are missing between them.
    pub fn counts(&self) -> [u64; 2] {
        let [chunks, missing] = self.before;
        [chunks + self.receiver.chunks(), missing + self.receiver.missing()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_flight::compact::{Chunk, File as Chunks};

    fn chunk(number: u32) -> Vec<u8> {
        let mut room = [0; 64];
        let length = Chunk { number, begins: number == 0, words: &[1, 2, 3, 4] }.write(&mut room).expect("room");
        room[..length].to_vec()
    }

    #[test]
    fn a_vehicle_that_starts_anew_begins_another_file() {
        let folder = std::env::temp_dir().join(format!("stampfly-record-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let mut record = Record::create(folder.join("flight.sfr")).expect("a file");
        for number in [0, 1, 3, 0, 1] {
            record.take(Instant::ZERO, &chunk(number)).expect("written");
        }
        record.take(Instant::ZERO, b"no chunk").expect("passed over");
        record.flush().expect("written");
        assert_eq!(record.counts(), [5, 1]);
        for (name, expected) in
            [("flight.sfr", vec![Some(0), Some(1), None, Some(3)]), ("flight-restart-1.sfr", vec![Some(0), Some(1)])]
        {
            let bytes = std::fs::read(folder.join(name)).expect("a file");
            let numbers: Vec<_> =
                Chunks::new(&bytes).expect("a record").map(|chunk| chunk.map(|chunk| chunk.number)).collect();
            assert_eq!(numbers, expected, "{name}");
        }
        _ = std::fs::remove_dir_all(&folder);
    }
}
