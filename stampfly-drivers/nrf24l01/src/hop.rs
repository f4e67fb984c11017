//! Interface between the driver and receivers of frequency-hopping protocols.

use crate::Tuning;
use stampfly_types::Instant;

/// A frequency-hopping protocol. It gets the time and received packets, and chooses the channel; it
/// does not depend on the radio.
///
/// A program implements this trait for the receiver of its protocol, one line per method, and calls
/// [`follow`](crate::Nrf24l01::follow).
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
    /// Channel and address to listen to now.
    fn tuning(&self) -> Tuning;
    /// Time of the next [`poll`](Self::poll); `None` when the tuning changes only after a packet.
    fn due(&self) -> Option<Instant>;
    /// Updates the protocol to the present time.
    fn poll(&mut self, now: Instant);
    /// Passes a received packet to the protocol.
    fn receive(&mut self, at: Instant, packet: &[u8; N]);
}
