//! Only messages travel: a type without a word layout and a log schema cannot be published.
use stampfly_bus::topics;

pub struct Text;

topics! {
    /// One topic.
    pub mod wiring;
    /// Words, but not that kind.
    remark: Text = latest @ on event from pilot => [];
}

fn main() {}
