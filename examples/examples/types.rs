//! Declares a message and looks at what follows from it: words for the bus, a schema for the log.

use stampfly_types::{Message, Vec3, leaves, message, message_enum};

message_enum! {
    /// How sure the anemometer is.
    pub enum Trust {
        /// Not at all.
        #[default]
        None = 0,
        /// A guess from the drift.
        Estimated = 1,
        /// Measured.
        Measured = 2,
    }
}

message! {
    /// Wind in the world frame.
    pub struct Wind {
        /// Speed towards north, east, down.
        velocity: Vec3 ["m/s"],
        /// One standard deviation, where it is known.
        sigma: Option<f32> ["m/s"],
        /// Where it comes from.
        trust: Trust,
    }
}

fn main() {
    println!("{} takes {} words:", Wind::NAME, Wind::WORDS);
    for leaf in leaves(Wind::FIELDS) {
        println!("  {:<14} {} × {:?} [{}]", leaf.name.to_string(), leaf.count, leaf.kind, leaf.unit);
    }

    let wind = Wind { velocity: Vec3::new(1.5, -0.5, 0.0), sigma: Some(0.3), trust: Trust::Measured };
    let mut words = wind.to_words();
    println!("as words:  {words:08x?}");
    println!("and back:  {:?}", Wind::from_words(&words));

    // Words that are no such message are refused, not guessed at.
    words[5] = 7;
    println!("with an unknown trust: {:?}", Wind::from_words(&words));
}
