//! Peers: who is heard, for how long, and in which encoding it is answered.

use stampfly_link::{Datagram, Peers, datagrams, json};
use stampfly_types::messages::PowerData;
use stampfly_types::{Duration, Instant};

datagrams! {
    /// One message.
    pub enum Table, magic b"TST1";
    /// A voltage.
    PowerData = 1, valid if |power| power.voltage >= 0.0;
}

const SILENCE: Duration = Duration::from_secs(2);

fn datagram(sequence: u32, voltage: f32) -> Datagram<Table> {
    Datagram { sequence, time: Instant::ZERO, body: PowerData { voltage, ..PowerData::default() }.into() }
}

fn bytes(sequence: u32) -> Vec<u8> {
    datagram(sequence, 1.0).write(&mut [0; 64]).expect("valid").to_vec()
}

fn line(sequence: u32) -> Vec<u8> {
    let mut line = String::new();
    json::write(&datagram(sequence, 1.0), &mut line).expect("valid");
    line.into_bytes()
}

fn sent(peers: &mut Peers<u8, u32, 2>, voltage: f32) -> Vec<(u8, Vec<u8>)> {
    let mut sent = Vec::new();
    let body = datagram(0, voltage).body;
    peers.send(Instant::ZERO, body, |_| true, &mut |to, bytes| sent.push((*to, bytes.to_vec())));
    sent
}

#[test]
fn each_peer_is_answered_in_its_own_encoding_with_one_count() {
    let (mut peers, now) = (Peers::<u8, u32, 2>::new(SILENCE), Instant::ZERO);
    assert!(peers.hear::<Table>(now, 1, &bytes(0)).is_some() && peers.hear::<Table>(now, 2, &line(0)).is_some());
    let answers = sent(&mut peers, 3.0);
    assert_eq!(Datagram::read(&answers[0].1), Ok(datagram(0, 3.0)));
    let text = core::str::from_utf8(&answers[1].1).expect("text");
    assert_eq!((answers[0].0, answers[1].0, json::read(text)), (1, 2, Ok(datagram(1, 3.0))));
    // It changes its encoding: so do the answers.
    assert!(peers.hear::<Table>(now, 2, &bytes(1)).is_some());
    assert_eq!(Datagram::read(&sent(&mut peers, 3.0)[1].1), Ok(datagram(3, 3.0)));
    assert!(sent(&mut peers, -1.0).is_empty(), "what is not valid is not sent");
}

#[test]
fn old_and_damaged_datagrams_are_dropped_by_peer() {
    let (mut peers, now) = (Peers::<u8, u32, 2>::new(SILENCE), Instant::ZERO);
    assert!(peers.hear::<Table>(now, 1, &bytes(5)).is_some());
    assert!(peers.hear::<Table>(now, 1, &bytes(5)).is_none() && peers.hear::<Table>(now, 1, &bytes(4)).is_none());
    assert!(peers.hear::<Table>(now, 2, &bytes(4)).is_some(), "another sender counts for itself");
    let mut damaged = bytes(6);
    damaged[21] ^= 1;
    for noise in [&damaged[..], b"", b"{", b"{\xff", b"RVR1"] {
        assert!(peers.hear::<Table>(now, 1, noise).is_none());
    }
}

#[test]
fn silent_peers_make_room_and_lose_their_notes() {
    let (mut peers, start) = (Peers::<u8, u32, 2>::new(SILENCE), Instant::ZERO);
    for address in [1, 2] {
        let (notes, _) = peers.hear::<Table>(start, address, &bytes(0)).expect("room");
        *notes = 7;
    }
    assert!(peers.hear::<Table>(start, 3, &bytes(0)).is_none(), "no room");
    let later = start + Duration::from_millis(2_001);
    let (notes, _) = peers.hear::<Table>(later, 3, &bytes(0)).expect("the others are gone");
    assert_eq!(*notes, 0);
    assert_eq!(sent(&mut peers, 1.0).len(), 1);
    let (notes, _) = peers.hear::<Table>(later, 1, &bytes(0)).expect("it may come back and count again");
    assert_eq!(*notes, 0, "as somebody new");
}
