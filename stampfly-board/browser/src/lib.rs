//! The StampFly and its world in a web page.
//!
//! The whole flight stack, its simulator and the ground station's end of the conversation, as one WebAssembly module. A page gives it
//! texts and time, and takes texts: the same that `stampfly serve` sends over a WebSocket, so the page is the same, too.
//!
//! | part | what it is |
//! |---|---|
//! | `demo.rs` | vehicles in one world, moved on by so much time; a flight again with other parameters |
//! | `flight.rs` | one vehicle: its flight, its ports, its log |
//! | the functions here | what the page calls |
//!
//! # Why there is `unsafe` here
//! A function that a page calls needs a name that the compiler does not change. Rust calls the attribute unsafe because two such
//! functions could have the same name; these are all there are. Nothing else here is: texts go through a buffer that the page
//! reads and writes in the module's memory, and the module looks at it only between calls.

mod demo;
mod flight;

pub use demo::Demo;
use std::cell::RefCell;

thread_local! {
    static DEMO: RefCell<Demo> = RefCell::new(Demo::new(1));
    /// What goes in or out.
    static TEXT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Makes room for a text of so many bytes, and says where.
#[unsafe(no_mangle)]
pub extern "C" fn text_room(length: u32) -> *mut u8 {
    TEXT.with_borrow_mut(|text| {
        text.clear();
        text.resize(length as usize, 0);
        text.as_mut_ptr()
    })
}

/// Where the text is that the last function has left.
#[unsafe(no_mangle)]
pub extern "C" fn text_place() -> *const u8 {
    TEXT.with_borrow(|text| text.as_ptr())
}

/// Leaves a text, and returns its length.
fn leave(said: Vec<u8>) -> u32 {
    let length = said.len() as u32;
    TEXT.set(said);
    length
}

/// Begins again, with this seed.
#[unsafe(no_mangle)]
pub extern "C" fn begin(seed: u32) {
    DEMO.set(Demo::new(seed.into()));
}

/// Takes the text in the buffer: an ask of a page.
#[unsafe(no_mangle)]
pub extern "C" fn hear() {
    let text = TEXT.take();
    DEMO.with_borrow_mut(|demo| demo.hear(&text));
}

/// Flies for so many microseconds of the vehicle's time.
#[unsafe(no_mangle)]
pub extern "C" fn go_on(microseconds: u32) {
    DEMO.with_borrow_mut(|demo| demo.go_on(microseconds.into()));
}

/// Leaves the texts for the page, one a line.
#[unsafe(no_mangle)]
pub extern "C" fn say() -> u32 {
    leave(DEMO.with_borrow_mut(|demo| demo.say()).into_bytes())
}

/// Leaves the log of a vehicle so far.
#[unsafe(no_mangle)]
pub extern "C" fn log(vehicle: u32) -> u32 {
    leave(DEMO.with_borrow(|demo| demo.log(vehicle as usize)))
}

/// Flies the reference mission with this seed as fast as can be, and leaves its hash, duration and sentence as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn reference(seed: u32) -> u32 {
    leave(demo::reference(seed.into()).into_bytes())
}
