//! The vehicle's end of MSP, for configurators: attitude, sticks, motors, battery, and PID gains that can be changed.
//!
//! It answers what MultiWii and Betaflight's programs ask when they connect and what they show, in the layouts that both share; every other question is
//! answered with an error frame, because programs wait for an answer. A vehicle says in a [`Card`] what it calls itself and which of its parameters a PID value is:
//! a byte of the protocol is a parameter times a factor, or a factor divided by it for what is a time there and a gain here.
//!
//! Nothing is authenticated, so this is for a cable or for programs on the same machine. An armed vehicle answers, and changes nothing. Sticks and motors are not taken from
//! here: a configurator is no transmitter.
//!
//! Payloads are from the descriptions of [MultiWii](http://www.multiwii.com/wiki/index.php?title=Multiwii_Serial_Protocol) and Betaflight.

use crate::access::{Request, VehicleAccess};
use core::f32::consts::PI;
use heapless::Vec;
use stampfly_link::msp::{Direction, MspDecoder, MspFrame};
use stampfly_param::{Parameters, parameters};
use stampfly_types::messages::FlightStatus;
use stampfly_types::{Duration, Instant, frame};

/// The longest question that is understood: a `SET_PID` of Betaflight with all its rows has 30 bytes of payload.
const QUESTION: usize = 64;
/// Payload of the longest answer.
const PAYLOAD: usize = 128;
/// Rows of a PID table, as MultiWii has them.
pub const ROWS: usize = 10;
/// A question that is cut short is forgotten after this silence.
const SILENCE: Duration = Duration::from_millis(500);
/// MultiWii's full scale: 512 is 1 g.
const ACCEL: f32 = 512.0 / 9.806_65;
/// 4.1 is one degree a second.
const GYRO: f32 = 4.1 * 180.0 / PI;
/// What this protocol is called by Betaflight: 0, and the version 1.40 of what its questions mean, the last without longer tables.
const API: [u8; 3] = [0, 1, 40];

/// What a byte of the PID table is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidTerm {
    /// Name of the parameter.
    pub parameter: &'static str,
    /// How a byte is made of it.
    pub scale: Scale,
}

/// How a byte is made of a parameter. It is rounded, and limited to what a byte holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// The parameter times this.
    Times(f32),
    /// This divided by the parameter: an integral time becomes a gain. Zero is the parameter's largest value.
    Over(f32),
}

/// A row of the PID table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidRow {
    /// As configurators show it.
    pub name: &'static str,
    /// Proportional, integral, derivative; `None` is shown as zero and cannot be changed.
    pub terms: [Option<PidTerm>; 3],
}

/// What a vehicle is for a configurator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Card {
    /// Which firmware it is, four letters. Programs change what they ask with those that they know: `BTFL`, `INAV`.
    pub variant: [u8; 4],
    /// Which board, four letters.
    pub board: [u8; 4],
    /// Its version.
    pub version: [u8; 3],
    /// Its name.
    pub name: &'static str,
    /// Its kind in MultiWii's numbering: 3 is a quadrotor in X.
    pub kind: u8,
    /// Number of motors, at most eight.
    pub motors: u8,
    /// A control cycle, µs.
    pub cycle: u16,
    /// With Betaflight's voltage in hundredths after MultiWii's seven bytes of `ANALOG`.
    pub long_analog: bool,
    /// The PID table, at most [`ROWS`]; configurators that know no names expect roll, pitch, yaw, altitude, position, position rate, navigation, level, magnetometer,
    /// velocity.
    pub rows: &'static [PidRow],
    /// What else programs of MultiWii change; `None` where they cannot.
    pub misc: Option<Misc>,
}

/// The four numbers of MultiWii's `MISC` that a vehicle may have as parameters. A program that sends less than all changes what it sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misc {
    /// The least command, a number of two bytes.
    pub least_command: PidTerm,
    /// Scale of the battery's voltage.
    pub battery_scale: PidTerm,
    /// The level at which it warns.
    pub battery_warning: PidTerm,
    /// The level at which it is empty.
    pub battery_critical: PidTerm,
}

