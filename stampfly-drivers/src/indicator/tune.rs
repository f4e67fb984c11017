//! The notes of each tune.

use stampfly_types::messages::Tone;

/// Frequency in Hz, zero for a pause, and length in ms.
pub(super) type Note = (u16, u16);

const PAUSE: u16 = 0;
const C4: u16 = 262;
const A4: u16 = 440;
const C5: u16 = 523;
const E5: u16 = 659;
const G5: u16 = 784;

/// The notes of a tune, in order.
pub(super) const fn notes(tone: Tone) -> &'static [Note] {
    match tone {
        Tone::None => &[],
        Tone::Start => &[(C5, 100), (E5, 100), (G5, 200)],
        Tone::Ready => &[(C5, 100), (PAUSE, 50), (C5, 100), (PAUSE, 50), (C5, 100)],
        Tone::Arm => &[(E5, 100), (G5, 100)],
        Tone::Disarm => &[(G5, 100), (E5, 100)],
        Tone::Pair => &[(C5, 100), (G5, 100)],
        Tone::LowBattery => &[(A4, 200), (PAUSE, 100), (A4, 200)],
        Tone::Error => &[(C4, 500)],
    }
}
