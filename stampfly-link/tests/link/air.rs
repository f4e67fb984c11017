//! A vehicle, its station, the air between them, and someone who records all of it, and may seal with a key that he should not
//! have: by another implementation, so that he can say what a station of ours does not.

use chacha20::R20;
use chacha20poly1305::aead::AeadInOut;
use chacha20poly1305::{ChaCha20Poly1305, KeyInit, Nonce};
use stampfly_link::TelemetryPacket;
use stampfly_link::secure::{Key, MAX_FRAME, Payload, Refused, Station, Vehicle};
use stampfly_types::messages::PilotInput;
use stampfly_types::{Duration, Instant};

/// Time between two frames of each end.
pub const PERIOD: Duration = Duration::from_millis(20);
/// A step of the flight loop.
pub const TICK: Duration = Duration::from_micros(2_500);

/// SplitMix64: the same numbers on every machine.
#[derive(Clone)]
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut word = self.0;
        word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        word ^ (word >> 31)
    }

    pub fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    pub fn eight(&mut self) -> [u8; 8] {
        self.next().to_le_bytes()
    }

    pub fn fill(&mut self, bytes: &mut [u8]) {
        bytes.iter_mut().for_each(|byte| *byte = self.next() as u8);
    }
}

pub fn key(id: u8) -> Key {
    Key::generate(id, core::array::from_fn(|place| (place as u8).wrapping_mul(37) ^ id)).expect("a key")
}

pub fn sticks() -> Payload<'static> {
    Payload::Sticks(PilotInput { throttle: 0.25, ..Default::default() })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum To {
    Vehicle,
    Station,
}

/// What happens to a frame on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    Arrives,
    Lost,
}

#[derive(Clone)]
pub struct Air {
    pub key: Key,
    pub vehicle: Vehicle,
    pub station: Station,
    pub now: Instant,
    /// What the vehicle's clock has lost.
    pub lost: Duration,
    pub random: Random,
    /// All that was on the air.
    pub captured: Vec<(To, Vec<u8>)>,
    /// The random numbers of the two ends that were used last.
    pub numbers: ([u8; 8], [u8; 8]),
}

impl Air {
    pub fn new(seed: u64) -> Self {
        let key = key(1);
        Self {
            vehicle: Vehicle::new(key.clone()),
            station: Station::new(key.clone()),
            key,
            now: Instant::from_secs(1),
            lost: Duration::ZERO,
            random: Random(seed),
            captured: Vec::new(),
            numbers: Default::default(),
        }
    }

    /// Two ends in a session.
    pub fn joined(seed: u64) -> Self {
        let mut air = Self::new(seed);
        air.run(Duration::from_millis(100));
        assert!(air.vehicle.is_joined(air.now) && air.vehicle.session() == air.station.session());
        air
    }

    pub fn run(&mut self, time: Duration) {
        self.run_with(time, |_, _, _| Fate::Arrives);
    }

    /// Lets both ends send for so long, frame by frame under somebody's control.
    pub fn run_with(&mut self, time: Duration, mut fate: impl FnMut(&mut Random, To, &[u8]) -> Fate) {
        let end = self.now + time;
        while self.now < end {
            self.now += PERIOD;
            for (to, frame) in self.exchange() {
                self.captured.push((to, frame.clone()));
                if fate(&mut self.random, to, &frame) == Fate::Arrives {
                    // What is refused is counted there.
                    let _ = self.deliver(to, &frame);
                }
            }
        }
    }

    /// The vehicle's clock.
    fn vehicle_now(&self) -> Instant {
        Instant::ZERO + self.now.since(Instant::ZERO + self.lost)
    }

    /// What both ends send in one turn.
    fn exchange(&mut self) -> Vec<(To, Vec<u8>)> {
        let mut room = [0; MAX_FRAME];
        let mut sent = Vec::new();
        let (random, vehicle_now) = (self.random.eight(), self.vehicle_now());
        if let Some(frame) = self.vehicle.transmit(vehicle_now, random, &mut room) {
            sent.push((To::Station, frame.to_vec()));
        }
        let telemetry = Payload::Telemetry(TelemetryPacket::default());
        sent.extend(
            self.vehicle.seal(vehicle_now, &telemetry, &mut room).ok().map(|frame| (To::Station, frame.to_vec())),
        );
        let random = self.random.eight();
        if let Some(frame) = self.station.transmit(self.now, random, &mut room) {
            sent.push((To::Vehicle, frame.to_vec()));
        }
        sent.extend(self.station.seal(self.now, &sticks(), &mut room).ok().map(|frame| (To::Vehicle, frame.to_vec())));
        // Random numbers of announcements and answers can be seen in the clear.
        for (_, frame) in &sent {
            match frame.get(1) {
                Some(0x81) => self.numbers.0.copy_from_slice(&frame[3..11]),
                Some(0x01) => self.numbers.1.copy_from_slice(&frame[3..11]),
                _ => {}
            }
        }
        sent
    }

    /// Hands a frame over. Was it taken?
    pub fn deliver(&mut self, to: To, frame: &[u8]) -> Result<bool, Refused> {
        let mut frame = frame.to_vec();
        match to {
            To::Vehicle => self.vehicle.receive(self.vehicle_now(), &mut frame).map(|received| received.is_some()),
            To::Station => self.station.receive(self.now, &mut frame).map(|received| received.is_some()),
        }
    }

    pub fn seal(&mut self, payload: &Payload<'_>) -> Vec<u8> {
        let mut room = [0; MAX_FRAME];
        self.station.seal(self.now, payload, &mut room).expect("sealed").to_vec()
    }

    /// A frame to the vehicle in the present session, whatever is in it.
    pub fn forge(&self, kind: u8, counter: u32, tick: u32, body: &[u8]) -> Vec<u8> {
        let session: [u8; 4] = self.numbers.0[..4].try_into().expect("four bytes");
        let mut frame = [&[1, kind, self.key.id()][..], &session, &counter.to_le_bytes()].concat();
        let mut nonce = [0; 12];
        nonce[0] = 1;
        nonce[4..].copy_from_slice(&frame[3..]);
        let mut text = [&tick.to_le_bytes()[..], body].concat();
        let cipher = ChaCha20Poly1305::new(&self.session_key().into());
        let tag = cipher.encrypt_inout_detached(&Nonce::from(nonce), &frame, text.as_mut_slice().into());
        frame.extend(text);
        frame.extend(<[u8; 16]>::from(tag.expect("sealed")));
        frame
    }

    pub fn session_key(&self) -> [u8; 32] {
        let purpose: [u8; 16] = [self.numbers.0, self.numbers.1].concat().try_into().expect("two numbers");
        chacha20::hchacha::<R20>(&(*self.key.bytes()).into(), &purpose.into()).into()
    }

    pub fn tick(&self) -> u32 {
        (self.now.as_micros() / 1_000) as u32
    }

    /// What the vehicle has taken so far, for whomever.
    pub fn taken(&self) -> u32 {
        self.vehicle.tally().accepted + self.vehicle.tally().handshakes
    }
}
