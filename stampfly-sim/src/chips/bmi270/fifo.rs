//! FIFO of the BMI270 (DS 4.8): frames with or without a header; when full, the oldest are dropped.

use std::collections::VecDeque;

/// Size, bytes, with the configuration image that the StampFly loads.
const SIZE: usize = 2_048;
/// Header of a skip frame: number of dropped frames.
const SKIP: u8 = 0x40;
/// Header of a frame with the time of the last sample.
const TIME: u8 = 0x44;
/// Header of a frame that reports changed settings.
const CONFIGURATION: u8 = 0x48;
/// Byte read beyond the end.
const EMPTY: u8 = 0x80;

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Fifo {
    frames: VecDeque<Vec<u8>>,
    /// Frames dropped since the last skip frame was read.
    skipped: u8,
    /// Bytes of the first frame read in this transfer.
    offset: usize,
    /// Time frame of this transfer, and the number of its bytes already read.
    time: Option<([u8; 4], usize)>,
}

impl Fifo {
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Fill level, bytes.
    pub(super) fn len(&self) -> usize {
        self.frames.iter().map(Vec::len).sum::<usize>() + if self.skipped > 0 { 2 } else { 0 }
    }

    /// Adds new samples, gyroscope before accelerometer.
    pub(super) fn push(&mut self, gyro: Option<[u8; 6]>, accel: Option<[u8; 6]>, header: bool, stop_on_full: bool) {
        let mut frame = Vec::with_capacity(13);
        if header {
            frame.push(0x80 | u8::from(gyro.is_some()) << 3 | u8::from(accel.is_some()) << 2);
        }
        frame.extend(gyro.into_iter().flatten());
        frame.extend(accel.into_iter().flatten());
        self.insert(frame, header, stop_on_full);
    }

    /// Adds a report of changed settings: 1 accelerometer, 2 gyroscope.
    pub(super) fn push_configuration(&mut self, what: u8) {
        self.insert(vec![CONFIGURATION, what, 0, 0, 0], true, false);
    }

    fn insert(&mut self, frame: Vec<u8>, header: bool, stop_on_full: bool) {
        if stop_on_full && self.len() + frame.len() > SIZE {
            return;
        }
        self.frames.push_back(frame);
        while self.len() > SIZE {
            self.frames.pop_front();
            self.offset = 0;
            if header {
                self.skipped = self.skipped.saturating_add(1);
            }
        }
    }

    /// The next byte. `time` is the time frame to send after the data, once per transfer.
    pub(super) fn pop(&mut self, time: Option<[u8; 3]>) -> u8 {
        // A skip frame is inserted only between frames.
        if self.skipped > 0 && self.offset == 0 {
            self.frames.push_front(vec![SKIP, core::mem::take(&mut self.skipped)]);
        }
        if let Some(frame) = self.frames.front() {
            let byte = frame.get(self.offset).copied().unwrap_or(EMPTY);
            self.offset += 1;
            if self.offset >= frame.len() {
                self.frames.pop_front();
                self.offset = 0;
            }
            return byte;
        }
        if self.time.is_none() {
            self.time = time.map(|[low, middle, high]| ([TIME, low, middle, high], 0));
        }
        match &mut self.time {
            Some((frame, sent)) => {
                *sent += 1;
                frame.get(*sent - 1).copied().unwrap_or(EMPTY)
            }
            None => EMPTY,
        }
    }

    /// Ends a transfer: a frame that was read in part is repeated as a whole.
    pub(super) fn release(&mut self) {
        self.offset = 0;
        self.time = None;
    }
}
