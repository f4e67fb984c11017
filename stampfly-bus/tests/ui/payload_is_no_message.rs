//! Only messages travel: a type without a word layout and a log schema cannot be published.
pub struct Text;

stampfly_bus::topics! {
    /// Range.
    note: Text = latest @ on event from tof => [landing];
}

fn main() {}
