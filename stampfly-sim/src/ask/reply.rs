//! What a vehicle, or the server, answers to an ask.

use super::Asked;
use serde_json::json;

/// What a vehicle answers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reply {
    /// For people.
    pub text: String,
    /// The number that was asked for.
    pub value: Option<f64>,
}

impl Reply {
    /// Only words.
    pub fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), value: None }
    }

    /// A number.
    #[must_use]
    pub fn value(value: f64) -> Self {
        Self { text: value.to_string(), value: Some(value) }
    }
}

impl Asked {
    /// The text that answers it: `{"reply":{"vehicle":0,"id":17,"ok":true,"text":"armed","value":null}}`.
    #[must_use]
    pub fn answered(&self, answer: Result<Reply, String>) -> String {
        reply_text(Some(self.vehicle), self.id, answer)
    }
}

/// The text that answers what came with this id. Without a vehicle, the server answers.
#[must_use]
pub fn reply_text(vehicle: Option<usize>, id: u32, answer: Result<Reply, String>) -> String {
    let (ok, Reply { text, value }) = match answer {
        Ok(reply) => (true, reply),
        Err(text) => (false, Reply::text(text)),
    };
    json!({ "reply": { "vehicle": vehicle, "id": id, "ok": ok, "text": text, "value": value } }).to_string()
}
