//! Where the station with the key is, if it speaks over a network: the addresses that the secure link knows, for places of a network.
//!
//! [`Guarded`](stampfly_link::secure::Guarded) tells stations apart by six bytes, and answers whoever has sent the newest frame that was authentic. A place of a network has six bytes of its
//! own, so it gets one of two addresses that no radio has. The other belongs to whoever has spoken last without having proved anything, and never replaces the station's.

use core::net::SocketAddrV4;
use stampfly_link::Address;
use stampfly_types::{Duration, Instant};

/// Addresses of a group that is locally administered, which no transmitter has as its own.
const PREFIX: [u8; 5] = [0x03, b'U', b'D', b'P', 0];
/// Whoever has said nothing for this long is sent no offer of a session.
const RECENT: Duration = Duration::from_secs(2);

/// Two places.
///
/// ```
/// use stampfly_services::network::Routes;
/// use stampfly_types::Instant;
/// let (here, there) = ("192.0.2.1:5000".parse().unwrap(), "192.0.2.2:5000".parse().unwrap());
/// let mut routes = Routes::new();
/// let station = routes.source(Instant::ZERO, here, None);
/// // Its frame was authentic. What a stranger sends does not take its place.
/// let stranger = routes.source(Instant::ZERO, there, Some(station));
/// assert_ne!(station, stranger);
/// assert_eq!(routes.place(station), Some(here));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Routes {
    places: [Option<(SocketAddrV4, Instant)>; 2],
}

impl Routes {
    /// Nobody has spoken.
    #[must_use]
    pub const fn new() -> Self {
        Self { places: [None; 2] }
    }

    /// The address of whoever has sent a datagram from this place. `station` is where the newest authentic frame came from.
    pub fn source(&mut self, now: Instant, from: SocketAddrV4, station: Option<Address>) -> Address {
        let known = self.places.iter().position(|place| place.is_some_and(|(place, _)| place == from));
        let index = known.unwrap_or_else(|| usize::from(station == Some(address(0))));
        if let Some(place) = self.places.get_mut(index) {
            *place = Some((from, now));
        }
        address(index)
    }

    /// The place that has this address. `None` for those of a radio.
    #[must_use]
    pub fn place(&self, of: Address) -> Option<SocketAddrV4> {
        let index = (0..self.places.len()).find(|index| address(*index) == of)?;
        self.places.get(index).copied().flatten().map(|(place, _)| place)
    }

    /// Who is to be offered a session: whoever has spoken just now.
    pub fn recent(&self, now: Instant) -> impl Iterator<Item = SocketAddrV4> {
        self.places.iter().flatten().filter(move |(_, at)| now.since(*at) < RECENT).map(|(place, _)| *place)
    }

    /// The network is another: nobody is where they were.
    pub fn clear(&mut self) {
        self.places = [None; 2];
    }
}

const fn address(index: usize) -> Address {
    let [a, b, c, d, e] = PREFIX;
    Address([a, b, c, d, e, index as u8])
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::net::Ipv4Addr;

    fn place(port: u16) -> SocketAddrV4 {
        SocketAddrV4::new(Ipv4Addr::LOCALHOST, port)
    }

    #[test]
    fn no_number_of_strangers_takes_the_stations_place() {
        let mut routes = Routes::new();
        routes.source(Instant::ZERO, place(1), None);
        for station in [place(2), place(3)] {
            // Whichever of the two addresses it gets.
            let of = routes.source(Instant::ZERO, station, None);
            for stranger in 1_000..2_000 {
                assert_ne!(routes.source(Instant::ZERO, place(stranger), Some(of)), of);
                assert_eq!(routes.place(of), Some(station));
            }
        }
    }

    #[test]
    fn only_who_has_spoken_just_now_is_offered_a_session() {
        let mut routes = Routes::new();
        routes.source(Instant::from_secs(1), place(1), None);
        let later = Instant::from_secs(2);
        let station = routes.source(later, place(1), None);
        routes.source(later, place(2), Some(station));
        assert_eq!(routes.recent(later).count(), 2);
        assert_eq!(routes.recent(Instant::from_secs(5)).count(), 0);
        routes.clear();
        assert_eq!(routes.place(station), None);
    }

    #[test]
    fn no_address_is_that_of_a_transmitter() {
        let mut routes = Routes::new();
        assert!(!routes.source(Instant::ZERO, place(1), None).is_station());
        assert_eq!(routes.place(Address([2; 6])), None);
        assert_eq!(routes.place(Address::BROADCAST), None);
    }
}