impl Scale {
    fn number(self, value: f32, most: u16) -> u16 {
        let scaled = match self {
            Self::Times(factor) => value * factor,
            Self::Over(factor) => factor / value,
        };
        // Rounds; no number becomes zero.
        (scaled + 0.5).clamp(0.0, most.into()) as u16
    }

    fn byte(self, value: f32) -> u8 {
        self.number(value, u8::MAX.into()) as u8
    }

    /// What a parameter that goes up to `most` is then.
    fn value(self, number: u16, most: f32) -> f32 {
        match self {
            Self::Times(factor) => f32::from(number) / factor,
            Self::Over(_) if number == 0 => most,
            Self::Over(factor) => factor / f32::from(number),
        }
    }
}

/// An answer that grows. What does not fit is left out: no answer here is so long.
struct Payload(Vec<u8, PAYLOAD>);

impl Payload {
    const fn new() -> Self {
        Self(Vec::new())
    }

    fn bytes(mut self, bytes: &[u8]) -> Self {
        _ = self.0.extend_from_slice(bytes);
        self
    }

    fn u8(self, byte: u8) -> Self {
        self.bytes(&[byte])
    }

    fn u16(self, number: u16) -> Self {
        self.bytes(&number.to_le_bytes())
    }

    /// Limited to what it holds, and rounded.
    fn i16(self, number: f32) -> Self {
        let rounded = if number < 0.0 { number - 0.5 } else { number + 0.5 };
        self.bytes(&(rounded as i16).to_le_bytes())
    }

    fn u32(self, number: u32) -> Self {
        self.bytes(&number.to_le_bytes())
    }
}

/// A pulse of −1 to 1.
fn pulse(stick: f32) -> u16 {
    (1_500.5 + 500.0 * stick.clamp(-1.0, 1.0)) as u16
}

/// The vehicle's end of one line.
///
/// ```
/// use stampfly_services::msp::{Card, Msp};
/// const CARD: Card = Card {
///     variant: *b"SFLY", board: *b"SFLY", version: [0, 2, 0], name: "stampfly", kind: 3, motors: 4, cycle: 2_500, long_analog: true, rows: &[],
///     misc: None,
/// };
/// assert_eq!(Msp::new(&CARD).discarded(), 0);
/// ```
#[derive(Clone, Debug)]
pub struct Msp {
    card: &'static Card,
    decoder: MspDecoder<QUESTION>,
    heard: Instant,
}

impl Msp {
    /// Of this vehicle.
    #[must_use]
    pub const fn new(card: &'static Card) -> Self {
        Self { card, decoder: MspDecoder::new(), heard: Instant::ZERO }
    }

    /// Bytes so far that were part of no question. Wraps around.
    #[must_use]
    pub const fn discarded(&self) -> u32 {
        self.decoder.discarded()
    }

    /// Takes what was heard, and answers each question in it.
    pub fn hear(&mut self, now: Instant, bytes: &[u8], access: &mut dyn VehicleAccess, put: &mut dyn FnMut(&[u8])) {
        self.hear_any(now, false, bytes, access, put);
    }

    /// The same of what lay in the caller's queue for more than a second: what would change
    /// something is answered with an error, and changes nothing.
    pub fn hear_late(
        &mut self,
        now: Instant,
        bytes: &[u8],
        access: &mut dyn VehicleAccess,
        put: &mut dyn FnMut(&[u8]),
    ) {
        self.hear_any(now, true, bytes, access, put);
    }

    fn hear_any(
        &mut self,
        now: Instant,
        is_late: bool,
        bytes: &[u8],
        access: &mut dyn VehicleAccess,
        put: &mut dyn FnMut(&[u8]),
    ) {
        if now.since(self.heard) >= SILENCE {
            self.decoder.silence();
        }
        self.heard = now;
        let card = self.card;
        for byte in bytes {
            match self.decoder.feed(*byte) {
                Some(asked) if asked.direction != Direction::Request => {}
                Some(asked) => say(&asked, answer(now, is_late, card, &asked, access), put),
                // One that there is no room for is none that is known here.
                None => {
                    let asked = self.decoder.too_long().filter(|frame| frame.direction == Direction::Request);
                    asked.into_iter().for_each(|asked| say(&asked, None, put));
                }
            }
        }
    }
}

