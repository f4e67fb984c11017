//! Requests of a client: to a vehicle, or to the server.

use super::{AskError, Asked, object, printable};
use serde::Deserialize;
use serde_json::{Map, Value};

/// A request of a client.
#[derive(Clone, Debug, PartialEq)]
pub enum Incoming {
    /// Send the state of these topics at this rate:
    /// `{"id":1,"do":"subscribe","topics":["estimate_state"],"rate":50}`.
    Subscribe {
        /// Repeated in the answer.
        id: u32,
        /// Names of topics, at most [`MOST_TOPICS`].
        topics: Vec<String>,
        /// Messages per second, 1 to [`FASTEST_RATE`].
        rate: u8,
    },
    /// Resume the session of a page whose connection broke: `{"id":1,"do":"resume","session":"…"}`.
    Resume {
        /// Repeated in the answer.
        id: u32,
        /// Session identifier given by the server.
        session: String,
    },
    /// A request to a vehicle.
    Ask(Asked),
}

/// Largest number of topics in a subscription.
pub const MOST_TOPICS: usize = 64;
/// Largest rate of state messages, 1/s.
pub const FASTEST_RATE: u8 = 50;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Resume {
    #[allow(dead_code, reason = "known, and read before")]
    r#do: String,
    session: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Subscribe {
    #[allow(dead_code, reason = "known, and read before")]
    r#do: String,
    topics: Vec<String>,
    rate: u8,
}

impl Incoming {
    /// Parses a request.
    ///
    /// # Errors
    /// The id, 0 without one, and the reason for the refusal.
    pub fn parse(text: &str) -> Result<Self, (u32, AskError)> {
        let mut object = object(text).map_err(|error| (0, error))?;
        let id = object.get("id").and_then(Value::as_u64).and_then(|id| u32::try_from(id).ok());
        if object.get("do").is_some_and(|name| name == "subscribe") {
            let id = id.ok_or((0, AskError::Missing("id")))?;
            object.remove("id");
            return Self::subscribe(id, object).map_err(|error| (id, error));
        }
        if object.get("do").is_some_and(|name| name == "resume") {
            let id = id.ok_or((0, AskError::Missing("id")))?;
            object.remove("id");
            return Self::resume(id, object).map_err(|error| (id, error));
        }
        Asked::from_object(object).map(Self::Ask).map_err(|error| (id.unwrap_or_default(), error))
    }

    fn resume(id: u32, object: Map<String, Value>) -> Result<Self, AskError> {
        let Resume { session, .. } =
            serde_json::from_value(object.into()).map_err(|error| AskError::Unknown(error.to_string()))?;
        printable(&session)?;
        Ok(Self::Resume { id, session })
    }

    fn subscribe(id: u32, object: Map<String, Value>) -> Result<Self, AskError> {
        let Subscribe { topics, rate, .. } =
            serde_json::from_value(object.into()).map_err(|error| AskError::Unknown(error.to_string()))?;
        if topics.len() > MOST_TOPICS {
            return Err(AskError::OutOfRange("topics"));
        }
        topics.iter().try_for_each(|topic| printable(topic))?;
        if !(1..=FASTEST_RATE).contains(&rate) {
            return Err(AskError::OutOfRange("rate"));
        }
        Ok(Self::Subscribe { id, topics, rate })
    }
}
