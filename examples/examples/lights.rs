//! The driver of the lights, on two chains that remember what was written.

mod emulated;

use core::cell::RefCell;
use core::convert::Infallible;
use emulated::Terminal;
use examples::drivers::{Failure, lights};
use smart_leds_trait::{RGB8, SmartLedsWrite};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Instant;

/// A chain's writer, and every colour that each of its lights was given.
struct Chain<'a>(&'a RefCell<Vec<Vec<RGB8>>>);

impl SmartLedsWrite for Chain<'_> {
    type Error = Infallible;
    type Color = RGB8;

    fn write<T: IntoIterator<Item = I>, I: Into<RGB8>>(&mut self, colours: T) -> Result<(), Infallible> {
        self.0.borrow_mut().push(colours.into_iter().map(Into::into).collect());
        Ok(())
    }
}

fn main() -> Result<(), Failure<Infallible>> {
    let clock = Clock::new(Instant::ZERO);
    let (status, body) = (RefCell::default(), RefCell::default());
    let shown = block_on(&clock, lights::run(Chain(&status), Chain(&body), clock.clone(), &mut Terminal))?;

    for (chain, lights, changes) in [(status, 1, shown.status_changes), (body, 2, shown.body_changes)] {
        let written: Vec<Vec<RGB8>> = chain.into_inner();
        assert_eq!(written.len(), changes as usize, "a chain is written when its colour changes: {shown:?}");
        assert!(written.iter().all(|colours| colours.len() == lights), "this chain has {lights} lights: {written:?}");
        assert!(written.last().is_some_and(|colours| colours.iter().all(|colour| *colour == RGB8::default())), "dark");
    }
    assert!(shown.rows >= 9 && shown.status_changes > shown.rows, "every state has a light of its own: {shown:?}");
    Ok(())
}
