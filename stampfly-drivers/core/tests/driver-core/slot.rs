//! Two devices on one bus in virtual time: order of their transfers, and waits.

use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};
use stampfly_driver_core::Timebase;
use stampfly_driver_core::slot::{Guest, Lead, Rhythm, SlotError, Slots};
use stampfly_types::{Duration, Instant};
use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::pin::pin;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
use std::task::{Context, Poll, Wake, Waker};

/// Virtual time in nanoseconds, and its waiting futures.
#[derive(Clone, Default)]
struct Clock(Rc<Cell<u64>>, Rc<RefCell<Vec<u64>>>);

impl Clock {
    async fn until(&self, nanos: u64) {
        std::future::poll_fn(|_| {
            if self.0.get() >= nanos {
                return Poll::Ready(());
            }
            self.1.borrow_mut().push(nanos);
            Poll::Pending
        })
        .await;
    }

    /// Runs both futures to their ends, or until this instant.
    fn run<A, B>(
        &self,
        limit: Instant,
        first: impl Future<Output = A>,
        second: impl Future<Output = B>,
    ) -> (Option<A>, Option<B>) {
        let (mut first, mut second) = (pin!(first), pin!(second));
        let (mut done, mut context) = ((None, None), Context::from_waker(Waker::noop()));
        while (done.0.is_none() || done.1.is_none()) && self.now() < limit {
            self.1.borrow_mut().clear();
            // Twice, because one future may have woken the other.
            for _ in 0..2 {
                if done.0.is_none()
                    && let Poll::Ready(value) = first.as_mut().poll(&mut context)
                {
                    done.0 = Some(value);
                }
                if done.1.is_none()
                    && let Poll::Ready(value) = second.as_mut().poll(&mut context)
                {
                    done.1 = Some(value);
                }
            }
            match self.1.borrow().iter().min() {
                Some(next) => self.0.set(self.0.get().max(*next)),
                None => break,
            }
        }
        done
    }
}

impl DelayNs for Clock {
    async fn delay_ns(&mut self, ns: u32) {
        self.until(self.0.get() + u64::from(ns)).await;
    }
}

impl Timebase for Clock {
    fn now(&self) -> Instant {
        Instant::from_micros(self.0.get() / 1_000)
    }
}

/// Record of the transfers: device, start, end.
#[derive(Clone, Default)]
struct Wires(Rc<Cell<bool>>, Rc<RefCell<Vec<(char, u64, u64)>>>);

/// A device whose transfers take the number of microseconds given by their first byte.
struct Device(char, Clock, Wires);

impl ErrorType for Device {
    type Error = Infallible;
}

/// Ends a transfer that is dropped, as the driver of a peripheral does.
struct Transfer<'a>(&'a Device, u64);

impl Drop for Transfer<'_> {
    fn drop(&mut self) {
        let Transfer(Device(name, clock, wires), begun) = self;
        wires.0.set(false);
        wires.1.borrow_mut().push((*name, *begun, clock.0.get() / 1_000));
    }
}

impl SpiDevice for Device {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let [Operation::Write([micros, ..])] = operations else { panic!("one write") };
        assert!(!self.2.0.replace(true), "two transfers at once");
        let _transfer = Transfer(self, self.1.0.get() / 1_000);
        let end = self.1.0.get() + u64::from(*micros) * 1_000;
        self.1.until(end).await;
        Ok(())
    }
}

const LONGEST: Duration = Duration::from_micros(150);
const BEGIN: u64 = 1_000_000;

struct Bench {
    clock: Clock,
    wires: Wires,
}

impl Bench {
    fn new() -> Self {
        let clock = Clock::default();
        clock.0.set(BEGIN * 1_000);
        Self { clock, wires: Wires::default() }
    }

    fn slots(&self) -> Slots<Clock> {
        Slots::new(self.clock.clone(), Rhythm::HZ_400)
    }

    fn devices(&self) -> (Device, Device) {
        let device = |name| Device(name, self.clock.clone(), self.wires.clone());
        (device('l'), device('g'))
    }

    fn transfers(&self, of: char) -> Vec<(u64, u64)> {
        let wires = self.wires.1.borrow();
        wires.iter().filter(|transfer| transfer.0 == of).map(|transfer| (transfer.1, transfer.2)).collect()
    }
}

/// A status read and a FIFO read per period, without end. The periods vary within the guard.
async fn lead(mut device: Lead<'_, Device, Clock>, clock: Clock, late: impl Fn(u64) -> u64) {
    let mut due = clock.0.get();
    for round in 0.. {
        clock.until(due).await;
        device.write(&[14]).await.expect("works");
        clock.until(clock.0.get() + 20_000).await;
        device.write(&[44]).await.expect("works");
        due += (2_500 + late(round)) * 1_000;
    }
}

/// A burst every 10 ms of its own clock, which drifts relative to the lead's.
async fn guest(mut device: Guest<'_, Device, Clock>, clock: Clock, count: u32) -> Vec<u64> {
    let mut waits = Vec::new();
    for _ in 0..count {
        clock.until(clock.0.get() + 9_871_000).await;
        let asked = clock.0.get();
        device.write(&[130]).await.expect("works");
        waits.push((clock.0.get() - asked) / 1_000 - 130);
    }
    waits
}

