//! A log on the disk that grows while others read it.

use stampfly_ground::LogSoFar;
use stampfly_log::ulog::Sink;
use std::fs::File;
use std::io::{self, BufWriter, Read as _, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A log on the disk. Clones share it: one writes, others read what is there so far.
#[derive(Clone, Debug)]
pub struct LogFile {
    path: Arc<Path>,
    file: Arc<Mutex<BufWriter<File>>>,
}

impl LogFile {
    /// A new one. What was there before is gone.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn create(path: PathBuf) -> io::Result<Self> {
        let file = BufWriter::new(File::create(&path)?);
        Ok(Self { path: path.into(), file: Arc::new(Mutex::new(file)) })
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes what is still in memory.
    ///
    /// # Errors
    /// When the disk does not take it.
    pub fn flush(&self) -> io::Result<()> {
        self.lock().flush()
    }

    /// All of it so far.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn so_far(&self) -> io::Result<LogSoFar> {
        // What is still in memory goes to the disk first.
        self.flush()?;
        let file = File::open(&self.path)?;
        let length = file.metadata()?.len();
        Ok(LogSoFar { length, bytes: Box::new(file.take(length)) })
    }

    fn lock(&self) -> MutexGuard<'_, BufWriter<File>> {
        self.file.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sink for LogFile {
    type Error = io::Error;

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.lock().write_all(bytes)
    }
}