/// Answers a question. With nothing it is an error.
fn say(asked: &MspFrame<'_>, payload: Option<Payload>, put: &mut dyn FnMut(&[u8])) {
    let direction = if payload.is_some() { Direction::Reply } else { Direction::Error };
    let payload = payload.unwrap_or(Payload::new()).0;
    let mut out = [0; PAYLOAD + 16];
    let length = asked.answer(direction, &payload).write(&mut out);
    if let Some(frame) = length.and_then(|length| out.get(..length)) {
        put(frame);
    }
}

/// What a question is answered with; `None` for an error.
fn answer(
    now: Instant,
    is_late: bool,
    card: &Card,
    asked: &MspFrame<'_>,
    access: &mut dyn VehicleAccess,
) -> Option<Payload> {
    let empty = Payload::new();
    let status = access.view().state();
    let changes = !status.armed && !is_late;
    match asked.id {
        // SET_PID, SET_MISC, RESET_CONF, BIND of MultiWii, SET_REBOOT, EEPROM_WRITE, SELECT_SETTING of the only profile.
        202 if changes => set_pids(card, asked.payload, access.parameters()).then_some(empty),
        207 if changes => set_misc(&card.misc?, asked.payload, access.parameters()).then_some(empty),
        208 if changes => access.request(now, Request::ResetParameters).is_ok().then_some(empty),
        241 if changes => access.request(now, Request::Bind).is_ok().then_some(empty),
        68 if changes => access.request(now, Request::Restart).is_ok().then_some(empty),
        250 if changes => access.request(now, Request::SaveParameters).is_ok().then_some(empty),
        210 if changes && asked.payload == [0] => Some(empty),
        112 => Some(pids(card, access.parameters())),
        114 if card.misc.is_some() => Some(misc(&card.misc?, access.parameters())),
        _ => identity(card, asked.id).or_else(|| state(card, asked.id, &status, access)),
    }
}

/// What does not change while it is on.
fn identity(card: &Card, id: u16) -> Option<Payload> {
    let empty = Payload::new();
    let [major, minor, _] = card.version;
    Some(match id {
        1 => empty.bytes(&API),
        2 => empty.bytes(&card.variant),
        3 => empty.bytes(&card.version),
        // Hardware revision, kind of board, capabilities, and the name with its length.
        4 => empty.bytes(&card.board).u16(0).u8(0).u8(0).u8(card.name.len() as u8).bytes(card.name.as_bytes()),
        // Nobody can use when it was built, and a build that is the same every time does not say.
        5 => empty.bytes(b"Jan 01 1970").bytes(b"00:00:00").bytes(b"0000000"),
        10 => empty.bytes(card.name.as_bytes()),
        // FEATURE_CONFIG: none. Some programs take an error frame with this number, which is a '$', for the beginning of another frame.
        36 => empty.u32(0),
        // IDENT: version, kind, version of MSP, capabilities.
        100 => empty.u8(major.saturating_mul(100).saturating_add(minor)).u8(card.kind).u8(0).u32(0),
        // BOX: no switch of a transmitter is assigned here.
        113 => empty.u16(0).u16(0),
        // MISC: power trigger, least and largest throttle, command of a stopped motor, failsafe throttle, flights, life time, declination, battery's scale and levels.
        114 => empty.u16(0).u16(1_000).u16(2_000).u16(1_000).u16(1_000).u16(0).u32(0).u16(0).u32(0),
        115 => empty.bytes(&[0; 8]),
        116 => empty.bytes(b"ARM;ANGLE;"),
        117 => card.rows.iter().fold(empty, |names, row| names.bytes(row.name.as_bytes()).u8(b';')),
        119 => empty.bytes(&[0, 1]),
        // UID: three numbers.
        160 => empty.u32(0).u32(0).u32(0),
        // ACC_TRIM, and four numbers for whoever looks for a fault.
        240 => empty.u16(0).u16(0),
        254 => empty.bytes(&[0; 8]),
        _ => return None,
    })
}

