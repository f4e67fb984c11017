//! [serde](https://serde.rs) support for messages and their fields, behind the feature `serde`.
//!
//! A message is serialised as its words. Reading refuses the same words as
//! [`from_words`](crate::Message::from_words): unknown variants, unnamed bits, quaternions whose
//! length is not one. The macros that declare messages generate the code and require nothing of the
//! fields' types, so messages of other crates compile with and without the feature, whether or not
//! those crates depend on serde.
//!
//! Not for radio links, and not for data that other versions read: it contains no schema.

/// Implements serde's traits for a message when the feature `serde` of this crate is on. For
/// [`message!`](crate::message!) only.
#[cfg(feature = "serde")]
#[doc(hidden)]
#[macro_export]
macro_rules! __serde_message {
    ($Name:ident) => {
        impl $crate::serial::Serialize for $Name {
            fn serialize<S: $crate::serial::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                $crate::serial::serialize_message(self, serializer)
            }
        }

        impl<'de> $crate::serial::Deserialize<'de> for $Name {
            fn deserialize<D: $crate::serial::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                $crate::serial::deserialize_message(deserializer)
            }
        }
    };
}

/// Implements serde's traits for an enumeration or a set of flags when the feature `serde` of this
/// crate is on.
#[cfg(feature = "serde")]
#[doc(hidden)]
#[macro_export]
macro_rules! __serde_field {
    ($Name:ident) => {
        impl $crate::serial::Serialize for $Name {
            fn serialize<S: $crate::serial::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                $crate::serial::serialize_word(self, serializer)
            }
        }

        impl<'de> $crate::serial::Deserialize<'de> for $Name {
            fn deserialize<D: $crate::serial::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                $crate::serial::deserialize_word(deserializer)
            }
        }
    };
}

#[cfg(not(feature = "serde"))]
#[doc(hidden)]
#[macro_export]
macro_rules! __serde_message {
    ($Name:ident) => {};
}

#[cfg(not(feature = "serde"))]
#[doc(hidden)]
#[macro_export]
macro_rules! __serde_field {
    ($Name:ident) => {};
}

#[cfg(feature = "serde")]
pub use with_serde::*;

#[cfg(feature = "serde")]
mod with_serde {
    use crate::{Field, Message};
    use core::fmt;
    use core::marker::PhantomData;
    use serde::de::{Error, SeqAccess, Visitor};
    use serde::ser::SerializeTuple;
    pub use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// Serialises a message as the tuple of its words.
    pub fn serialize_message<M: Message, S: Serializer>(message: &M, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(M::WORDS)?;
        message.to_words().as_ref().iter().try_for_each(|word| tuple.serialize_element(word))?;
        tuple.end()
    }

    /// Deserialises a message. An error when the words of a field do not encode a value.
    pub fn deserialize_message<'de, M: Message, D: Deserializer<'de>>(deserializer: D) -> Result<M, D::Error> {
        deserializer.deserialize_tuple(M::WORDS, Words(PhantomData))
    }

    struct Words<M>(PhantomData<M>);

    impl<'de, M: Message> Visitor<'de> for Words<M> {
        type Value = M;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "the {} words of a {}", M::WORDS, M::NAME)
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<M, A::Error> {
            let mut words = M::ZERO;
            for (index, word) in words.as_mut().iter_mut().enumerate() {
                *word = sequence.next_element()?.ok_or_else(|| A::Error::invalid_length(index, &self))?;
            }
            M::from_words(&words).ok_or_else(|| A::Error::custom("a field refuses its words"))
        }
    }

    /// Serialises a field of one word as its number.
    pub fn serialize_word<F: Field, S: Serializer>(field: &F, serializer: S) -> Result<S::Ok, S::Error> {
        let mut word = [0];
        field.write(&mut word);
        let [number] = word;
        serializer.serialize_u32(number)
    }

    /// Deserialises a field of one word. An error when the number does not encode a value.
    pub fn deserialize_word<'de, F: Field, D: Deserializer<'de>>(deserializer: D) -> Result<F, D::Error> {
        let number = u32::deserialize(deserializer)?;
        F::read(&[number]).ok_or_else(|| D::Error::custom("an unknown number"))
    }
}
