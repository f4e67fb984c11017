//! What waits until a connection takes it: pieces of bytes in their order, of bounded size
//! together.
//!
//! The bound is one of bytes, since a line that was held up brings what a vehicle has said
//! meanwhile at once: a thousand short frames, for a program that reads as fast as any.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

/// Room that a piece takes beside its bytes.
const PIECE: usize = 64;

/// Where pieces are put.
#[derive(Debug)]
pub(super) struct Outbox {
    pieces: Sender<Vec<u8>>,
    /// Bytes that wait.
    waiting: Arc<AtomicUsize>,
    most: usize,
}

/// Where they are taken.
#[derive(Debug)]
pub(super) struct Waiting {
    pieces: Receiver<Vec<u8>>,
    waiting: Arc<AtomicUsize>,
}

impl Outbox {
    /// An empty one, with room for this many bytes.
    pub fn new(most: usize) -> (Self, Waiting) {
        let (put, taken) = channel();
        let waiting = Arc::new(AtomicUsize::new(0));
        (Self { pieces: put, waiting: waiting.clone(), most }, Waiting { pieces: taken, waiting })
    }

    /// Puts a piece behind the others. `false` when there is no room, or no taker any more.
    pub fn put(&self, bytes: &[u8]) -> bool {
        let length = bytes.len() + PIECE;
        let has_room = self.waiting.fetch_add(length, Ordering::Relaxed) + length <= self.most;
        let is_put = has_room && self.pieces.send(bytes.to_vec()).is_ok();
        if !is_put {
            self.waiting.fetch_sub(length, Ordering::Relaxed);
        }
        is_put
    }
}

impl Waiting {
    /// The next piece, as soon as there is one; `None` when there will be none any more.
    pub fn next(&self) -> Option<Vec<u8>> {
        let piece = self.pieces.recv().ok()?;
        self.waiting.fetch_sub(piece.len() + PIECE, Ordering::Relaxed);
        Some(piece)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_room_again_for_what_was_taken() {
        let (outbox, waiting) = Outbox::new(3 * (PIECE + 10));
        let all = [[1; 10], [2; 10], [3; 10]];
        assert!(all.iter().all(|piece| outbox.put(piece)));
        assert!(!outbox.put(&[4]), "no room");
        assert_eq!(waiting.next().as_deref(), Some(&all[0][..]));
        assert!(outbox.put(&[5; 10]) && !outbox.put(&[6]));
        drop(outbox);
        let rest: Vec<_> = core::iter::from_fn(|| waiting.next()).collect();
        assert_eq!(rest, [[2; 10], [3; 10], [5; 10]]);
    }

    #[test]
    fn nothing_is_put_where_no_thread_takes_it() {
        let (outbox, waiting) = Outbox::new(1_000);
        drop(waiting);
        assert!((0..100).all(|_| !outbox.put(&[0; 100])));
    }
}