/// What it does at the moment. Zeros for what it does not know.
fn state(card: &Card, id: u16, status: &FlightStatus, access: &dyn VehicleAccess) -> Option<Payload> {
    let (empty, view) = (Payload::new(), access.view());
    let estimate = view.estimate().map(|(_, estimate)| estimate).unwrap_or_default();
    let power = view.power().map(|(_, power)| power).unwrap_or_default();
    Some(match id {
        101 | 150 => {
            let there =
                [view.imu().is_some(), view.baro().is_some(), view.mag().is_some(), false, view.tof().is_some()];
            let sensors = there.iter().rev().fold(0, |bits, is| bits << 1 | u16::from(*is));
            let boxes = u32::from(status.armed) | u32::from(!status.mode.commands_rates()) << 1;
            let short = empty.u16(card.cycle).u16(0).u16(sensors).u32(boxes).u8(0);
            if id == 101 {
                return Some(short);
            }
            // Load, profiles, rate profile, no more boxes; how many reasons there are not to arm, and which.
            short.u16(0).u8(1).u8(0).u8(0).u8(32).u32(status.blocks.bits())
        }
        102 => {
            let (imu, mag) = (view.imu().map(|(_, imu)| imu), view.mag().map(|(_, mag)| mag));
            let imu = imu.unwrap_or_default();
            let field = mag.map(|mag| mag.field).unwrap_or_default();
            let numbers = [imu.accel * ACCEL, imu.gyro * GYRO, field];
            numbers.iter().flat_map(|vector| vector.to_array()).fold(empty, Payload::i16)
        }
        104 => {
            let duty = view.motors().map(|(_, motors)| motors.duty).unwrap_or_default();
            (0..8).fold(empty, |pulses, motor| {
                let duty = duty.get(motor).filter(|_| motor < usize::from(card.motors));
                pulses.u16(duty.map_or(0, |duty| (1_000.5 + 1_000.0 * duty.clamp(0.0, 1.0)) as u16))
            })
        }
        105 => {
            let sticks = view.pilot().map(|(_, input)| input).unwrap_or_default();
            let angle = !sticks.mode.commands_rates();
            let switches = [sticks.arm, angle, sticks.kill].map(|is_on| if is_on { 1.0 } else { -1.0 });
            let all = [sticks.roll, sticks.pitch, sticks.yaw, sticks.throttle].into_iter().chain(switches);
            all.chain([-1.0]).fold(empty, |pulses, stick| pulses.u16(pulse(stick)))
        }
        108 => {
            let [roll, pitch, yaw] = frame::roll_pitch_yaw(&estimate.attitude).map(f32::to_degrees);
            // Nose down is positive there, and north is 0: half a degree before it is not 360.
            empty.i16(roll * 10.0).i16(pitch * -10.0).u16((yaw + 360.5) as u16 % 360)
        }
        109 => {
            let up = estimate.position.z * -100.0;
            empty.bytes(&(up as i32).to_le_bytes()).i16(estimate.velocity.z * -100.0)
        }
        110 => {
            // Capacity that was used and strength of the radio are not known.
            let short = empty.u8(Scale::Times(10.0).byte(power.voltage)).u16(0).u16(0).i16(power.current * 100.0);
            if card.long_analog { short.u16((power.voltage * 100.0 + 0.5) as u16) } else { short }
        }
        // Cells, capacity, capacity that was used, current, state (0 is well), voltage.
        130 => {
            let [amperes, volts] = [power.current, power.voltage].map(|number| (number * 100.0 + 0.5) as u16);
            empty.u8(1).u16(0).u16(0).u16(amperes).u8(0).u16(volts)
        }
        _ => return None,
    })
}

