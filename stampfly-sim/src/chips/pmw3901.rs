//! Emulator of the optical flow sensor PMW3901MB: PixArt's data sheet ("DS" below), on SPI at up to
//! 2 MHz.
//!
//! | register | content | DS |
//! |---|---|---|
//! | 0x00, 0x5F | identity 0x49 and its inverse 0xB6 | register list |
//! | 0x02 | motion (7); reading it latches the counts | register list |
//! | 0x03–0x06 | counts x, y since the last latch, low byte first | register list |
//! | 0x07 | features (SQUAL) | register list |
//! | 0x08–0x0C | sum, maximum, minimum of the picture, shutter low and high | register list |
//! | 0x16 | burst of 12: motion, observation, x, y, SQUAL, sum, maximum, minimum, shutter high, low | burst mode |
//! | 0x3A | 0x5A resets | power-up |
//! | 0x7F | bank of the registers for the performance settings | performance list |
//!
//! Bit 7 of the address marks a write. 35 µs have to pass between address and data of a read, 45 µs
//! after a write, 20 µs after a read. At the end of a write the chip select stays low for 35 µs
//! after the last clock, tSCLK-NCS (DS, timing). Start-up takes 45 ms. The data sheet's list of
//! performance settings has to be written.
//!
//! *Unverified*: data clocked out too early are zero, and commands that come too early are lost
//! (the burst without its pause is reported to work in practice); a write whose chip select rises
//! too early is lost (drivers without the wait are reported to work as well); zero motion and
//! quality without the performance settings; 0x08 at 0x47 of bank 0x0E, and the values of 0x67,
//! 0x70, 0x71 and 0x73; which entries of the list matter (required are those in which its public
//! copies agree, in their order and with their pause); the list can be read back; 5 ms for a reset;
//! observation 0xBF; sum, maximum and minimum of the picture, which only follow the quality, also
//! in the dark; a broken array gives pictures without light and without exposure. Section numbers
//! differ between the public revisions and are not given. Not modelled: shutdown, frame capture,
//! the motion pin.

use super::{Chip, Flaw, SpiChip};
use crate::sensors::flow::FlowPhysics;
use crate::time::Clock;
use crate::world::World;
use stampfly_types::{Duration, Instant};

const START_UP: Duration = Duration::from_micros(45_000);
const RESET_TIME: Duration = Duration::from_micros(5_000);
const READ_PAUSE: Duration = Duration::from_micros(35);
const WRITE_HOLD: Duration = Duration::from_micros(35);
const AFTER_WRITE: Duration = Duration::from_micros(45);
const AFTER_READ: Duration = Duration::from_micros(20);
const MOTION: u16 = 0x02;
const BURST: u8 = 0x16;
const RESET: u16 = 0x3A;
const BANK: u16 = 0x7F;
/// Quality below which the shutter is fully open.
const DARK: u8 = 25;

/// Performance list: bank, register and value, in the order in which its public copies agree. It
/// begins with the values derived from the specimen's own at 0x70 and 0x71 of bank 0x0E: 26 + 14
/// and 45 % of 96.
#[rustfmt::skip]
const PERFORMANCE: [(u8, u8, u8); 57] = [
    (0x00, 0x61, 0xAD), (0x00, 0x51, 0x70), (0x0E, 0x70, 0x28), (0x0E, 0x71, 0x2B), (0x00, 0x61, 0xAD),
    (0x03, 0x40, 0x00), (0x05, 0x41, 0xB3), (0x05, 0x43, 0xF1), (0x05, 0x45, 0x14), (0x05, 0x5B, 0x32),
    (0x05, 0x5F, 0x34), (0x05, 0x7B, 0x08), (0x06, 0x44, 0x1B), (0x06, 0x40, 0xBF), (0x06, 0x4E, 0x3F),
    (0x08, 0x65, 0x20), (0x08, 0x6A, 0x18), (0x09, 0x4F, 0xAF), (0x09, 0x5F, 0x40), (0x09, 0x48, 0x80),
    (0x09, 0x49, 0x80), (0x09, 0x57, 0x77), (0x09, 0x60, 0x78), (0x09, 0x61, 0x78), (0x09, 0x62, 0x08),
    (0x09, 0x63, 0x50), (0x0A, 0x45, 0x60), (0x00, 0x4D, 0x11), (0x00, 0x55, 0x80), (0x00, 0x74, 0x1F),
    (0x00, 0x75, 0x1F), (0x00, 0x4A, 0x78), (0x00, 0x4B, 0x78), (0x00, 0x44, 0x08), (0x00, 0x45, 0x50),
    (0x00, 0x64, 0xFF), (0x00, 0x65, 0x1F), (0x14, 0x66, 0x08), (0x07, 0x41, 0x0D), (0x07, 0x43, 0x14),
    (0x07, 0x4B, 0x0E), (0x07, 0x45, 0x0F), (0x07, 0x44, 0x42), (0x07, 0x4C, 0x80), (0x10, 0x5B, 0x02),
    (0x07, 0x40, 0x41), (0x07, 0x70, 0x00), (0x07, 0x32, 0x44), (0x07, 0x40, 0x40), (0x06, 0x62, 0xF0),
    (0x06, 0x63, 0x00), (0x0D, 0x48, 0xC0), (0x0D, 0x6F, 0xD5), (0x00, 0x5B, 0xA0), (0x00, 0x4E, 0xA8),
    (0x00, 0x5A, 0x50), (0x00, 0x40, 0x80),
];
/// Bank and register of entries whose values differ between the copies.
const DISPUTED: [(u8, u8); 3] = [(0x14, 0x65), (0x14, 0x63), (0x15, 0x48)];
/// The entry before which every copy pauses, and the least pause.
const AFTER_PAUSE: (u8, u8, u8) = (0x07, 0x32, 0x44);
const PAUSE: Duration = Duration::from_micros(10_000);
/// The specimen's own values at 0x70 and 0x71 of bank 0, from which the list derives settings if
/// 0x73 reads zero.
const FACTORY: [u8; 2] = [0x1A, 0x60];

