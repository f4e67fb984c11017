//! A vehicle's end in a thread of this program: the code that the firmware runs, over a pipe.

use stampfly_bus::{Schedule, TopicTable};
use stampfly_flight::hil::{LONGEST, LONGEST_FRAME, Line, Served, Wire, serve};
use stampfly_param::Parameters;
use stampfly_sim::vehicle::Port;
use std::collections::VecDeque;
use std::io;
use std::mem::MaybeUninit;
use std::pin::pin;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::task::{Context, Poll, Waker};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A vehicle waits so long for bytes.
const PATIENCE: Duration = Duration::from_millis(20);

/// One end of a pipe: bytes there and back.
#[derive(Debug)]
pub struct Pipe {
    to: Sender<Vec<u8>>,
    from: Receiver<Vec<u8>>,
    rest: VecDeque<u8>,
}

impl Pipe {
    /// Both ends.
    #[must_use]
    pub fn pair() -> [Self; 2] {
        let (one, other) = (channel(), channel());
        let end = |to, from| Self { to, from, rest: VecDeque::new() };
        [end(one.0, other.1), end(other.0, one.1)]
    }
}

impl Port for Pipe {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.to.send(bytes.to_vec()).map_err(|_| io::ErrorKind::BrokenPipe.into())
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        if self.rest.is_empty() {
            match self.from.recv_timeout(patience) {
                Ok(bytes) => self.rest.extend(bytes),
                Err(RecvTimeoutError::Timeout) => return Ok(0),
                Err(RecvTimeoutError::Disconnected) => return Err(io::ErrorKind::BrokenPipe.into()),
            }
        }
        let count = self.rest.len().min(buffer.len());
        buffer.iter_mut().zip(self.rest.drain(..count)).for_each(|(place, byte)| *place = byte);
        Ok(count)
    }
}

/// The vehicle's end of a port. On one that is gone it hears nothing.
#[derive(Debug)]
pub struct Blocking<P>(pub P, pub Instant);

impl<P: Port> Wire for Blocking<P> {
    async fn receive(&mut self, buffer: &mut [u8]) -> usize {
        self.0.receive(buffer, PATIENCE).unwrap_or_else(|_| {
            std::thread::sleep(PATIENCE);
            0
        })
    }

    async fn send(&mut self, bytes: &[u8]) {
        _ = self.0.send(bytes);
    }

    fn now(&self) -> stampfly_types::Instant {
        stampfly_types::Instant::from_micros(self.1.elapsed().as_micros() as u64)
    }
}

/// Starts a vehicle with default parameters at the other end of this port. Its thread ends as [`serve`] does.
///
/// # Panics
/// When there can be no more threads.
pub fn start<R: Schedule>(port: impl Port + Send + 'static) -> JoinHandle<Served>
where
    R::Config: Parameters + Default,
{
    std::thread::spawn(move || {
        let [mut incoming, mut happened] = [(); 2].map(|()| vec![0; LONGEST]);
        let mut reply = vec![0; LONGEST_FRAME];
        let mut line = Line::new(&mut incoming, &mut happened, &mut reply);
        let (mut place, mut bus) = (Box::new(MaybeUninit::uninit()), Box::new(R::Topics::new()));
        let mut wire = Blocking(port, Instant::now());
        let mut config = R::Config::default();
        let served = pin!(serve::<R>(&mut wire, &mut line, &mut place, &mut bus, &mut config));
        match served.poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(served) => served,
            Poll::Pending => unreachable!("nothing on this wire is ever pending"),
        }
    })
}
