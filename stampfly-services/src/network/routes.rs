//! Where the station with the key is, if it speaks over a network: the addresses that the secure link knows, for places of a network.
//!
//! [`Guarded`](stampfly_link::secure::Guarded) tells stations apart by six bytes, and answers whoever has sent the newest frame that was authentic. A place of a network has six bytes of its
//! own, so it gets an address that no radio has, and that no place before it had: who commands is told by it. There are two; the other belongs to whoever has spoken last without
//! having proved anything, and never replaces the station's.

use core::net::SocketAddrV4;
use stampfly_link::Address;
use stampfly_types::{Duration, Instant};

/// Addresses of a group that is locally administered, which no transmitter has as its own.
const PREFIX: [u8; 3] = [0x03, b'U', b'D'];
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
    places: [Option<Place>; 2],
    /// Addresses so far.
    count: u32,
}

/// A place of the network, its address, and when it has spoken.
#[derive(Clone, Copy, Debug)]
struct Place {
    place: SocketAddrV4,
    address: Address,
    heard: Instant,
}

impl Routes {
    /// Nobody has spoken.
    #[must_use]
    pub const fn new() -> Self {
        Self { places: [None; 2], count: 0 }
    }

    /// The address of whoever has sent a datagram from this place. `station` is where the newest authentic frame came from.
    pub fn source(&mut self, now: Instant, from: SocketAddrV4, station: Option<Address>) -> Address {
        if let Some(known) = self.places.iter_mut().flatten().find(|known| known.place == from) {
            known.heard = now;
            return known.address;
        }
        let [first, second] = &mut self.places;
        let is_station = |place: &Option<Place>| place.is_some_and(|place| Some(place.address) == station);
        let (place, other) = if is_station(first) { (second, &*first) } else { (first, &*second) };
        let mut address;
        // They come round: not to that of the other place.
        loop {
            self.count = self.count.wrapping_add(1);
            address = address_of(self.count);
            if other.is_none_or(|other| other.address != address) {
                break;
            }
        }
        *place = Some(Place { place: from, address, heard: now });
        address
    }

    /// The place that has this address. `None` for those of a radio.
    #[must_use]
    pub fn place(&self, of: Address) -> Option<SocketAddrV4> {
        self.places.iter().flatten().find(|place| place.address == of).map(|place| place.place)
    }

    /// Who is to be offered a session: whoever has spoken just now.
    pub fn recent(&self, now: Instant) -> impl Iterator<Item = SocketAddrV4> {
        self.places.iter().flatten().filter(move |place| now.since(place.heard) < RECENT).map(|place| place.place)
    }

    /// The network is another: nobody is where they were.
    pub fn clear(&mut self) {
        self.places = [None; 2];
    }
}

const fn address_of(number: u32) -> Address {
    let ([a, b, c], [_, d, e, f]) = (PREFIX, number.to_be_bytes());
    Address([a, b, c, d, e, f])
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
    fn an_address_is_of_one_place_and_a_place_that_stays_keeps_its_own() {
        let mut routes = Routes::new();
        let of = routes.source(Instant::ZERO, place(1), None);
        let mut seen = std::collections::BTreeSet::from([of.0]);
        for stranger in 1_000..2_000 {
            assert!(seen.insert(routes.source(Instant::ZERO, place(stranger), Some(of)).0), "{stranger}");
            assert_eq!(routes.source(Instant::ZERO, place(1), Some(of)), of);
        }
        // They come round, and not to the station's.
        routes.count = u32::from_be_bytes([0, of.0[3], of.0[4], of.0[5]]).wrapping_sub(1);
        assert_ne!(routes.source(Instant::ZERO, place(9), Some(of)), of);
        assert_eq!(routes.place(of), Some(place(1)));
    }

    #[test]
    fn no_address_is_that_of_a_transmitter() {
        let mut routes = Routes::new();
        assert!(!routes.source(Instant::ZERO, place(1), None).is_station());
        assert_eq!(routes.place(Address([2; 6])), None);
        assert_eq!(routes.place(Address::BROADCAST), None);
    }
}
