//! Lights with a chip in each, in a chain on one pin: WS2812 and its relatives.

use super::Indicator;
use smart_leds_trait::{RGB8, SmartLedsWrite};
use stampfly_types::messages::Signal;

/// A chain of `N` lights that all show the same colour.
///
/// Writes when the colour changes, and again after a write that failed; for as long as the writer takes, which is
/// 30 µs per light. The order of the colours on the wire is the writer's.
///
/// ```
/// # use core::convert::Infallible;
/// # use smart_leds_trait::{RGB8, SmartLedsWrite};
/// # #[derive(Default)] struct Chain(Vec<RGB8>);
/// # impl SmartLedsWrite for Chain {
/// #     type Error = Infallible;
/// #     type Color = RGB8;
/// #     fn write<T: IntoIterator<Item = I>, I: Into<RGB8>>(&mut self, lights: T) -> Result<(), Infallible> {
/// #         self.0 = lights.into_iter().map(Into::into).collect();
/// #         Ok(())
/// #     }
/// # }
/// use stampfly_drivers::{Indicator, Lights};
/// use stampfly_types::messages::Signal;
///
/// // One light for the state, two below and above the body for the flight mode, as on the StampFly.
/// let (mut status, mut body) = (Lights::<_, 1>::status(Chain::default()), Lights::<_, 2>::body(Chain::default()));
/// let signal = Signal { status: [0, 32, 0], body: [32, 0, 32], ..Default::default() };
/// status.show(&signal);
/// body.show(&signal);
/// assert_eq!(status.writer().0, [RGB8::new(0, 32, 0)]);
/// assert_eq!(body.writer().0, [RGB8::new(32, 0, 32); 2]);
/// ```
#[derive(Clone, Debug)]
pub struct Lights<W, const N: usize> {
    writer: W,
    colour: fn(&Signal) -> [u8; 3],
    /// `None` when nobody knows.
    shown: Option<[u8; 3]>,
}

impl<W, const N: usize> Lights<W, N> {
    /// Lights that show the state.
    #[must_use]
    pub const fn status(writer: W) -> Self {
        Self { writer, colour: |signal| signal.status, shown: None }
    }

    /// Lights that show the flight mode.
    #[must_use]
    pub const fn body(writer: W) -> Self {
        Self { writer, colour: |signal| signal.body, shown: None }
    }

    /// What writes them.
    pub const fn writer(&self) -> &W {
        &self.writer
    }
}

impl<W: SmartLedsWrite, const N: usize> Indicator for Lights<W, N>
where
    RGB8: Into<W::Color>,
{
    fn show(&mut self, signal: &Signal) {
        let colour = (self.colour)(signal);
        if self.shown != Some(colour) {
            let [red, green, blue] = colour;
            let written = self.writer.write([RGB8 { r: red, g: green, b: blue }; N]);
            self.shown = written.is_ok().then_some(colour);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[derive(Default)]
    struct Chain {
        writes: Vec<Vec<RGB8>>,
        fails: bool,
    }

    impl SmartLedsWrite for Chain {
        type Error = ();
        type Color = RGB8;
        fn write<T: IntoIterator<Item = I>, I: Into<RGB8>>(&mut self, lights: T) -> Result<(), ()> {
            self.writes.push(lights.into_iter().map(Into::into).collect());
            if self.fails { Err(()) } else { Ok(()) }
        }
    }

    #[test]
    fn a_colour_is_written_once_and_again_only_when_it_failed() {
        let mut lights = Lights::<_, 3>::status(Chain::default());
        let mut signal = Signal { status: [1, 2, 3], body: [9; 3], ..Default::default() };
        for _ in 0..5 {
            lights.show(&signal);
        }
        assert_eq!(lights.writer.writes, [[RGB8::new(1, 2, 3); 3]]);
        signal.body = [8; 3];
        signal.tone_count = 4;
        lights.show(&signal);
        assert_eq!(lights.writer.writes.len(), 1, "not its business");
        signal.status = [0; 3];
        lights.writer.fails = true;
        lights.show(&signal);
        lights.show(&signal);
        lights.writer.fails = false;
        lights.show(&signal);
        lights.show(&signal);
        assert_eq!(lights.writer.writes.len(), 4, "tried until it worked");
    }
}
