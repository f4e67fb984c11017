//! Addressable lights in a chain on one pin: WS2812 and compatible parts.

use super::Indicator;
use smart_leds_trait::{RGB8, SmartLedsWrite, SmartLedsWriteAsync};
use stampfly_types::messages::Signal;
use stampfly_types::{Duration, Instant};

/// Period of repeated writes while the colour does not change.
const REFRESH: Duration = Duration::from_secs(1);

/// A chain of `N` lights that all show the same colour.
///
/// [`show`](Indicator::show) writes when the colour changes or the previous write failed, and
/// blocks for as long as the writer does: 30 µs per light. [`step`](Self::step) repeats the write
/// once a second, because a light that lost its supply for a moment stays dark until it is written
/// again. The writer defines the order of the colours on the wire.
///
/// A blocking writer that waits for its peripheral without a time limit blocks everything on its
/// core when the peripheral hangs. With an async writer use [`update`](Self::update), which
/// combines `show` and `step` and may be dropped at any time.
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
/// use stampfly_types::{Instant, messages::Signal};
///
/// // One status light, and two lights below and above the body for the flight mode, as on the StampFly.
/// let (mut status, mut body) = (Lights::<_, 1>::status(Chain::default()), Lights::<_, 2>::body(Chain::default()));
/// let signal = Signal { status: [0, 32, 0], body: [32, 0, 32], ..Default::default() };
/// status.show(&signal);
/// body.show(&signal);
/// assert_eq!(status.writer().0, [RGB8::new(0, 32, 0)]);
/// assert_eq!(body.writer().0, [RGB8::new(32, 0, 32); 2]);
/// // Call it regularly with the time.
/// status.step(Instant::from_secs(5));
/// ```
#[derive(Clone, Debug)]
pub struct Lights<W, const N: usize> {
    writer: W,
    colour: fn(&Signal) -> [u8; 3],
    /// Colour to show; `None` before the first signal.
    wanted: Option<[u8; 3]>,
    /// Colour that was written last; `None` when that write failed or was dropped.
    shown: Option<[u8; 3]>,
    /// Time of the next repeated write.
    due: Option<Instant>,
}

impl<W, const N: usize> Lights<W, N> {
    /// Lights that show [`Signal::status`].
    #[must_use]
    pub const fn status(writer: W) -> Self {
        Self { writer, colour: |signal| signal.status, wanted: None, shown: None, due: None }
    }

    /// Lights that show [`Signal::body`].
    #[must_use]
    pub const fn body(writer: W) -> Self {
        Self { writer, colour: |signal| signal.body, wanted: None, shown: None, due: None }
    }

    /// The writer of the lights.
    pub const fn writer(&self) -> &W {
        &self.writer
    }
}

impl<W: SmartLedsWrite, const N: usize> Lights<W, N>
where
    RGB8: Into<W::Color>,
{
    /// Repeats the last colour when a second has passed since the previous repetition. May be
    /// called at any rate.
    pub fn step(&mut self, now: Instant) {
        if self.due.is_none_or(|due| now >= due) {
            self.due = Some(now + REFRESH);
            self.write();
        }
    }

    fn write(&mut self) {
        if let Some([red, green, blue]) = self.wanted {
            let written = self.writer.write([RGB8 { r: red, g: green, b: blue }; N]);
            // After a failed write the colour is unknown, so the next signal writes again.
            self.shown = self.wanted.filter(|_| written.is_ok());
        }
    }
}

