//! The frame of the HTML pages: heading, figures, and a body that each page brings with its style.
//!
//! A page is one file without any reference to the outside: it opens from a disk, offline, and can be sent by mail.

/// One figure of a page's head.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Metric {
    /// What was measured.
    pub name: String,
    /// The figure, formatted.
    pub value: String,
    /// Its unit, or nothing.
    pub unit: String,
    /// Did it meet its limit, if it has one?
    pub passed: Option<bool>,
}

impl Metric {
    /// A figure without a limit.
    pub fn new(name: impl Into<String>, value: impl ToString, unit: impl Into<String>) -> Self {
        Self { name: name.into(), value: value.to_string(), unit: unit.into(), passed: None }
    }

    /// The same figure, judged.
    #[must_use]
    pub fn judged(self, passed: bool) -> Self {
        Self { passed: Some(passed), ..self }
    }

    fn html(&self) -> String {
        let verdict = match self.passed {
            None => "",
            Some(true) => " class=\"passed\"",
            Some(false) => " class=\"failed\"",
        };
        let [name, value, unit] = [&self.name, &self.value, &self.unit].map(|text| escape(text));
        format!("<tr{verdict}><th scope=\"row\">{name}</th><td><b>{value}</b> <span>{unit}</span></td></tr>\n")
    }
}

/// A page of this heading, a line below it, these figures and this body. `style` is what the body needs beyond the frame's.
pub(crate) fn html(title: &str, subtitle: &str, metrics: &[Metric], style: &str, body: &str) -> String {
    format!(
        include_str!("page.html"),
        style = [include_str!("page.css"), style].concat(),
        title = escape(title),
        subtitle = escape(subtitle),
        metrics = metrics.iter().map(Metric::html).collect::<String>(),
        body = body,
    )
}

/// Text as it may stand in HTML.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
