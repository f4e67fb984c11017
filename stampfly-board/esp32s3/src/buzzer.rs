//! The buzzer: tunes, note by note, on a timer of the PWM unit that the motors do not use.

use esp_hal::gpio::{AnyPin, DriveMode};
use esp_hal::ledc::LowSpeed;
use esp_hal::ledc::channel::{self, Channel, ChannelIFace};
use esp_hal::ledc::timer::{self, LSClockSource, Timer, TimerIFace};
use esp_hal::peripherals::LEDC;
use esp_hal::time::Rate;
use stampfly_types::Micros;
use stampfly_types::messages::{Signal, Tone};
use static_cell::StaticCell;

/// A note: its frequency in hertz, zero for a rest, and how long it sounds.
type Note = (u32, Micros);

const A4: u32 = 440;
const C4: u32 = 262;
const C5: u32 = 523;
const E5: u32 = 659;
const G5: u32 = 784;

const fn ms(note: u32, millis: u64) -> Note {
    (note, Micros::from_millis(millis))
}

/// The notes of each tune.
const fn notes(tone: Tone) -> &'static [Note] {
    match tone {
        Tone::None => const { &[] },
        Tone::Start => const { &[ms(C5, 100), ms(E5, 100), ms(G5, 200)] },
        Tone::Ready => const { &[ms(C5, 100), ms(0, 50), ms(C5, 100), ms(0, 50), ms(C5, 100)] },
        Tone::Arm => const { &[ms(E5, 100), ms(G5, 100)] },
        Tone::Disarm => const { &[ms(G5, 100), ms(E5, 100)] },
        Tone::Pair => const { &[ms(C5, 100), ms(G5, 100)] },
        Tone::LowBattery => const { &[ms(A4, 200), ms(0, 100), ms(A4, 200)] },
        Tone::Error => const { &[ms(C4, 500)] },
    }
}

/// Half on, half off is loudest.
const LOUD: u8 = 50;

/// The buzzer. The motors' unit must have been started.
pub struct Buzzer {
    channel: Channel<'static, LowSpeed>,
    playing: &'static [Note],
    /// When the present note ends.
    until: Micros,
    /// The tune that was started last.
    heard: u32,
}

impl Buzzer {
    /// Silence.
    pub fn new(pin: AnyPin<'static>) -> Self {
        static TIMER: StaticCell<Timer<'static, LowSpeed>> = StaticCell::new();
        let timer = TIMER.init(tuned(C5));
        let mut channel = Channel::new(channel::Number::Channel4, pin);
        let config = channel::config::Config { timer, duty_pct: 0, drive_mode: DriveMode::PushPull };
        channel.configure(config).expect("the timer is configured and zero is a duty");
        Self { channel, playing: &[], until: Micros::ZERO, heard: 0 }
    }

    /// Plays on; call it as often as the shortest note is long, or more.
    pub fn step(&mut self, now: Micros, signal: &Signal) {
        if signal.tone_count != self.heard {
            (self.heard, self.playing, self.until) = (signal.tone_count, notes(signal.tone), now);
        } else if now < self.until {
            return;
        }
        match self.playing {
            [(note, length), rest @ ..] => {
                self.sound(*note);
                (self.playing, self.until) = (rest, now + *length);
            }
            [] => self.sound(0),
        }
    }

    fn sound(&mut self, note: u32) {
        if note > 0 {
            tuned(note);
        }
        // A buzzer that cannot be set is silent or not; nothing depends on it.
        let _ = self.channel.set_duty(if note > 0 { LOUD } else { 0 });
    }
}

/// The buzzer's timer at this frequency, in hertz.
fn tuned(frequency: u32) -> Timer<'static, LowSpeed> {
    let mut timer = Timer::new(LEDC::regs(), timer::Number::Timer1);
    let config = timer::config::Config {
        duty: timer::config::Duty::Duty10Bit,
        clock_source: LSClockSource::APBClk,
        frequency: Rate::from_hz(frequency),
    };
    timer.configure(config).expect("every note is within the timer's range");
    timer
}