impl<W: SmartLedsWriteAsync, const N: usize> Lights<W, N>
where
    RGB8: Into<W::Color>,
{
    /// Writes when the colour has changed, when the previous write failed or was dropped, and once
    /// a second. May be called at any rate. Bound it with a time limit, because a writer may wait
    /// for its peripheral without end.
    ///
    /// ```
    /// # use core::convert::Infallible;
    /// # use smart_leds_trait::{RGB8, SmartLedsWriteAsync};
    /// # #[derive(Default)] struct Chain(Vec<RGB8>);
    /// # impl SmartLedsWriteAsync for Chain {
    /// #     type Error = Infallible;
    /// #     type Color = RGB8;
    /// #     async fn write<T: IntoIterator<Item = I>, I: Into<RGB8>>(&mut self, lights: T) -> Result<(), Infallible> {
    /// #         self.0 = lights.into_iter().map(Into::into).collect();
    /// #         Ok(())
    /// #     }
    /// # }
    /// use stampfly_drivers::{Lights, blocking::block_on};
    /// use stampfly_types::{Instant, messages::Signal};
    ///
    /// let mut body = Lights::<_, 2>::body(Chain::default());
    /// let signal = Signal { body: [32, 0, 32], ..Default::default() };
    /// block_on(body.update(&signal, Instant::from_secs(5)));
    /// assert_eq!(body.writer().0, [RGB8::new(32, 0, 32); 2]);
    /// ```
    pub fn update(&mut self, signal: &Signal, now: Instant) -> impl Future<Output = ()> {
        let wanted = (self.colour)(signal);
        let is_due = self.shown != Some(wanted) || self.due.is_none_or(|due| now >= due);
        // Not an `async fn`, which would keep its arguments for the duration of the write.
        async move {
            if !is_due {
                return;
            }
            // If the write is dropped half way, the state of the lights is unknown.
            self.shown = None;
            let [r, g, b] = wanted;
            if self.writer.write([RGB8 { r, g, b }; N]).await.is_ok() {
                self.shown = Some(wanted);
                self.due = Some(now + REFRESH);
            }
        }
    }
}

impl<W: SmartLedsWrite, const N: usize> Indicator for Lights<W, N>
where
    RGB8: Into<W::Color>,
{
    fn show(&mut self, signal: &Signal) {
        self.wanted = Some((self.colour)(signal));
        if self.shown != self.wanted {
            self.write();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocking::block_on;
    use core::pin::pin;
    use core::task::{Context, Waker};
    use std::vec;
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

    #[test]
    fn what_is_shown_is_written_again_once_a_second() {
        let mut lights = Lights::<_, 1>::body(Chain::default());
        lights.step(Instant::ZERO);
        assert!(lights.writer.writes.is_empty(), "nothing to show yet");
        lights.show(&Signal { body: [7; 3], ..Default::default() });
        for millis in 0..5_000 {
            lights.step(Instant::from_millis(millis));
        }
        // One write for the colour, and repetitions at one to four seconds.
        assert_eq!(lights.writer.writes, vec![[RGB8::new(7, 7, 7)]; 5]);
    }

    #[derive(Default)]
    struct AsyncChain {
        writes: Vec<Vec<RGB8>>,
        never_ends: bool,
    }

    impl SmartLedsWriteAsync for AsyncChain {
        type Error = ();
        type Color = RGB8;
        async fn write<T: IntoIterator<Item = I>, I: Into<RGB8>>(&mut self, lights: T) -> Result<(), ()> {
            self.writes.push(lights.into_iter().map(Into::into).collect());
            if self.never_ends {
                core::future::pending::<()>().await;
            }
            Ok(())
        }
    }

    /// Starts an update and drops it.
    fn give_up(lights: &mut Lights<AsyncChain, 1>, signal: &Signal, now: Instant) {
        let write = pin!(lights.update(signal, now));
        assert!(write.poll(&mut Context::from_waker(Waker::noop())).is_pending());
    }

    #[test]
    fn a_write_that_is_given_up_is_written_again_when_the_unit_works() {
        let mut lights = Lights::<_, 1>::body(AsyncChain { never_ends: true, ..Default::default() });
        let signal = Signal { body: [7; 3], ..Default::default() };
        for millis in 0..3 {
            give_up(&mut lights, &signal, Instant::from_millis(millis));
        }
        assert_eq!(lights.writer.writes.len(), 3);
        lights.writer.never_ends = false;
        for millis in 3..5_003 {
            block_on(lights.update(&signal, Instant::from_millis(millis)));
        }
        assert_eq!(lights.writer.writes.len(), 3 + 5, "at once, and then every second");
        block_on(lights.update(&Signal::default(), Instant::from_millis(5_003)));
        assert_eq!(lights.writer.writes.last(), Some(&vec![RGB8::new(0, 0, 0)]), "a new colour is not kept waiting");
        lights.writer.never_ends = true;
        give_up(&mut lights, &signal, Instant::from_millis(5_004));
        lights.writer.never_ends = false;
        block_on(lights.update(&Signal::default(), Instant::from_millis(5_005)));
        assert_eq!(lights.writer.writes.len(), 3 + 5 + 3, "the old colour again: nobody knows what is shown");
    }
}