#[test]
fn a_lead_in_its_rhythm_never_waits_and_its_guest_not_long() {
    // On time, 3 per cent late, early by a varying time up to the guard.
    let rhythms: [fn(u64) -> u64; 3] = [|_| 0, |_| 75, |round| round * 7_919 % 150];
    for late in rhythms {
        let bench = Bench::new();
        let mut slots = bench.slots();
        let (imu, flow) = bench.devices();
        let (imu, flow, bus) = slots.split(imu, flow, LONGEST);
        let (clock, end) = (bench.clock.clone(), Instant::from_micros(BEGIN + 4_000_000));
        let (_, waits) = bench.clock.run(end, lead(imu, clock.clone(), late), guest(flow, clock, 300));
        let waits = waits.expect("all of the guest's transfers");
        assert!(waits.iter().all(|wait| *wait <= 2_650 + 78 + 50), "{:?}", waits.iter().max());
        assert_eq!(bus.delays(), 0);
        let lead = bench.transfers('l');
        assert!(lead.iter().all(|(begun, ended)| matches!(ended - begun, 14 | 44)));
        // Every transfer of the guest is in a pause and ends well before the lead's next one.
        for (begun, ended) in bench.transfers('g') {
            let next = lead.iter().find(|transfer| transfer.0 >= begun).expect("the lead goes on");
            assert!(next.0 >= ended + 100, "{begun} to {ended}, {next:?}");
            let before = lead.iter().rev().find(|transfer| transfer.1 <= begun).expect("the lead was there");
            assert!(begun >= before.1 + 50);
        }
    }
}

#[test]
fn a_guests_long_start_goes_on_in_every_pause() {
    let bench = Bench::new();
    let mut slots = bench.slots();
    let (imu, flow) = bench.devices();
    let (imu, mut flow, bus) = slots.split(imu, flow, LONGEST);
    let start = async {
        for _ in 0..90 {
            flow.write(&[40]).await.expect("works");
        }
        bench.clock.now()
    };
    let lead = lead(imu, bench.clock.clone(), |_| 0);
    let (_, started) = bench.clock.run(Instant::from_micros(BEGIN + 1_000_000), lead, start);
    let ended = started.expect("all transfers");
    assert!(ended < Instant::from_micros(BEGIN + 6_000), "two pauses are enough: {ended}");
    assert_eq!(bus.delays(), 0);
}

#[test]
fn a_guest_goes_on_by_itself_when_the_lead_is_silent() {
    let bench = Bench::new();
    let mut slots = bench.slots();
    let (imu, flow) = bench.devices();
    let (mut imu, flow, _) = slots.split(imu, flow, LONGEST);
    let dies = async {
        for _ in 0..100 {
            imu.write(&[44]).await.expect("works");
            bench.clock.until(bench.clock.0.get() + 2_456_000).await;
        }
        std::future::pending::<()>().await;
    };
    let (_, waits) =
        bench.clock.run(Instant::from_micros(BEGIN + 9_000_000), dies, guest(flow, bench.clock.clone(), 100));
    let waits = waits.expect("all of the guest's transfers");
    assert!(waits.iter().all(|wait| *wait <= 5_000), "two periods: {:?}", waits.iter().max());
    assert!(waits[30..].iter().all(|wait| *wait == 0), "nobody to wait for");
}

#[test]
fn a_guest_that_breaks_its_promise_is_given_up() {
    let bench = Bench::new();
    let mut slots = bench.slots();
    let (imu, flow) = bench.devices();
    let (imu, mut flow, bus) = slots.split(imu, flow, LONGEST);
    let hangs = async {
        let mut outcomes = Vec::new();
        for micros in [150, 200, 255, 100] {
            outcomes.push(flow.write(&[micros]).await);
        }
        outcomes
    };
    let lead = lead(imu, bench.clock.clone(), |_| 0);
    let (_, outcomes) = bench.clock.run(Instant::from_micros(BEGIN + 100_000), lead, hangs);
    let late = Err(SlotError::TooLong);
    assert_eq!(outcomes.expect("ended"), [Ok(()), late, late, Ok(())]);
    assert!(bench.transfers('g').iter().all(|(begun, ended)| ended - begun <= LONGEST.as_micros()));
    assert_eq!(bus.delays(), 0, "the lead did not notice");
}

