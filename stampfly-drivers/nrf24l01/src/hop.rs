//! Receiving a protocol that hops: it says where, the radio listens there.

use crate::Tuning;
use stampfly_types::Instant;

/// A protocol that hops over channels. It is told the time and what was heard, and says where to listen; it knows of no radio.
///
/// A program implements it for its protocol's receiver, one line a method, and calls [`follow`](crate::Nrf24l01::follow).
///
/// ```
/// use stampfly_nrf24l01::{Duration, Hopper, Instant, Tuning};
///
/// /// Four channels, ten milliseconds each.
/// #[derive(Default)]
/// struct Scanner {
///     turn: u64,
///     heard: u32,
/// }
///
/// impl Hopper<10> for Scanner {
///     fn tuning(&self) -> Tuning {
///         Tuning { channel: 20 * (self.turn % 4) as u8, address: [0xE7; 5] }
///     }
///     fn due(&self) -> Option<Instant> {
///         Some(Instant::ZERO + Duration::from_millis(10) * (self.turn + 1))
///     }
///     fn poll(&mut self, now: Instant) {
///         self.turn = now.as_micros() / 10_000;
///     }
///     fn receive(&mut self, _at: Instant, _packet: &[u8; 10]) {
///         self.heard += 1;
///     }
/// }
/// let mut scanner = Scanner::default();
/// scanner.poll(Instant::from_millis(31));
/// assert_eq!((scanner.tuning().channel, scanner.due()), (60, Some(Instant::from_millis(40))));
/// ```
pub trait Hopper<const N: usize> {
    /// What to listen to now.
    fn tuning(&self) -> Tuning;
    /// When to [`poll`](Self::poll) next; `None` when it stays until it hears something.
    fn due(&self) -> Option<Instant>;
    /// Time has passed.
    fn poll(&mut self, now: Instant);
    /// A packet was heard.
    fn receive(&mut self, at: Instant, packet: &[u8; N]);
}
