//! Compact flight records.

use stampfly_flight::compact::{self, Chunk, MAGIC, Samples};
use stampfly_flight::{LogSchema, Recorder};
use stampfly_log::ulog::{Definitions, Sink};
use stampfly_rover::Runnables;
use stampfly_types::Instant;

/// Takes everything, and keeps nothing.
struct Nowhere;

impl Sink for Nowhere {
    type Error = core::convert::Infallible;
    fn write(&mut self, _: &[u8]) -> Result<(), Self::Error> {
        Ok(())
    }
}

/// The whole input is the file; then it is the words of a chunk that is whole.
pub fn compact_record(data: &[u8]) {
    read(data);
    let _ = compact::vehicle_name(data);
    let words = &data[..data.len().min(60_000) / 4 * 4];
    let chunk = Chunk { number: 0, begins: true, words };
    let mut room = [0; 61_000];
    let length = chunk.write(&mut room).expect("there is room");
    assert_eq!(Chunk::read(&room[..length]), Ok(chunk));
    let file = [&MAGIC[..], &(length as u16).to_le_bytes(), &room[..length]].concat();
    read(&file);
}

fn read(file: &[u8]) {
    let head = Definitions::start(Nowhere, Instant::ZERO).expect("nowhere is never full");
    let mut log = Recorder::<Runnables, _>::new(head.data(LogSchema::new(&[])).expect("nowhere is never full"));
    if let Ok(contents) = compact::read(file, &Default::default(), Samples::Again, &mut log) {
        assert!(contents.key_frames > 0);
    }
}