/// The emulator. The same seed gives the same specimen as [`FlowModel`](crate::sensors::FlowModel).
///
/// ```
/// use embedded_hal::spi::{Operation, SpiDevice};
/// use stampfly_sim::chips::{Pmw3901, SpiBus};
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::Instant;
///
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// let chip = Pmw3901::new(&simulation.world, &clock, 1);
/// let (mut port, _) = SpiBus::new(&clock, 1).attach(2_000_000, chip);
/// clock.advance_to(Instant::from_millis(45));
/// let mut id = [0];
/// port.transaction(&mut [Operation::Write(&[0]), Operation::DelayNs(35_000), Operation::Read(&mut id)])?;
/// assert_eq!(id, [0x49]);
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Debug)]
pub struct Pmw3901 {
    physics: FlowPhysics,
    id: u8,
    ready: Instant,
    banks: Vec<[u8; 128]>,
    bank: u8,
    /// Number of entries of the performance list written in order, and the instant of the last.
    tuned: usize,
    tuned_at: Instant,
    /// Counts of the last latch.
    latched: [i16; 2],
    moved: bool,
    /// The array is broken.
    broken: bool,
    flaw: Option<Flaw>,
    /// Earliest begin of the next command.
    idle_until: Instant,
    /// Address byte of this transfer, its instant, and whether it came late enough.
    command: u8,
    commanded: Instant,
    accepts: bool,
    /// Value of a write in progress, and its instant.
    written: Option<(u8, Instant)>,
    /// Content of the present burst.
    burst: [u8; 12],
}

impl Pmw3901 {
    /// A chip after power-on.
    #[must_use]
    pub fn new(world: &World, clock: &Clock, seed: u64) -> Self {
        let now = clock.now();
        let mut chip = Self {
            physics: FlowPhysics::new(world, now, seed).0,
            id: 0x49,
            ready: now,
            banks: Vec::new(),
            bank: 0,
            tuned: 0,
            tuned_at: now,
            latched: [0; 2],
            moved: false,
            broken: false,
            flaw: None,
            idle_until: now,
            command: 0,
            commanded: now,
            accepts: false,
            written: None,
            burst: [0; 12],
        };
        chip.reset(now);
        chip
    }

    /// True if the performance list has been written.
    fn is_tuned(&self) -> bool {
        self.tuned == PERFORMANCE.len()
    }

    /// Tracks writing of the performance list; an entry out of order restarts it.
    fn tune(&mut self, entry: (u8, u8, u8), now: Instant) {
        let paused = entry != AFTER_PAUSE || now.since(self.tuned_at) >= PAUSE;
        self.tuned = match PERFORMANCE.get(self.tuned) {
            Some(expected) if *expected == entry && paused => self.tuned + 1,
            _ if DISPUTED.contains(&(entry.0, entry.1)) => return,
            // Rewriting an entry with its value, or writing a register outside the list, is
            // harmless.
            None if PERFORMANCE
                .iter()
                .rev()
                .find(|known| (known.0, known.1) == (entry.0, entry.1))
                .is_none_or(|known| known.2 == entry.2) =>
            {
                return;
            }
            _ => usize::from(entry == PERFORMANCE[0]),
        };
        self.tuned_at = now;
    }

    fn quality(&mut self, now: Instant) -> u8 {
        let quality = self.physics.quality(now);
        if self.is_tuned() && !self.broken { quality } else { 0 }
    }

    /// Sum, maximum and minimum of a picture of this quality, then upper and lower byte of the
    /// shutter.
    const fn picture(&self, quality: u8) -> [u8; 5] {
        if self.broken {
            return [0; 5];
        }
        // The picture has seven bits.
        let light = quality / 4;
        [light + 20, light + 40, light, if quality < DARK { 0x1F } else { 0x03 }, 0x80]
    }

    fn latch(&mut self, now: Instant) {
        let [x, y] = self.physics.read(now);
        let [x, y, _] = Flaw::turn(self.flaw, [x, y, 0.0]);
        // Flow along body x is −y of the chip as mounted, flow along body y is x.
        self.latched = if self.is_tuned() && !self.broken { [y as i16, -x as i16] } else { [0; 2] };
        self.moved = self.latched != [0; 2];
    }

