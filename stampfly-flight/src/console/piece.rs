//! A long reply in pieces, for a console with little memory.

use core::fmt;
use heapless::Vec;

/// The part of a text that begins at some byte, by default the first, and is at most `N` bytes long.
///
/// A board makes its reply into a piece, sends it, and while the piece is cut makes the reply again for the next one. So a
/// reply longer than `N` has to be one that changes nothing, such as the list of parameters. Not needed where a whole
/// reply fits into memory.
///
/// ```
/// use core::fmt::Write;
/// use stampfly_flight::console::Piece;
///
/// let (mut sent, mut piece) = (Vec::new(), Piece::<8>::default());
/// loop {
///     // Fails at the end of the piece, so that nothing is formatted in vain.
///     let _ = write!(piece, "roll {}, pitch {}", 0.25, -0.125);
///     sent.extend_from_slice(piece.bytes());
///     if !piece.is_cut() {
///         break;
///     }
///     piece.start_at(sent.len());
/// }
/// assert_eq!(sent, b"roll 0.25, pitch -0.125");
/// ```
#[derive(Clone, Debug, Default)]
pub struct Piece<const N: usize> {
    /// Bytes still to be left out.
    skip: usize,
    bytes: Vec<u8, N>,
    is_cut: bool,
}

impl<const N: usize> Piece<N> {
    /// Becomes another piece of the text: the one after its first `skip` bytes.
    pub fn start_at(&mut self, skip: usize) {
        self.skip = skip;
        self.bytes.clear();
        self.is_cut = false;
    }

    /// What was kept. It may begin and end within a character.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Is there more of the text?
    #[must_use]
    pub const fn is_cut(&self) -> bool {
        self.is_cut
    }
}

impl<const N: usize> fmt::Write for Piece<N> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let skipped = self.skip.min(text.len());
        self.skip -= skipped;
        for byte in text.bytes().skip(skipped) {
            if self.bytes.push(byte).is_err() {
                self.is_cut = true;
                return Err(fmt::Error);
            }
        }
        Ok(())
    }
}
