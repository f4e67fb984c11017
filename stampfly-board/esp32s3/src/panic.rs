//! What a panic does: motors off, a message, and then nothing more.
//!
//! The vehicle stays off until somebody switches it off and on. A restart would lose the message, and a vehicle that has
//! fallen has nothing to gain from one.

use crate::cutoff;
use core::panic::PanicInfo;

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cutoff::lock_out();
    // Before the message, which takes its time: a restart would lose it.
    cutoff::stand_down();
    esp_println::println!("\n{info}\nMotors are off. Switch off and on again.");
    loop {
        core::hint::spin_loop();
    }
}
