//! A button: clicks, double clicks and holds, as they happen. That it was pressed at all is not shown.

use super::Failure;
use core::convert::Infallible;
use core::fmt::Write;
use stampfly_drivers::{Button, Timebase};
use stampfly_mode::ButtonDecoder;
use stampfly_types::Duration;
use stampfly_types::messages::ButtonGesture;

const SPAN: Duration = Duration::from_secs(20);
/// How often the contact is looked at.
const STEP_MS: u32 = 10;

/// What was pressed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pressed {
    /// Short presses.
    pub clicks: u32,
    /// Two of them in quick succession.
    pub double_clicks: u32,
    /// Presses that reached three seconds.
    pub long: u32,
    /// Presses that reached five seconds.
    pub very_long: u32,
}

/// Watches the button for twenty seconds.
///
/// # Errors
/// None from the button: a pin that cannot be read counts as not pressed.
pub async fn run<B: Button, T: Timebase>(
    mut button: B,
    mut clock: T,
    out: &mut impl Write,
) -> Result<Pressed, Failure<Infallible>> {
    writeln!(out, "Press the button: once, twice quickly, for three seconds, for five.")?;
    let mut decoder = ButtonDecoder::default();
    let mut pressed = Pressed::default();
    let begun = clock.now();
    while clock.now() < begun + SPAN {
        if let Some(event) = decoder.step(clock.now(), button.is_pressed()) {
            let (what, count) = match event.gesture {
                // Of a press only what it becomes is counted.
                ButtonGesture::None | ButtonGesture::Press => continue,
                ButtonGesture::Click => ("click", &mut pressed.clicks),
                ButtonGesture::DoubleClick => ("double click", &mut pressed.double_clicks),
                ButtonGesture::HoldPair => ("long press", &mut pressed.long),
                ButtonGesture::HoldReset => ("very long press", &mut pressed.very_long),
            };
            *count += 1;
            writeln!(out, "{:5.2} s  {what:<15} {:.2} s", clock.now().since(begun).seconds(), event.held)?;
        }
        clock.delay_ms(STEP_MS).await;
    }
    writeln!(
        out,
        "{} clicks, {} double clicks, {} long and {} very long presses",
        pressed.clicks, pressed.double_clicks, pressed.long, pressed.very_long
    )?;
    Ok(pressed)
}