    /// Registers of bank 0 with computed content.
    fn measure(&mut self, register: u16, now: Instant) -> Option<u8> {
        let [x, y] = self.latched.map(i16::to_le_bytes);
        Some(match register {
            0x00 => self.id,
            0x5F => !self.id,
            MOTION => {
                self.latch(now);
                u8::from(self.moved) << 7
            }
            0x03 => x[0],
            0x04 => x[1],
            0x05 => y[0],
            0x06 => y[1],
            0x07 => self.quality(now),
            0x08..=0x0A => {
                let quality = self.quality(now);
                self.picture(quality)[usize::from(register - 0x08)]
            }
            0x0B => self.picture(0)[4],
            0x0C => {
                let quality = self.quality(now);
                self.picture(quality)[3]
            }
            0x15 => 0xBF,
            0x67 => 0x80,
            0x70 | 0x71 => FACTORY[usize::from(register - 0x70)],
            0x73 => 0,
            _ => return None,
        })
    }

    fn fill_burst(&mut self, now: Instant) {
        self.latch(now);
        let quality = self.quality(now);
        let [[x_low, x_high], [y_low, y_high]] = self.latched.map(i16::to_le_bytes);
        let [sum, maximum, minimum, shutter_high, shutter_low] = self.picture(quality);
        let moved = u8::from(self.moved) << 7;
        self.burst =
            [moved, 0xBF, x_low, x_high, y_low, y_high, quality, sum, maximum, minimum, shutter_high, shutter_low];
    }
}

impl Chip for Pmw3901 {
    fn read(&mut self, register: u16, now: Instant) -> u16 {
        if now < self.ready {
            return 0;
        }
        let register = register & 0x7F;
        // The list's check acts in bank 0x0E. The specimen's values are in banks 0 and 0x0E; in
        // 0x0E they can be overwritten.
        let specimen = self.bank == 0x0E && !matches!(register, 0x70 | 0x71);
        let measured = if self.bank == 0 || specimen { self.measure(register, now) } else { None };
        let stored = self.banks[usize::from(self.bank)][usize::from(register)];
        let checked = self.bank == 0x0E && register == 0x47 && self.banks[0x0E][0x43] == 0x10;
        u16::from(if checked { 0x08 } else { measured.unwrap_or(stored) })
    }

    fn write(&mut self, register: u16, value: u16, now: Instant) {
        if now < self.ready {
            return;
        }
        let (register, value) = (register & 0x7F, value as u8);
        match register {
            BANK => self.bank = value & 0x1F,
            RESET if value == 0x5A && self.bank == 0 => {
                self.reset(now);
                self.ready = now + RESET_TIME;
            }
            _ => {
                self.banks[usize::from(self.bank)][usize::from(register)] = value;
                self.tune((self.bank, register as u8, value), now);
            }
        }
    }

    fn reset(&mut self, now: Instant) {
        self.ready = now + START_UP;
        // Unwritten memory must not look like a setting: no value of the list is 0xEE.
        self.banks = vec![[0xEE; 128]; 32];
        self.banks[0x0E][0x70..0x72].copy_from_slice(&FACTORY);
        self.bank = 0;
        self.tuned = 0;
        self.latched = [0; 2];
        self.moved = false;
        self.physics.read(now);
    }

    fn set_id(&mut self, id: u16) {
        self.id = id as u8;
    }

    fn set_flaw(&mut self, flaw: Option<Flaw>) {
        self.flaw = flaw;
    }

    fn set_broken(&mut self, broken: bool) {
        self.broken = broken;
    }
}

impl SpiChip for Pmw3901 {
    const HIGHEST_CLOCK: u32 = 2_000_000;

    fn answer(&mut self, index: usize, now: Instant) -> u8 {
        let reads = index > 0 && self.accepts && self.command & 0x80 == 0;
        if !reads || now < self.commanded + READ_PAUSE || now < self.ready {
            return 0;
        }
        if self.command != BURST {
            return if index == 1 { self.read(u16::from(self.command), now) as u8 } else { 0 };
        }
        if index == 1 {
            self.fill_burst(now);
        }
        self.burst.get(index - 1).copied().unwrap_or(0)
    }

    fn take(&mut self, index: usize, byte: u8, now: Instant) {
        if index == 0 {
            self.command = byte;
            self.commanded = now;
            self.accepts = now >= self.idle_until;
            self.written = None;
        } else if index == 1 && self.accepts && self.command & 0x80 != 0 {
            self.written = Some((byte, now));
        }
    }

    fn release(&mut self, now: Instant) {
        if let Some((value, at)) = self.written.take_if(|(_, at)| now >= *at + WRITE_HOLD) {
            self.write(u16::from(self.command), u16::from(value), at);
        }
        if self.accepts {
            self.idle_until = now + if self.command & 0x80 != 0 { AFTER_WRITE } else { AFTER_READ };
        }
    }
}