fn pids(card: &Card, parameters: &dyn Parameters) -> Payload {
    let terms = card.rows.iter().take(ROWS).flat_map(|row| row.terms);
    let rest = ROWS.saturating_sub(card.rows.len()) * 3;
    let bytes = terms.map(|term| term.map_or(0, |term| byte(term, parameters))).chain(core::iter::repeat_n(0, rest));
    bytes.fold(Payload::new(), Payload::u8)
}

/// `MISC`: power trigger, least and largest throttle, least command, failsafe throttle, flights, life time, declination, then the battery's scale, first
/// warning, warning and critical level. What a vehicle does not have is zero.
fn misc(of: &Misc, parameters: &dyn Parameters) -> Payload {
    let [scale, warning, critical] =
        [of.battery_scale, of.battery_warning, of.battery_critical].map(|term| shown(term, u8::MAX.into(), parameters));
    let empty = Payload::new().u16(0).u16(0).u16(0).u16(shown(of.least_command, u16::MAX, parameters));
    empty.u16(0).u16(0).u32(0).u16(0).u8(scale as u8).u8(0).u8(warning as u8).u8(critical as u8)
}

/// Where they are in the payload. Old programs send its first two bytes alone.
fn set_misc(of: &Misc, payload: &[u8], parameters: &mut dyn Parameters) -> bool {
    let word = payload.get(6..8).and_then(|bytes| bytes.first_chunk()).map(|bytes| u16::from_le_bytes(*bytes));
    let byte = |at: usize| payload.get(at).map(|byte| u16::from(*byte));
    let sent = [
        (of.least_command, word, u16::MAX),
        (of.battery_scale, byte(18), u8::MAX.into()),
        (of.battery_warning, byte(20), u8::MAX.into()),
        (of.battery_critical, byte(21), u8::MAX.into()),
    ];
    change(sent.into_iter().filter_map(|(term, number, most)| Some((term, number?, most))), parameters)
}

/// The number that stands for a parameter; 0 for one that there is not.
fn shown(term: PidTerm, most: u16, parameters: &dyn Parameters) -> u16 {
    let value = parameters::find(parameters, term.parameter).ok().and_then(|index| parameters.get(index));
    value.map_or(0, |value| term.scale.number(value, most))
}

fn byte(term: PidTerm, parameters: &dyn Parameters) -> u8 {
    shown(term, u8::MAX.into(), parameters) as u8
}

fn set_pids(card: &Card, payload: &[u8], parameters: &mut dyn Parameters) -> bool {
    let terms = card.rows.iter().take(ROWS).flat_map(|row| row.terms);
    change(terms.zip(payload).filter_map(|(term, new)| Some((term?, u16::from(*new), u8::MAX.into()))), parameters)
}

/// Changes all or nothing: parameters, numbers, and the most that fits there. A number that is what was shown leaves its parameter alone, which it stands for only roughly.
fn change(numbers: impl Iterator<Item = (PidTerm, u16, u16)>, parameters: &mut dyn Parameters) -> bool {
    let mut wanted: Vec<(usize, f32), { 3 * ROWS }> = Vec::new();
    for (term, new, most) in numbers {
        if shown(term, most, parameters) == new {
            continue;
        }
        let Ok(index) = parameters::find(parameters, term.parameter) else { return false };
        let Some(info) = parameters.describe(index) else { return false };
        let value = term.scale.value(new, info.max);
        if !(info.min..=info.max).contains(&value) || wanted.push((index, value)).is_err() {
            return false;
        }
    }
    // Each value before, so that a combination that cannot fly changes nothing.
    let mut before: Vec<(usize, f32), { 3 * ROWS }> = Vec::new();
    let taken = wanted.iter().all(|(index, value)| {
        let _ = parameters.get(*index).map(|value| before.push((*index, value)));
        parameters.set(*index, *value).is_ok()
    });
    let flies = taken && before.iter().all(|(index, _)| parameters.check(Some(*index)).is_ok());
    if !flies {
        for (index, value) in before {
            let _ = parameters.set(index, value);
        }
    }
    flies
}
