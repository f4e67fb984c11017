//! Answers to requests.

use super::Asked;
use serde_json::json;

/// Successful answer of a vehicle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reply {
    /// Text for display.
    pub text: String,
    /// Value of the requested parameter.
    pub value: Option<f64>,
}

impl Reply {
    /// An answer with text only.
    pub fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), value: None }
    }

    /// An answer with a value.
    #[must_use]
    pub fn value(value: f64) -> Self {
        Self { text: value.to_string(), value: Some(value) }
    }
}

impl Asked {
    /// The JSON answer to this request:
    /// `{"reply":{"vehicle":0,"id":17,"ok":true,"text":"armed","value":null}}`.
    #[must_use]
    pub fn answered(&self, answer: Result<Reply, String>) -> String {
        reply_text(Some(self.vehicle), self.id, answer)
    }
}

/// The JSON answer to the request with this id; `None` for an answer of the server itself.
#[must_use]
pub fn reply_text(vehicle: Option<usize>, id: u32, answer: Result<Reply, String>) -> String {
    let (ok, Reply { text, value }) = match answer {
        Ok(reply) => (true, reply),
        Err(text) => (false, Reply::text(text)),
    };
    json!({ "reply": { "vehicle": vehicle, "id": id, "ok": ok, "text": text, "value": value } }).to_string()
}
