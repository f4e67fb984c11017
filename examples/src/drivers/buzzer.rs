//! A passive buzzer on a PWM channel: every tune, written down note by note as it is played.

use super::Failure;
use core::fmt::Write;
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use stampfly_drivers::{Buzzer, Indicator, SetFrequency, Timebase};
use stampfly_types::Duration;
use stampfly_types::messages::{Signal, Tone};

/// How often the buzzer plays on.
const STEP_MS: u32 = 10;
/// Time for a tune, the longest of which takes half a second, and a pause.
const TUNE: Duration = Duration::from_millis(800);

/// What was played.
#[derive(Clone, Copy, Debug, Default)]
pub struct Played {
    /// Tunes.
    pub tunes: u32,
    /// Notes.
    pub notes: u32,
}

/// A channel that remembers what it was told.
struct Overheard<C> {
    channel: C,
    hertz: u32,
    duty: u16,
}

impl<C> Overheard<C> {
    /// What sounds; zero is silence.
    const fn pitch(&self) -> u32 {
        if self.duty == 0 { 0 } else { self.hertz }
    }
}

impl<C: SetFrequency> ErrorType for Overheard<C> {
    type Error = C::Error;
}

impl<C: SetFrequency> SetDutyCycle for Overheard<C> {
    fn max_duty_cycle(&self) -> u16 {
        self.channel.max_duty_cycle()
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), C::Error> {
        self.duty = duty;
        self.channel.set_duty_cycle(duty)
    }
}

impl<C: SetFrequency> SetFrequency for Overheard<C> {
    fn set_frequency(&mut self, hertz: u32) -> Result<(), C::Error> {
        self.hertz = hertz;
        self.channel.set_frequency(hertz)
    }
}

/// Plays every tune.
///
/// # Errors
/// The channel's.
pub async fn run<C: SetFrequency, T: Timebase>(
    channel: C,
    mut clock: T,
    out: &mut impl Write,
) -> Result<Played, Failure<C::Error>> {
    let mut buzzer = Buzzer::new(Overheard { channel, hertz: 0, duty: 0 });
    let mut played = Played::default();
    for &tone in Tone::ALL.iter().filter(|tone| **tone != Tone::None) {
        played.tunes += 1;
        write!(out, "{:<11}", tone.name())?;
        buzzer.show(&Signal { tone, tone_count: played.tunes, ..Default::default() });
        let begun = clock.now();
        let (mut sounds, mut since) = (0, begun);
        while clock.now() < begun + TUNE {
            let now = clock.now();
            buzzer.step(now).map_err(Failure::Driver)?;
            let pitch = buzzer.channel().pitch();
            if pitch != sounds {
                let length = now.since(since).seconds() * 1_000.0;
                match sounds {
                    0 if now == begun => {}
                    0 => write!(out, " – {length:.0} ms")?,
                    _ => write!(out, " {sounds} Hz {length:.0} ms")?,
                }
                played.notes += u32::from(pitch > 0);
                (sounds, since) = (pitch, now);
            }
            clock.delay_ms(STEP_MS).await;
        }
        writeln!(out)?;
    }
    writeln!(out, "{} tunes, {} notes", played.tunes, played.notes)?;
    Ok(played)
}
