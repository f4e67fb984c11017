//! What somebody at the bench sees, hears and touches: status light, buzzer, motors, button, sticks, and their wires.

use super::fault::Defect;
use core::convert::Infallible;
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use stampfly_drivers::SetFrequency;
use stampfly_drivers::smart_leds_trait::{RGB8, SmartLedsWrite};
use stampfly_sim::time::Clock;
use stampfly_types::Instant;
use stampfly_types::messages::PilotInput;
use std::vec::Vec;

/// Which way a motor turns, seen from above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spin {
    /// As a clock.
    Clockwise,
    /// The other way.
    CounterClockwise,
}

impl Spin {
    const fn opposite(self) -> Self {
        match self {
            Self::Clockwise => Self::CounterClockwise,
            Self::CounterClockwise => Self::Clockwise,
        }
    }
}

/// How the motors turn when they are wired as they should be, in motor order.
pub(super) const SPINS: [Spin; 4] = [Spin::CounterClockwise, Spin::Clockwise, Spin::CounterClockwise, Spin::Clockwise];
/// Slower than this nobody calls it turning, rad/s.
const TURNS: f32 = 50.0;

/// The status light, and its supply.
#[derive(Debug)]
pub struct Lamp {
    clock: Clock,
    /// Its supply is off.
    dark: bool,
    on: bool,
    lit: Option<Instant>,
}

impl Lamp {
    pub(super) fn new(clock: &Clock, dark: bool) -> Self {
        Self { clock: clock.clone(), dark, on: false, lit: None }
    }

    pub(super) fn lit(&self) -> Option<Instant> {
        if self.on { Some(self.clock.now()) } else { self.lit }
    }
}

impl SmartLedsWrite for Lamp {
    type Error = Infallible;
    type Color = RGB8;

    fn write<T: IntoIterator<Item = I>, I: Into<RGB8>>(&mut self, colours: T) -> Result<(), Infallible> {
        let any = colours.into_iter().any(|colour| colour.into() != RGB8::default());
        if self.on {
            self.lit = Some(self.clock.now());
        }
        self.on = any && !self.dark;
        Ok(())
    }
}

/// The buzzer behind its PWM channel, and the ear beside it.
#[derive(Debug)]
pub(super) struct Loudspeaker {
    clock: Clock,
    silent: bool,
    hertz: u32,
    heard: Vec<(Instant, u32)>,
}

impl Loudspeaker {
    pub fn new(clock: &Clock, silent: bool) -> Self {
        Self { clock: clock.clone(), silent, hertz: 0, heard: Vec::new() }
    }

    pub fn heard(&self) -> &[(Instant, u32)] {
        &self.heard
    }
}

impl ErrorType for Loudspeaker {
    type Error = Infallible;
}

impl SetDutyCycle for Loudspeaker {
    fn max_duty_cycle(&self) -> u16 {
        1_024
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        if duty > 0 && !self.silent {
            self.heard.push((self.clock.now(), self.hertz));
        }
        Ok(())
    }
}

impl SetFrequency for Loudspeaker {
    fn set_frequency(&mut self, hertz: u32) -> Result<(), Infallible> {
        self.hertz = hertz;
        Ok(())
    }
}

/// Plugs and contacts.
#[derive(Clone, Debug)]
pub(super) struct Wiring {
    /// The motor at each plug; none where it is not plugged in.
    plugs: [Option<usize>; 4],
    /// Plugged in the wrong way round.
    reversed: [bool; 4],
    /// What the button's contact always is.
    contact: Option<bool>,
    defect: Option<Defect>,
}

impl Wiring {
    pub fn of(defect: Option<&Defect>) -> Self {
        let mut wiring =
            Self { plugs: [0, 1, 2, 3].map(Some), reversed: [false; 4], contact: None, defect: defect.copied() };
        match defect {
            Some(Defect::MotorDead(motor)) => wiring.plugs[*motor] = None,
            Some(Defect::MotorReversed(motor)) => wiring.reversed[*motor] = true,
            Some(Defect::MotorsSwapped(one, other)) => wiring.plugs.swap(*one, *other),
            Some(Defect::Button(contact)) => wiring.contact = Some(*contact),
            _ => {}
        }
        wiring
    }

    /// The duty that arrives at each motor.
    pub fn connect(&self, duty: [f32; 8]) -> [f32; 8] {
        let mut arrives = [0.0; 8];
        for (plug, motor) in self.plugs.iter().enumerate() {
            if let Some(motor) = motor {
                arrives[*motor] = duty[plug];
            }
        }
        arrives
    }

    /// How motors of these speeds, rad/s, are seen to turn.
    pub fn look(&self, speed: [f32; 4]) -> [Option<Spin>; 4] {
        core::array::from_fn(|motor| {
            let spin = if self.reversed[motor] { SPINS[motor].opposite() } else { SPINS[motor] };
            (speed[motor] > TURNS).then_some(spin)
        })
    }

    /// What the pin sees of a button that is pressed, or is not.
    pub fn contact(&self, pressed: bool) -> bool {
        self.contact.unwrap_or(pressed)
    }

    /// What a transmitter sends when its sticks are moved so; nothing when it is broken.
    pub fn transmit(&self, sticks: PilotInput) -> Option<PilotInput> {
        match self.defect {
            Some(Defect::Transmitter(sends)) => sends(sticks),
            _ => Some(sticks),
        }
    }
}
