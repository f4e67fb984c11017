//! A link with keys: what is not sealed by a station of the vehicle's own does nothing.
//!
//! Use it over any radio or network that strangers can send on. Not for what has no key: the packets of stock transmitters
//! are [`Session`](crate::Session)'s, and [`Guarded`] has both. Both ends have a [`Key`], 32 bytes of the vehicle's
//! generator of random numbers, handed over by USB or as a QR code and never by radio. [`Vehicle`] and [`Station`] are the two
//! ends; they take frames and the time, and give frames back. ESP-NOW's own encryption is not needed and not trusted: it
//! accepts replays and frames in the clear.
//!
//! # Frame
//!
//! | offset | type | field | |
//! |---|---|---|---|
//! | 0 | u8 | version, 1 | in the clear |
//! | 1 | u8 | kind; bit 7 is set in what a vehicle sends | in the clear |
//! | 2 | u8 | number of the key | in the clear |
//! | 3 | u32 | session | in the clear |
//! | 7 | u32 | counter of this direction in this session, from 1 | in the clear |
//! | 11 | u32 | when it was sealed, by the vehicle's clock, ms; 0 in announcements and answers | encrypted |
//! | 15 | … | body, as its [kind](Payload) has it, 219 bytes at most | encrypted |
//! | end | 16 × u8 | tag | |
//!
//! Little-endian. 31 to 250 bytes: what ESP-NOW carries, and more than any of its packets without a tag, which are
//! told by that. ChaCha20-Poly1305 as in RFC 8439. Associated data are the eleven bytes in the clear. The nonce is the direction
//! (u8: 1 to the vehicle, 2 from it), three zeros, session and counter as in the frame.
//!
//! # Handshake
//!
//! K is the shared key, H(K, x) is HChaCha20 (draft-irtf-cfrg-xchacha-03) with the 16 bytes x, and A is H(K, `stampfly-secure1`).
//!
//! | kind | from | sealed with | session and counter are |
//! |---|---|---|---|
//! | 81 announcement | vehicle | A | Nv, eight random bytes |
//! | 01 join | station | H(A, Nv ‖ eight zeros) | Ns, eight random bytes |
//! | 82 welcome | vehicle | H(K, Nv ‖ Ns) | those of the new session: the first four bytes of Nv; 1, 2, … |
//! | 02 ready | station | H(K, Nv ‖ Ns) | the same session; 1, 2, … |
//!
//! None of them has a body.
//!
//! The vehicle announces at power-on, when its station has been silent for half a second, when the motors may turn from now on, and when a
//! counter is near its end; every 100 ms, until a station joins. The station repeats its answer every 100 ms for a second, and the
//! vehicle its welcome every 50 ms for a second. The first frame that the station seals in the new session ends the one before, so
//! that control is never interrupted. With 95 % of all frames lost, a session comes about in 10 s (median of 200 trials).
//!
//! # Why a replay fails
//!
//! | what is sent again | to | why nothing comes of it |
//! |---|---|---|
//! | a frame of this session | either end | its counter is not newer than the newest; there is no window |
//! | a frame of a session before | either end | that session's number is not in use; were the number the same by chance, its key is not, because Nv and Ns are others |
//! | a frame of the other direction | its sender | the kind says so; with that bit turned, the tag is wrong, and so is the nonce |
//! | an old announcement | station | it answers, and the answer's key is not that of the Nv in force, if one is. The station leaves its session only for a welcome, and a welcome under a key of its new Ns does not exist |
//! | an old answer | vehicle | its key comes of an old Nv. With the Nv in force: an announcement is good for one session and then void, so there is no way back to one that is over |
//! | an old welcome | station | it is sealed under a key of another Ns |
//! | an old ready | vehicle | it is sealed under a key of another Nv, or its counter is old |
//!
//! Each end so depends on its own random number alone: the vehicle takes nothing old as long as its Nv are new, even if the
//! station's generator always gives the same number, and the other way round. No nonce seals two texts under one key: counters only count up,
//! sessions have keys of their own, and so have answers to each announcement; an announcement is the same bytes whenever its number is the same.
//!
//! # What is held up
//!
//! A frame that is not used within 200 ms of its making is not used: a vehicle says what its clock is, the station goes on
//! counting from there, and its frames say when they were sealed. The estimate is never ahead of the vehicle's clock, so no
//! frame passes for younger than it is. A kill is used whatever its age. When the vehicle's clock loses time, as a simulator's
//! does that is held up, the station's frames are from its future: the vehicle refuses them, and offers a new session, whose
//! handshake gives the station the clock again.
//!
//! # What is lost
//!
//! | what | then |
//! |---|---|
//! | sticks, samples, telemetry | the next is newer |
//! | a command | [`Commands`] says it until it is acknowledged; the vehicle takes it once, by its number, in whichever session it hears it, and acknowledges it when it is seen to have happened |
//! | a parameter | ask again: to write it twice is to write it once |
//! | a line, or a part of its answer | ask again with a [question](Payload::Question) of the same number, from where the answer is missing |
//! | what is refused with motors armed | the vehicle acknowledges it as refused |
//! | a command that is refused, because another commands or the vehicle does not do it | the vehicle says why, each time that it hears it; of one that it has taken and has not done, three times |
//! | what was asked of the vehicle, and by whom | the vehicle says it several times, with a number |
//!
//! # Floods
//!
//! In a tick of 2.5 ms, at most eight frames are worked on that turn out to be bad, the last two of them only if they say that
//! they are a kill ([`Budget`]). Authentic frames are not counted, so nothing of a station is delayed by a flood of up to six
//! frames a tick (2,400 a second), and no kill by any flood of other kinds. Against a flood of false kills beyond 3,200 a second
//! a station repeats its own: each has the same chance as each of them. A radio that is full carries nothing, and then the failsafe acts.
//!
//! # What it does not do
//!
//! It does not help against jamming, which repeating old announcements without end is, too, as long as there is no session; nor against who reads the key out of a flash memory or knows it otherwise: such a one can fly the
//! vehicle, and read what was recorded before. Session numbers, kinds, lengths and times of frames can be seen by everyone.
//! Who holds the same key is the same station: give every station a key of its own.

mod budget;
mod channel;
mod cipher;
mod clock;
mod commands;
mod frame;
mod guarded;
mod key;
mod payload;
mod received;
mod refused;
mod station;
mod values;
mod vehicle;

pub use budget::Budget;
pub use clock::MAX_AGE;
pub use commands::{Commands, FRESH};
pub use frame::{Kind, MAX_BODY, MAX_FRAME, MIN_FRAME, key_id, put};
pub use guarded::{Guarded, Heard, NotTaken, Policy};
pub use key::{Key, KeyError, Phrase, Uri};
pub use payload::{Payload, Sample};
pub use received::Received;
pub use refused::{Refused, SealError, Tally};
pub use station::Station;
pub use vehicle::{Held, Vehicle};
