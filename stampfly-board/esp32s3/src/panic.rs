//! What a panic does: motors off, a message, and then nothing more.
//!
//! The vehicle stays off until somebody switches it off and on. A restart would lose the message, and a vehicle that has
//! fallen has nothing to gain from one.

use crate::cutoff;
use core::panic::PanicInfo;

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cutoff::trip_for_good();
    esp_println::println!("\n{info}\nMotors are off. Switch off and on again.");
    cutoff::stand_down();
    loop {
        core::hint::spin_loop();
    }
}
