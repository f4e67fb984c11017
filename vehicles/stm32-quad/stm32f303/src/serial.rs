//! The serial line: MSP, and what it asks of the board.

use crate::interrupts::Interrupts;
use crate::memory::Memory;
use core::cell::RefCell;
use embassy_futures::select::{Either, select};
use embassy_stm32::Peri;
use embassy_stm32::peripherals::{PA9, PA10, USART1};
use embassy_stm32::usart::{BufferedUart, Config};
use embassy_time::{Duration, Ticker};
use embedded_io_async::{Read as _, Write as _};
use stampfly_bus::Taps as _;
use stampfly_drivers::{EmbassyClock, Timebase as _};
use stampfly_services::Request;
use stampfly_services::msp::Msp;
use stampfly_stm32_quad::Parameters;
use stampfly_stm32_quad::serial::{Board, CARD, Newest, Serial};
use stampfly_stm32_quad::topics::{LinkEnds, Taps};
use static_cell::{ConstStaticCell, StaticCell};

/// Between two looks at what was published.
const TURN: Duration = Duration::from_millis(10);
/// The longest answer has 144 bytes.
const ANSWERS: usize = 256;

/// Answers until power-off.
#[embassy_executor::task]
pub async fn answer(
    port: Peri<'static, USART1>,
    into: Peri<'static, PA10>,
    out: Peri<'static, PA9>,
    memory: &'static RefCell<Memory>,
    mut taps: Taps<'static>,
    ends: LinkEnds<'static>,
) {
    static NEWEST: StaticCell<Newest> = StaticCell::new();
    static SENT: ConstStaticCell<[u8; ANSWERS]> = ConstStaticCell::new([0; ANSWERS]);
    static HEARD: ConstStaticCell<[u8; 64]> = ConstStaticCell::new([0; 64]);
    let newest = NEWEST.init_with(Newest::new);
    let Ok(mut port) = BufferedUart::new(port, into, out, SENT.take(), HEARD.take(), Interrupts, Config::default())
    else {
        return;
    };
    let stored = memory.borrow_mut().load().parameters;
    let mut line = Serial::new(Board::new(&stored, &Parameters::default(), ends));
    let mut msp = Msp::new(&CARD);
    let mut ticker = Ticker::every(TURN);
    let mut bytes = [0; 64];
    loop {
        match select(port.read(&mut bytes), ticker.next()).await {
            Either::First(Ok(count)) => {
                let mut answers = heapless::Vec::<u8, ANSWERS>::new();
                let bytes = bytes.get(..count).unwrap_or_default();
                let now = EmbassyClock.now();
                let asked = line.hear(now, &mut msp, bytes, newest, &mut |frame| {
                    // What does not fit is not answered, as if the question were lost.
                    let _ = answers.extend_from_slice(frame);
                });
                let _ = port.write_all(&answers).await;
                match asked {
                    Some(Request::SaveParameters) => {
                        let parameters = line.poll(now, newest);
                        memory.borrow_mut().change(|stored| stored.parameters = parameters);
                    }
                    Some(Request::Bind) => memory.borrow_mut().ask_to_bind(),
                    _ => {}
                }
            }
            Either::First(Err(_)) => {}
            Either::Second(()) => {
                taps.drain(&mut |topic, at, _, words| newest.note(topic, at, words));
                line.poll(EmbassyClock.now(), newest);
                if let Some(found) = line.found() {
                    memory.borrow_mut().change(|stored| stored.parameters.offset = (&found).into());
                }
            }
        }
    }
}
