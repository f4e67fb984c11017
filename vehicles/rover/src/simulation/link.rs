//! Com over UDP, in real time: other programs drive, watch, change parameters, are the engine.

use crate::com::{Body, SUBSCRIPTION};
use crate::schedule::TICK;
use crate::topics::LinkEnds;
use stampfly_link::{MAX_DATAGRAM, Peers};
use stampfly_sim::time::Clock;
use stampfly_sim::vehicle::Live;
use stampfly_types::{Duration, Instant};
use std::net::SocketAddr;

/// Datagrams heard in one tick: a bound on what a flood can cost.
const DATAGRAMS: usize = 256;
/// Every n-th tick subscribers are told the state of the parameters even when it has not changed.
const STATUS_EVERY: u32 = 10;
/// Between a tick and its answers: the executor has run it by then.
const AFTER_TICK: Duration = Duration::from_millis(1);

/// What the rover notes of a program.
#[derive(Default)]
struct Peer {
    /// Every n-th line of the log until then.
    subscription: Option<(u32, Instant)>,
    is_engine: bool,
}

/// Connects other programs to the rover.
pub(super) async fn serve(clock: Clock, live: &Live, mut link: LinkEnds<'_>) {
    let begun = std::time::Instant::now();
    let mut peers = Peers::<SocketAddr, Peer, 16>::new(SUBSCRIPTION);
    let mut buffer = [0; MAX_DATAGRAM];
    for tick in 1_u32.. {
        let due = TICK.as_micros() * u64::from(tick);
        let until = begun + std::time::Duration::from_micros(due);
        clock.sleep_until(Instant::from_micros(due)).await;
        let now = clock.now();
        for _ in 0..DATAGRAMS {
            let Some((length, from)) = live.receive(until, &mut buffer) else { break };
            let bytes = buffer.get(..length).unwrap_or_default();
            match peers.hear(now, from, bytes) {
                Some((_, Body::OperatorCommand(command))) => _ = link.operator_command.publish(now, &command),
                Some((peer, Body::DriveCommand(command))) => {
                    peer.is_engine = true;
                    link.remote_drive.publish(now, &command);
                }
                // When it is full, the sender sees no new version, as if the datagram were lost.
                Some((_, Body::ParameterRequest(request))) => _ = link.parameter_request.publish(now, request),
                Some((peer, Body::Subscription(wanted))) => {
                    peer.subscription = Some((wanted.every, now + SUBSCRIPTION));
                }
                _ => {}
            }
        }
        std::thread::sleep(until.saturating_duration_since(std::time::Instant::now()));

        clock.sleep_until(now + AFTER_TICK).await;
        let wants = |peer: &Peer, n: u32| {
            peer.subscription.is_some_and(|(every, until)| now <= until && every > 0 && n.is_multiple_of(every))
        };
        let mut put = |to: &SocketAddr, bytes: &[u8]| _ = live.socket.send_to(bytes, to);
        if let Some(line) = core::iter::from_fn(|| link.log_record.next()).last() {
            peers.send::<Body>(now, line.data.into(), |peer| wants(peer, tick), &mut put);
        }
        if link.parameter_status.has_new() || tick.is_multiple_of(STATUS_EVERY) {
            let status = link.parameter_status.latest().map(|status| status.data).unwrap_or_default();
            peers.send::<Body>(now, status.into(), |peer| wants(peer, 0), &mut put);
        }
        if let (Some(input), Some(safety)) = (link.driver_input.latest(), link.safety_status.latest()) {
            peers.send::<Body>(now, input.data.into(), |peer| peer.is_engine, &mut put);
            peers.send::<Body>(now, safety.data.into(), |peer| peer.is_engine, &mut put);
        }
    }
}
