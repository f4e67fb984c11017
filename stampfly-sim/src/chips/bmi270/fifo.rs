//! The FIFO of the BMI270 (DS 4.8): frames with or without a header, the oldest given up when it is full.

use std::collections::VecDeque;

/// Bytes, with the configuration image the StampFly loads.
const SIZE: usize = 2_048;
/// Header of a frame that tells how many were lost.
const SKIP: u8 = 0x40;
/// Header of the time of the last sample.
const TIME: u8 = 0x44;
/// Header of the note that settings have changed.
const CONFIGURATION: u8 = 0x48;
/// What a read beyond the end gives.
const EMPTY: u8 = 0x80;

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Fifo {
    frames: VecDeque<Vec<u8>>,
    /// Frames given up since the last skip frame was read.
    skipped: u8,
    /// Bytes of the first frame that have been read in this transfer.
    offset: usize,
    /// The time frame of this transfer, and how much of it has been read.
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

    /// Adds what the sensors have just measured, gyroscope before accelerometer.
    pub(super) fn push(&mut self, gyro: Option<[u8; 6]>, accel: Option<[u8; 6]>, header: bool, stop_on_full: bool) {
        let mut frame = Vec::with_capacity(13);
        if header {
            frame.push(0x80 | u8::from(gyro.is_some()) << 3 | u8::from(accel.is_some()) << 2);
        }
        frame.extend(gyro.into_iter().flatten());
        frame.extend(accel.into_iter().flatten());
        self.insert(frame, header, stop_on_full);
    }

    /// Notes that settings have changed: 1 accelerometer, 2 gyroscope.
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

    /// The next byte. `time` is the frame to send at the end of the data, once per transfer.
    pub(super) fn pop(&mut self, time: Option<[u8; 3]>) -> u8 {
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

    /// The transfer is over: a frame that was read in part will come again as a whole.
    pub(super) fn release(&mut self) {
        self.offset = 0;
        self.time = None;
    }
}
