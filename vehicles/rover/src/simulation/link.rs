//! Com over UDP: other programs drive, watch, change parameters, are the engine.

use crate::com::{Body, SUBSCRIPTION};
use crate::topics::LinkEnds;
use stampfly_link::Peers;
use stampfly_sim::vehicle::{Client, Heard, Link, Put};
use stampfly_types::Instant;

/// Every n-th tick subscribers are told the state of the parameters even when it has not changed.
const STATUS_EVERY: u32 = 10;

/// What the rover notes of a program.
#[derive(Default)]
pub(super) struct Peer {
    /// Every n-th line of the log until then.
    subscription: Option<(u32, Instant)>,
    is_engine: bool,
}

/// The rover's end of the conversations.
pub(super) struct UdpLink<'b> {
    pub(super) peers: Peers<Client, Peer, 16>,
    pub(super) ends: LinkEnds<'b>,
}

impl Link for UdpLink<'_> {
    fn hear(&mut self, now: Instant, from: Client, heard: Heard<'_>, _: Put<'_>) {
        let Heard::Bytes(bytes) = heard else { return };
        let Some((peer, body)) = self.peers.hear(now, from, bytes) else { return };
        match body {
            Body::OperatorCommand(command) => _ = self.ends.operator_command.publish(now, &command),
            // When it is full, the sender sees no new version, as if the datagram were lost.
            Body::ParameterRequest(request) => _ = self.ends.parameter_request.publish(now, request),
            Body::Subscription(wanted) => peer.subscription = Some((wanted.every, now + SUBSCRIPTION)),
            Body::DriveCommand(command) => {
                peer.is_engine = true;
                self.ends.remote_drive.publish(now, &command);
            }
            // What only a rover sends.
            _ => {}
        }
    }

    fn answer(&mut self, now: Instant, tick: u32, put: Put<'_>) {
        let Self { peers, ends } = self;
        let wants = |peer: &Peer, n: u32| {
            peer.subscription.is_some_and(|(every, until)| now <= until && every > 0 && n.is_multiple_of(every))
        };
        if let Some(line) = ends.log_record.latest() {
            peers.send::<Body>(now, line.data.into(), |peer| wants(peer, tick), put);
        }
        if ends.parameter_status.has_new() || tick.is_multiple_of(STATUS_EVERY) {
            let status = ends.parameter_status.latest().map(|status| status.data).unwrap_or_default();
            peers.send::<Body>(now, status.into(), |peer| wants(peer, 0), put);
        }
        if let (Some(input), Some(safety)) = (ends.driver_input.latest(), ends.safety_status.latest()) {
            peers.send::<Body>(now, input.data.into(), |peer| peer.is_engine, put);
            peers.send::<Body>(now, safety.data.into(), |peer| peer.is_engine, put);
        }
    }
}
