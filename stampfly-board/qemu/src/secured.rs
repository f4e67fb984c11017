//! What a secured frame costs on emulated cores: `cargo xtask qemu`.
//!
//! Frames of sticks, sealed by a station and opened by the vehicle, and frames whose tag is wrong, which is what a flood consists of; and
//! the same bytes through the crate `chacha20poly1305` alone. A program of its own, so that the flight's is as it was. Instructions are not cycles; see `main.rs`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg_attr(target_arch = "arm", path = "machine/arm.rs")]
#[cfg_attr(target_arch = "riscv32", path = "machine/riscv.rs")]
#[cfg_attr(target_arch = "xtensa", path = "machine/xtensa.rs")]
#[cfg_attr(not(any(target_arch = "arm", target_arch = "riscv32", target_arch = "xtensa")), path = "machine/host.rs")]
mod machine;

use chacha20poly1305::aead::AeadInOut;
use chacha20poly1305::{ChaCha20Poly1305, KeyInit};
use core::hint::black_box;
use stampfly_link::secure::{Key, MAX_FRAME, Payload, Station, Vehicle};
use stampfly_types::messages::PilotInput;
use stampfly_types::{Duration, Instant};

/// Frames that are counted.
const FRAMES: u64 = 64;

#[cfg(not(target_arch = "xtensa"))]
#[cfg_attr(any(target_arch = "arm", target_arch = "riscv32"), machine::entry)]
fn main() -> ! {
    machine::start();
    machine::end(run().is_some())
}

#[cfg(target_arch = "xtensa")]
#[unsafe(no_mangle)]
#[expect(unsafe_code, reason = "xtensa/start.S calls it by its name")]
extern "C" fn main() -> ! {
    machine::start();
    machine::end(run().is_some())
}

/// How much something took.
#[derive(Default)]
struct Tally {
    sum: u64,
    most: u64,
}

impl Tally {
    /// Counts one.
    #[inline(always)]
    fn count<T>(&mut self, what: impl FnOnce() -> T) -> T {
        let before = machine::ticks();
        let result = what();
        let ticks = before.until(machine::ticks());
        (self.sum, self.most) = (self.sum + ticks, self.most.max(ticks));
        result
    }

    /// One line.
    fn print(&self, name: &str) {
        let (mean, most) = (machine::instructions(self.sum) / FRAMES, machine::instructions(self.most));
        machine::line(format_args!("{name}: mean {mean} most {most} count {FRAMES}"));
    }
}

/// Joins, and counts. `None` when a frame is refused that must not be, or the other way round.
fn run() -> Option<()> {
    let key = Key::generate(black_box(1), black_box(*b"0123456789abcdefghijklmnopqrstuv")).ok()?;
    let (mut vehicle, mut station, mut room) = (Vehicle::new(key.clone()), Station::new(key), [0; MAX_FRAME]);
    let mut now = black_box(Instant::from_millis(20));
    let (mut handshake, mut sealed, mut opened, mut refused) = Default::default();
    let handshake: &mut Tally = &mut handshake;
    for turn in 0..2 {
        let length = vehicle.transmit(now, [turn + 1; 8], &mut room)?.len();
        handshake.count(|| station.receive(now, room.get_mut(..length)?).ok())?;
        let length = handshake.count(|| station.transmit(now, [turn + 3; 8], &mut room).map(<[u8]>::len))?;
        handshake.count(|| vehicle.receive(now, room.get_mut(..length)?).ok())?;
    }
    let sticks = black_box(Payload::Sticks(PilotInput { roll: 0.5, throttle: 0.25, ..Default::default() }));
    let tallies: (&mut Tally, &mut Tally, &mut Tally) = (&mut sealed, &mut opened, &mut refused);
    for _ in 0..FRAMES {
        now += Duration::from_millis(20);
        let length = tallies.0.count(|| station.seal(now, &sticks, &mut room).map(<[u8]>::len)).ok()?;
        let mut bad = room;
        *bad.get_mut(length - 1)? ^= 1;
        let taken = tallies.2.count(|| vehicle.receive(now, bad.get_mut(..length)?).ok());
        if taken.is_some() {
            return None;
        }
        let received = tallies.1.count(|| vehicle.receive(now, room.get_mut(..length)?).ok());
        received?.filter(|received| received.payload == sticks)?;
    }
    let cipher = ChaCha20Poly1305::new(&black_box([7; 32]).into());
    let (nonce, head, mut text) = (black_box([1; 12]).into(), black_box([2; 11]), black_box([3; 22]));
    let (mut alone_sealed, mut alone_opened) = (Tally::default(), Tally::default());
    for _ in 0..FRAMES {
        let seal = || cipher.encrypt_inout_detached(&nonce, &head, text.as_mut_slice().into());
        let tag = alone_sealed.count(seal).ok()?;
        let open = || cipher.decrypt_inout_detached(&nonce, &head, text.as_mut_slice().into(), &tag);
        alone_opened.count(open).ok()?;
    }
    alone_sealed.print("cipher alone, sealed");
    alone_opened.print("cipher alone, opened");
    sealed.print("secured frame, sealed");
    opened.print("secured frame, opened");
    refused.print("secured frame, refused");
    Some(())
}
