//! The ends of a network, as services use them: datagrams and one stream for MAVLink, datagrams for sealed frames.
//!
//! [`Stack`](super::Stack) implements [`Ends`] on a radio; tests implement it on a computer's sockets. Everything is a question that is answered at once: what has not come is
//! not waited for, and what cannot be sent is lost.

use core::net::SocketAddrV4;

/// Where MAVLink is spoken in datagrams. Stations listen at the same number, and the vehicle answers whoever has spoken to it.
pub const MAVLINK_UDP: u16 = 14_550;
/// Where MAVLink is spoken in a stream.
pub const MAVLINK_TCP: u16 = 5_760;
/// Where sealed frames are spoken, one a datagram.
pub const SEALED_UDP: u16 = 14_560;

/// Who is at the other end of MAVLink.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Client {
    /// Somebody who has sent a datagram from there.
    Datagrams(SocketAddrV4),
    /// Somebody who has connected from there.
    Stream(SocketAddrV4),
}

/// What has come of a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard<'b> {
    /// It has connected.
    Opened,
    /// It has sent this.
    Bytes(&'b [u8]),
    /// It is gone.
    Closed,
}

/// A network's ends.
pub trait Ends {
    /// Hands over what has come for MAVLink: as much as was kept, so a flood costs a bounded time.
    fn hear(&mut self, hear: &mut dyn FnMut(Client, Heard<'_>));

    /// Sends whole frames, or none: what there is no room for is lost.
    fn send(&mut self, to: Client, frame: &[u8]);

    /// Ends a client's stream. Nothing happens to one of datagrams.
    fn close(&mut self, client: Client);

    /// The next sealed frame that has come, and from where. Longer datagrams are none of ours and lost.
    fn hear_sealed<'r>(&mut self, room: &'r mut [u8]) -> Option<(SocketAddrV4, &'r mut [u8])>;

    /// Sends a sealed frame.
    fn send_sealed(&mut self, to: SocketAddrV4, frame: &[u8]);
}
