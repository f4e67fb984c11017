//! What is kept while it is off: the original's EEPROM image in the last two pages of flash, by turns.
//!
//! A page has a number that grows, the image, and a checksum over both, written last. The page with the highest number and a right checksum counts, and only the other one is
//! erased. So a power cut leaves the image before or the new one. Erasing takes 40 ms, in which nothing else runs: it is done for a disarmed vehicle alone, because
//! configurators, binding and calibration are.

use embassy_stm32::Peri;
use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::peripherals::FLASH;
use stampfly_stm32_quad::Parameters;
use stampfly_stm32_quad::eeprom::{SIZE, Stored};

/// Of the STM32F303CC.
const PAGE: u32 = 2_048;
/// Where the two pages are, behind what `memory.x` gives to the program.
const PAGES: [u32; 2] = [252 * 1_024, 254 * 1_024];
/// Number, image, checksum.
const RECORD: usize = 4 + SIZE + 4;

/// The stored image.
pub struct Memory {
    flash: Flash<'static, Blocking>,
    /// Somebody has asked to bind.
    binding: bool,
}

impl Memory {
    /// In this flash.
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        Self { flash: Flash::new_blocking(flash), binding: false }
    }

    /// What was stored last; a new vehicle's, if nothing was.
    pub fn load(&mut self) -> Stored {
        let newest = self.newest();
        let image = newest.map_or([0xFF; SIZE], |(_, _, image)| image);
        Stored::read(&image, &Parameters::default())
    }

    /// Changes what is stored. A flash that does not take it keeps what it has.
    pub fn change(&mut self, change: impl FnOnce(&mut Stored)) {
        let mut stored = self.load();
        let before = stored;
        change(&mut stored);
        if stored != before {
            self.store(&stored);
        }
    }

    fn store(&mut self, stored: &Stored) {
        let (place, number) = match self.newest() {
            Some((place, number, _)) => (1 - place, number.wrapping_add(1)),
            None => (0, 1),
        };
        let Some(at) = PAGES.get(place) else { return };
        let mut record = [0; RECORD];
        let mut bytes = number.to_le_bytes().into_iter().chain(stored.image());
        record.iter_mut().zip(&mut bytes).for_each(|(place, byte)| *place = byte);
        let sum = checksum(&record[..4 + SIZE]).to_le_bytes();
        record[4 + SIZE..].copy_from_slice(&sum);
        if self.flash.blocking_erase(*at, *at + PAGE).is_ok() {
            let _ = self.flash.blocking_write(*at, &record);
        }
    }

    /// Place, number and image of the page that counts.
    fn newest(&mut self) -> Option<(usize, u32, [u8; SIZE])> {
        let mut read = |(place, at): (usize, &u32)| {
            let mut record = [0; RECORD];
            self.flash.blocking_read(*at, &mut record).ok()?;
            let (number, rest) = record.split_first_chunk::<4>()?;
            let (image, sum) = rest.split_first_chunk::<SIZE>()?;
            let is_whole = checksum(&record[..4 + SIZE]).to_le_bytes() == *sum;
            is_whole.then_some((place, u32::from_le_bytes(*number), *image))
        };
        let [first, second] = [0, 1].map(|place| PAGES.get(place).and_then(|at| read((place, at))));
        match (first, second) {
            // The numbers may have wrapped around.
            (Some(first), Some(second)) if (second.1.wrapping_sub(first.1) as i32) > 0 => Some(second),
            (first, second) => first.or(second),
        }
    }

    /// The radio listens for a transmitter that binds, soon.
    pub fn ask_to_bind(&mut self) {
        self.binding = true;
    }

    /// Has somebody asked for that? Says so once.
    pub fn is_binding_asked(&mut self) -> bool {
        core::mem::take(&mut self.binding)
    }
}

/// CRC-32 as Ethernet has it, bit by bit: it is computed a few times in a vehicle's life.
fn checksum(bytes: &[u8]) -> u32 {
    let step = |sum: u32, _: u32| if sum & 1 == 1 { sum >> 1 ^ 0xEDB8_8320 } else { sum >> 1 };
    !bytes.iter().fold(u32::MAX, |sum, byte| (0..8).fold(sum ^ u32::from(*byte), step))
}
