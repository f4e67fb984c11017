//! Deterministic executor on virtual time.
//!
//! It polls all tasks that are due at an instant and then advances the clock to the next deadline.
//! Tasks due at the same instant run in the order of (deadline, spawn), so the same program always
//! interleaves the same way. A task may also wait for another task through any channel that uses
//! wakers; it then runs again within the same instant.

use super::Clock;
use core::future::Future;
use core::pin::{Pin, pin};
use core::sync::atomic::{AtomicBool, Ordering};
use core::task::{Context, Poll, Waker};
use stampfly_types::Instant;
use std::sync::Arc;
use std::task::Wake;

/// Wake flag of a task, set by any event other than time.
///
/// Atomic because [`Waker`] requires `Send`; there is only one thread.
struct Bell {
    rung: AtomicBool,
    any_rung: Arc<AtomicBool>,
}

impl Wake for Bell {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.rung.store(true, Ordering::Relaxed);
        self.any_rung.store(true, Ordering::Relaxed);
    }
}

struct Task<'a> {
    future: Pin<Box<dyn Future<Output = ()> + 'a>>,
    bell: Arc<Bell>,
    waker: Waker,
}

/// A set of tasks that share a [`Clock`].
///
/// ```
/// use std::cell::RefCell;
/// use stampfly_sim::time::{Clock, Tasks};
/// use stampfly_types::Instant;
///
/// let clock = Clock::new(Instant::ZERO);
/// let seen = RefCell::new(Vec::new());
/// let (log, watch) = (&seen, &clock);
/// let mut tasks = Tasks::new(clock.clone());
/// for (name, period) in [("slow", 50), ("fast", 20)] {
///     tasks.spawn(async move {
///         for tick in 1..=2 {
///             watch.sleep_until(Instant::from_millis(tick * period)).await;
///             log.borrow_mut().push((watch.now().as_micros() / 1000, name));
///         }
///     });
/// }
/// tasks.run_until(Instant::from_millis(90));
/// drop(tasks);
/// assert_eq!(clock.now(), Instant::from_millis(90));
/// assert_eq!(seen.into_inner(), [(20, "fast"), (40, "fast"), (50, "slow")]);
/// ```
pub struct Tasks<'a> {
    clock: Clock,
    tasks: Vec<Option<Task<'a>>>,
    /// Deadline of each task; [`NEVER`] for a task that does not wait for time.
    deadlines: Vec<Instant>,
    /// The smallest (deadline, spawn order). Cached after each poll because it is read several
    /// times as often.
    first: (Instant, usize),
    any_rung: Arc<AtomicBool>,
}

/// No deadline.
const NEVER: Instant = Instant::from_micros(u64::MAX);

impl<'a> Tasks<'a> {
    /// An executor without tasks.
    #[must_use]
    pub fn new(clock: Clock) -> Self {
        let (tasks, deadlines) = (Vec::new(), Vec::new());
        Self { clock, tasks, deadlines, first: (NEVER, 0), any_rung: Arc::new(AtomicBool::new(false)) }
    }

    /// Adds a task. It is first polled in the next step, at the instant the clock shows then.
    pub fn spawn(&mut self, future: impl Future<Output = ()> + 'a) {
        let bell = Arc::new(Bell { rung: AtomicBool::new(true), any_rung: self.any_rung.clone() });
        self.any_rung.store(true, Ordering::Relaxed);
        let waker = Waker::from(bell.clone());
        self.tasks.push(Some(Task { future: Box::pin(future), bell, waker }));
        self.deadlines.push(NEVER);
    }

    /// Number of unfinished tasks.
    #[must_use]
    pub fn len(&self) -> usize {
        self.tasks.iter().flatten().count()
    }

    /// True when all tasks have finished.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Instant of the next step; `None` if no task waits for time or has been woken.
    #[must_use]
    pub fn next_deadline(&self) -> Option<Instant> {
        let (deadline, _) = self.first;
        if self.any_rung.load(Ordering::Relaxed) {
            return Some(self.clock.now());
        }
        (deadline != NEVER).then_some(deadline)
    }

    /// Runs all tasks due at the next deadline and returns that instant.
    ///
    /// Returns `None` and does nothing if no task waits for time or has been woken.
    pub fn step(&mut self) -> Option<Instant> {
        self.clock.advance_to(self.next_deadline()?);
        self.answer_bells();
        while let (deadline, index) = self.first
            && deadline <= self.clock.now()
        {
            self.poll(index);
            self.answer_bells();
        }
        Some(self.clock.now())
    }

    /// Runs all tasks due up to and including `instant`, and leaves the clock there.
    pub fn run_until(&mut self, instant: Instant) {
        while self.next_deadline().is_some_and(|deadline| deadline <= instant) {
            self.step();
        }
        self.clock.advance_to(instant);
    }

