//! The writing end of the line.

use embassy_time::{Duration, with_timeout};
use embedded_io_async::Write;
use esp_hal::Async;
use esp_hal::usb::usb_serial_jtag::UsbSerialJtagTx;
use stampfly_flight::black_box::Refused;

/// A terminal that takes nothing for this long is none.
pub(super) const PATIENCE: Duration = Duration::from_millis(200);
/// A terminal in the middle of a log is one, and may be busy.
pub(super) const PATIENCE_WITH_LOG: Duration = Duration::from_secs(3);

/// Where the terminal is.
pub(super) struct Screen(pub(super) UsbSerialJtagTx<'static, Async>);

impl Screen {
    /// Shows a text. Without a terminal it is lost.
    pub(super) async fn show(&mut self, text: &str) {
        if !text.is_empty() {
            let _ = self.offer(text.as_bytes(), PATIENCE).await;
        }
    }

    /// Shows a text to a terminal that takes it in this time.
    pub(super) async fn offer(&mut self, text: &[u8], patience: Duration) -> Result<(), Refused> {
        match with_timeout(patience, self.0.write_all(text)).await {
            Ok(Ok(())) => Ok(()),
            _ => Err(Refused),
        }
    }
}
