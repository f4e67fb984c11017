//! The parameter protocol: a list, one by number or name, and setting.
//!
//! MAVLink's names have at most 16 characters; a longer one is [shortened](short_name). A parameter that is set answers with the
//! value that it has then, which is how a client learns that it was refused. On an armed vehicle one that may not change in flight is taken, too, and a text says that
//! it waits.

use super::client::{Client, Put};
use super::said::Said;
use super::unserved::Unserved;
use crate::access::VehicleAccess;
use core::fmt::Write;
use heapless::String;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_param::{ParameterError, Parameters, parameters};

/// Characters of a name.
const NAME: usize = 16;
/// Parameters of a list that are sent at once: with fifty turns a second, two hundred parameters are there in two thirds of a
/// second, and a serial line of 115200 baud still carries it.
const AT_ONCE: usize = 6;

/// The name that MAVLink has room for: the name itself, or its first ten characters, a tilde and five characters that are made of
/// all of it.
///
/// ```
/// use stampfly_services::mavlink::short_name;
/// assert_eq!(short_name("rate.roll.kp"), "rate.roll.kp");
/// assert_eq!(short_name("mode.takeoff.throttle"), "mode.takeo~ykaa2");
/// ```
#[must_use]
pub fn short_name(name: &str) -> String<NAME> {
    let mut short = String::new();
    if short.push_str(name).is_ok() {
        return short;
    }
    // FNV-1a.
    let mut hash = name.bytes().fold(0x811C_9DC5_u32, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193));
    for character in name.chars().filter(char::is_ascii).take(NAME - 6) {
        _ = short.push(character);
    }
    _ = short.push('~');
    for _ in 0..5 {
        _ = short.push(char::from_digit(hash % 36, 36).unwrap_or('0'));
        hash /= 36;
    }
    short
}

fn count(parameters: &dyn Parameters) -> usize {
    (0..).take_while(|index| parameters.describe(*index).is_some()).count()
}

fn find(parameters: &dyn Parameters, id: &[u8; NAME]) -> Option<usize> {
    let end = id.iter().position(|byte| *byte == 0).unwrap_or(NAME);
    let wanted = core::str::from_utf8(id.get(..end)?).ok()?;
    let mut all = (0..).map_while(|index| parameters.describe(index));
    all.position(|info| info.name == wanted || short_name(info.name) == wanted)
}

fn value(parameters: &dyn Parameters, index: usize) -> Option<Said> {
    let (info, value) = (parameters.describe(index)?, parameters.get(index)?);
    let mut id = [0; NAME];
    id.iter_mut().zip(short_name(info.name).bytes()).for_each(|(to, from)| *to = from);
    let data = PARAM_VALUE_DATA {
        param_value: value,
        param_count: count(parameters) as u16,
        param_index: index as u16,
        param_id: id.into(),
        param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
    };
    Some(data.into())
}

/// Sends the next ones of a list that was asked for.
pub(super) fn send_next<C>(client: &mut Client<C>, parameters: &dyn Parameters, put: Put<'_, C>) {
    for _ in 0..AT_ONCE {
        let Some(index) = client.next_parameter else { return };
        let Some(message) = value(parameters, index) else {
            client.next_parameter = None;
            return;
        };
        client.next_parameter = Some(index + 1);
        client.send(&message, put);
    }
}

/// Answers a question for one.
pub(super) fn read<C>(
    client: &mut Client<C>,
    request: &PARAM_REQUEST_READ_DATA,
    asker: [u8; 2],
    parameters: &dyn Parameters,
    put: Put<'_, C>,
) {
    let index = match usize::try_from(request.param_index) {
        Ok(index) => Some(index),
        // Negative: by name.
        Err(_) => find(parameters, &request.param_id.into()),
    };
    match index.and_then(|index| value(parameters, index)) {
        Some(message) => client.send(&message, put),
        None => unknown(client, &request.param_id.into(), request.param_index, asker, put),
    }
}

/// Says that there is no such parameter: to programs each time, to people once in a while.
fn unknown<C>(client: &mut Client<C>, id: &[u8; NAME], index: i16, asker: [u8; 2], put: Put<'_, C>) {
    let [target_system, target_component] = asker;
    let error = PARAM_ERROR_DATA {
        param_index: index,
        target_system,
        target_component,
        param_id: (*id).into(),
        error: MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST,
    };
    client.send(&error.into(), put);
    match id.utf8_chunks().next().map(|text| text.valid().trim_end_matches('\0')) {
        Some(name) if index < 0 => client.complain(Unserved::Parameter, &name, put),
        _ => client.complain(Unserved::Parameter, &index, put),
    }
}

/// Sets one, and answers with what it is then.
pub(super) fn set<C>(
    client: &mut Client<C>,
    request: &PARAM_SET_DATA,
    asker: [u8; 2],
    access: &mut dyn VehicleAccess,
    put: Put<'_, C>,
) {
    let armed = access.view().state().armed;
    let parameters = access.parameters();
    let Some(index) = find(parameters, &request.param_id.into()) else {
        return unknown(client, &request.param_id.into(), -1, asker, put);
    };
    let name: String<64> = parameters.describe(index).and_then(|info| info.name.try_into().ok()).unwrap_or_default();
    let waits = armed && parameters.describe(index).is_some_and(|info| !info.in_flight);
    // Two names and a sentence.
    let mut text = String::<200>::new();
    let severity = match parameters::set_at(parameters, index, request.param_value) {
        Ok(()) => {
            _ = if waits { write!(text, "{name}: {}", parameters::WAITS) } else { Ok(()) };
            MavSeverity::MAV_SEVERITY_NOTICE
        }
        Err(error) => {
            // A conflict names both parameters.
            _ = match error {
                ParameterError::Conflict(_) => write!(text, "{error}"),
                _ => write!(text, "{name}: {error}"),
            };
            MavSeverity::MAV_SEVERITY_ERROR
        }
    };
    if let Some(message) = value(parameters, index) {
        client.send(&message, put);
    }
    if !text.is_empty() {
        client.say(severity, &text, put);
    }
}