    /// Polls woken tasks in spawn order until none is woken.
    fn answer_bells(&mut self) {
        // A load is cheaper than a swap, and wakes are rare.
        while self.any_rung.load(Ordering::Relaxed) && self.any_rung.swap(false, Ordering::Relaxed) {
            for index in 0..self.tasks.len() {
                if self.tasks[index].as_ref().is_some_and(|task| task.bell.rung.swap(false, Ordering::Relaxed)) {
                    self.poll(index);
                }
            }
        }
    }

    fn poll(&mut self, index: usize) {
        let Some(task) = &mut self.tasks[index] else { return };
        // Discards a deadline that a poll outside this executor has left.
        self.clock.take_wanted();
        match task.future.as_mut().poll(&mut Context::from_waker(&task.waker)) {
            Poll::Ready(()) => {
                self.tasks[index] = None;
                self.deadlines[index] = NEVER;
            }
            Poll::Pending => self.deadlines[index] = self.clock.take_wanted().unwrap_or(NEVER),
        }
        // A linear search: there are few tasks, and the strict comparison keeps spawn order among
        // equals.
        self.first = (NEVER, 0);
        for (index, deadline) in self.deadlines.iter().enumerate() {
            if *deadline < self.first.0 {
                self.first = (*deadline, index);
            }
        }
    }
}

/// Runs one future to completion, advancing the clock from deadline to deadline.
///
/// # Panics
/// If the future waits for anything other than the clock, since nothing could ever wake it.
pub fn block_on<T>(clock: &Clock, future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        clock.take_wanted();
        if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
            return value;
        }
        clock.advance_to(clock.take_wanted().expect("the future waits for something that is not the clock"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;
    use std::collections::VecDeque;
    use std::future::poll_fn;

    #[test]
    fn tasks_due_together_run_in_spawn_order() {
        let clock = Clock::new(Instant::ZERO);
        let order = RefCell::new(String::new());
        let mut tasks = Tasks::new(clock.clone());
        for name in ['a', 'b', 'c'] {
            let (clock, order) = (clock.clone(), &order);
            tasks.spawn(async move {
                for tick in 1..=3 {
                    clock.sleep_until(Instant::from_micros(tick * 10)).await;
                    order.borrow_mut().push(name);
                }
            });
        }
        assert_eq!(tasks.next_deadline(), Some(Instant::ZERO), "fresh tasks are due now");
        while tasks.step().is_some() {}
        assert!(tasks.is_empty());
        assert_eq!(clock.now(), Instant::from_micros(30));
        assert_eq!(*order.borrow(), "abcabcabc");
    }

    #[test]
    fn a_task_that_waits_for_another_runs_within_the_same_instant() {
        let clock = Clock::new(Instant::ZERO);
        let queue: RefCell<(VecDeque<u32>, Option<Waker>)> = RefCell::default();
        let got = RefCell::new(Vec::new());
        let mut tasks = Tasks::new(clock.clone());
        tasks.spawn(async {
            loop {
                let value = poll_fn(|context| {
                    let mut queue = queue.borrow_mut();
                    queue.1 = Some(context.waker().clone());
                    queue.0.pop_front().map_or(Poll::Pending, Poll::Ready)
                })
                .await;
                got.borrow_mut().push((clock.now(), value));
            }
        });
        tasks.spawn(async {
            for value in 1..=2 {
                clock.sleep_until(Instant::from_micros(100 * u64::from(value))).await;
                queue.borrow_mut().0.push_back(value);
                if let Some(waker) = queue.borrow_mut().1.take() {
                    waker.wake();
                }
            }
        });
        tasks.run_until(Instant::from_micros(1_000));
        assert_eq!(tasks.next_deadline(), None);
        assert_eq!(*got.borrow(), [(Instant::from_micros(100), 1), (Instant::from_micros(200), 2)]);
    }

    #[test]
    fn a_sleep_that_was_dropped_leaves_no_deadline() {
        let clock = Clock::new(Instant::ZERO);
        let mut tasks = Tasks::new(clock.clone());
        let sleeper = clock.clone();
        tasks.spawn(async move {
            let mut polled = false;
            poll_fn(move |_| if std::mem::replace(&mut polled, true) { Poll::Ready(()) } else { Poll::Pending }).await;
            sleeper.sleep_until(Instant::from_micros(5)).await;
        });
        assert_eq!(tasks.step(), Some(Instant::ZERO));
        assert_eq!(tasks.next_deadline(), None, "it waits for a bell that nobody rings");
        assert_eq!(tasks.len(), 1);
    }

    #[test]
    fn delays_round_up_and_never_end_early() {
        use embedded_hal_async::delay::DelayNs;
        let clock = Clock::new(Instant::from_micros(7));
        let mut delay = clock.clone();
        block_on(&clock, delay.delay_ns(1));
        assert_eq!(clock.now(), Instant::from_micros(8));
        block_on(&clock, delay.delay_ms(2));
        assert_eq!(clock.now(), Instant::from_micros(2_008));
        clock.advance_to(Instant::ZERO);
        assert_eq!(clock.now(), Instant::from_micros(2_008), "time does not go back");
    }
}
