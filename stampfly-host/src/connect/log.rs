//! What has come over the line, as a log that grows: one from each start of the vehicle to the next.

use crate::log_file::LogFile;
use crate::recorder::Recorder;
use stampfly_sim::vehicle::{Options, Setting, Vehicle, Witness};
use stampfly_types::Instant;
use std::path::Path;

/// The log of one vehicle since it started.
pub(super) struct Log<V: Vehicle> {
    recorder: Recorder<V, LogFile>,
    pub file: LogFile,
    /// Samples of each topic so far.
    counts: Vec<u32>,
}

impl<V: Vehicle> Log<V> {
    /// The `number`-th in this folder, of a vehicle with these parameters.
    pub fn begin(folder: &Path, number: usize, settings: &[Setting], topics: usize) -> Result<Self, String> {
        let again = if number == 0 { String::new() } else { format!("-restart-{number}") };
        let path = folder.join(format!("flight{again}.ulg"));
        let failed = |error: &dyn std::fmt::Debug| format!("{}: {error:?}", path.display());
        let param = settings.iter().map(|Setting { name, value, .. }| format!("{name}={value}")).collect();
        // One that this program's ranges do not have is left as it is by default.
        let setup =
            V::setup(&Options { param, ..Options::default() }, 1).or_else(|_| V::setup(&Options::default(), 1))?;
        let file = LogFile::create(path.clone()).map_err(|error| failed(&error))?;
        let facts = [("ver_sw", env!("CARGO_PKG_VERSION")), ("mission", "a real vehicle")];
        let facts = facts.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let recorder = Recorder::with_sink(file.clone(), &setup, &facts).map_err(|error| failed(&error))?;
        Ok(Self { recorder, file, counts: vec![0; topics] })
    }

    /// A sample.
    pub fn note(&mut self, topic: usize, at: Instant, words: &[u32]) {
        if let Some(count) = self.counts.get_mut(topic) {
            *count += 1;
            self.recorder.published(topic, at, *count, words);
        }
    }

    /// It is over.
    pub fn end(mut self) {
        self.recorder.ends();
        // What the disk does not take is missing.
        _ = self.file.flush();
    }
}