#[test]
fn a_lead_out_of_its_rhythm_waits_for_one_transfer_at_most() {
    let bench = Bench::new();
    let mut slots = bench.slots();
    let (imu, flow) = bench.devices();
    let (mut imu, mut flow, bus) = slots.split(imu, flow, LONGEST);
    let erratic = async {
        let mut worst = 0;
        for round in 0..2_000u64 {
            bench.clock.until(bench.clock.0.get() + (60 + round * 7_919 % 1_500) * 1_000).await;
            let asked = bench.clock.0.get();
            imu.write(&[44]).await.expect("works");
            worst = worst.max((bench.clock.0.get() - asked) / 1_000 - 44);
        }
        worst
    };
    let greedy = async {
        for _ in 0..100_000 {
            flow.write(&[130]).await.expect("works");
        }
    };
    let (worst, _) = bench.clock.run(Instant::from_micros(BEGIN + 9_000_000), erratic, greedy);
    let worst = worst.expect("the lead is never kept out");
    assert!((1..=LONGEST.as_micros()).contains(&worst), "{worst}");
    assert!(bus.delays() > 0);
}

#[test]
fn whoever_is_dropped_gives_the_bus_back() {
    let bench = Bench::new();
    let mut slots = bench.slots();
    let (imu, flow) = bench.devices();
    let (mut imu, mut flow, _) = slots.split(imu, flow, LONGEST);
    {
        // The lead is silent, so the guest begins. Both futures are dropped, the guest during its
        // transfer and the lead while it waits for it.
        let both = async {
            let (mut first, mut second) = (pin!(flow.write(&[100])), pin!(imu.write(&[10])));
            let mut context = Context::from_waker(Waker::noop());
            assert!(first.as_mut().poll(&mut context).is_pending());
            assert!(second.as_mut().poll(&mut context).is_pending());
        };
        bench.clock.run(Instant::from_micros(BEGIN + 1_000), both, async {});
    }
    assert!(!bench.wires.0.get());
    let (lead, guest) = bench.clock.run(Instant::from_micros(BEGIN + 9_000), imu.write(&[10]), flow.write(&[100]));
    assert!(lead.is_some() && guest.is_some_and(|outcome| outcome.is_ok()));
}

#[test]
fn a_guest_that_never_fits_waits_for_silence() {
    let bench = Bench::new();
    let mut slots = bench.slots();
    let (imu, flow) = bench.devices();
    let (imu, mut flow, _) = slots.split(imu, flow, Duration::from_micros(2_200));
    let lead = lead(imu, bench.clock.clone(), |_| 0);
    let (_, outcome) = bench.clock.run(Instant::from_micros(BEGIN + 100_000), lead, flow.write(&[10]));
    assert_eq!(outcome, None);
}

#[derive(Default)]
struct Bell(AtomicU32);

impl Wake for Bell {
    fn wake(self: Arc<Self>) {
        self.0.fetch_add(1, Relaxed);
    }
}

#[test]
fn each_wakes_the_other_at_its_end() {
    let bench = Bench::new();
    let mut slots = bench.slots();
    let (imu, flow) = bench.devices();
    let (mut imu, mut flow, _) = slots.split(imu, flow, LONGEST);
    let bell = Arc::new(Bell::default());
    let waker = Waker::from(bell.clone());
    let (mut quiet, mut loud) = (Context::from_waker(Waker::noop()), Context::from_waker(&waker));
    {
        let (mut first, mut second) = (pin!(flow.write(&[100])), pin!(imu.write(&[10])));
        assert!(first.as_mut().poll(&mut quiet).is_pending() && second.as_mut().poll(&mut loud).is_pending());
        bench.clock.0.set((BEGIN + 100) * 1_000);
        assert!(first.as_mut().poll(&mut quiet).is_ready());
        assert_eq!(bell.0.load(Relaxed), 1, "the lead waited for the guest");
    }
    {
        let (mut first, mut second) = (pin!(imu.write(&[10])), pin!(flow.write(&[100])));
        assert!(first.as_mut().poll(&mut quiet).is_pending() && second.as_mut().poll(&mut loud).is_pending());
        bench.clock.0.set((BEGIN + 110) * 1_000);
        assert!(first.as_mut().poll(&mut quiet).is_ready());
        assert_eq!(bell.0.load(Relaxed), 2, "the guest waited for the lead");
    }
}

#[test]
fn a_clock_that_stands_still_keeps_nobody_from_the_bus() {
    /// A clock that stands still, with delays that return at once.
    #[derive(Clone)]
    struct Stopped(Rc<Cell<u32>>);
    impl DelayNs for Stopped {
        async fn delay_ns(&mut self, _: u32) {
            self.0.set(self.0.get() + 1);
            assert!(self.0.get() < 100_000, "it waits for ever");
        }
    }
    impl Timebase for Stopped {
        fn now(&self) -> Instant {
            Instant::from_secs(1)
        }
    }
    struct Device;
    impl ErrorType for Device {
        type Error = Infallible;
    }
    impl SpiDevice for Device {
        async fn transaction(&mut self, _: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
            Ok(())
        }
    }
    let mut slots = Slots::new(Stopped(Rc::default()), Rhythm::HZ_400);
    let (mut lead, mut guest, _) = slots.split(Device, Device, Duration::from_micros(200));
    for _ in 0..10 {
        assert_eq!(stampfly_driver_core::blocking::block_on(lead.write(&[0])), Ok(()));
        // The transfer takes no time and may be given up as too long, but the call must return.
        let _ = stampfly_driver_core::blocking::block_on(guest.write(&[0]));
    }
}
