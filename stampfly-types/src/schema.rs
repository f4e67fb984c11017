//! Schemas: what the words of a message mean.
//!
//! [`message!`](crate::message!) generates one [`FieldInfo`] for each field. A field may be a message itself, an option
//! or an array of such, so a schema is a tree. Tools that work on words (a log, a console, a plot) ask for its
//! [`leaves`]: scalars, and arrays of scalars, in word order, each with a flat name. Nothing outside of this file walks
//! the tree.
//!
//! | declaration | leaves |
//! |---|---|
//! | `height: f32` | `height` |
//! | `accel: Vec3` | `accel`, three elements |
//! | `range: Option<f32>` | `range_present`, `range` |
//! | `wind: Wind`, a message with `speed` and `sigma` | `wind_speed`, `wind_sigma` |
//! | `wheels: [Wheel; 2]`, a message with `rate` | `wheels_0_rate`, `wheels_1_rate` |
//!
//! Flat names are what logs and plots can hold: a ULog field name is letters, digits and underscores. Two fields whose
//! flat names are the same (`wind_speed: f32` beside that `wind`) cannot be told apart in a log.

use core::fmt;

/// How one element of a field is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FieldKind {
    /// IEEE 754 single.
    F32,
    /// IEEE 754 double in two words, low first.
    F64,
    /// Unsigned, one word.
    U32,
    /// Signed, one word.
    I32,
    /// Unsigned 16 bits in one word.
    U16,
    /// Signed 16 bits in one word.
    I16,
    /// Unsigned 8 bits in one word.
    U8,
    /// Signed 8 bits in one word.
    I8,
    /// Truth value in one word, 0 or 1.
    Bool,
    /// Unsigned 64 bits in two words, low first.
    U64,
    /// Signed 64 bits in two words, low first.
    I64,
    /// One of a list of named values, in one word.
    Enum(&'static [(&'static str, u32)]),
    /// A set of named bits, in one word.
    Flags(&'static [(&'static str, u32)]),
    /// A message with this schema.
    Message(&'static [FieldInfo]),
    /// A value that may be absent: one word, 0 or 1, then the words of the value, zero when it is absent.
    Option {
        /// How one element of the value is stored.
        kind: &'static FieldKind,
        /// How many elements the value has.
        count: usize,
    },
}

impl FieldKind {
    /// Number of words of one element.
    #[must_use]
    pub const fn size(self) -> usize {
        match self {
            Self::F64 | Self::U64 | Self::I64 => 2,
            Self::Message(fields) => {
                let (mut size, mut index) = (0, 0);
                while index < fields.len() {
                    size += fields[index].words;
                    index += 1;
                }
                size
            }
            Self::Option { kind, count } => 1 + count * kind.size(),
            _ => 1,
        }
    }

    /// The value in the words of one element; `None` when it is no scalar, or when words are missing.
    #[must_use]
    pub fn value(self, words: &[u32]) -> Option<Value> {
        let word = *words.first()?;
        let long = || words.get(1).map(|high| u64::from(word) | u64::from(*high) << 32);
        Some(match self {
            Self::F32 => Value::F32(f32::from_bits(word)),
            Self::F64 => Value::F64(f64::from_bits(long()?)),
            Self::U32 | Self::U16 | Self::U8 => Value::Unsigned(word.into()),
            Self::I32 | Self::I16 | Self::I8 => Value::Signed(word.cast_signed().into()),
            Self::U64 => Value::Unsigned(long()?),
            Self::I64 => Value::Signed(long()?.cast_signed()),
            Self::Bool => Value::Bool(word != 0),
            Self::Enum(names) => Value::Enum { number: word, names },
            Self::Flags(names) => Value::Flags { bits: word, names },
            Self::Message(_) | Self::Option { .. } => return None,
        })
    }

    /// How many levels of messages and options it has.
    const fn depth(self) -> usize {
        match self {
            Self::Message(fields) => 1 + depth(fields),
            Self::Option { kind, .. } => 1 + kind.depth(),
            _ => 0,
        }
    }
}

/// One line of a message's schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldInfo {
    /// The field's name.
    pub name: &'static str,
    /// SI unit, empty where there is none.
    pub unit: &'static str,
    /// Storage of one element.
    pub kind: FieldKind,
    /// Number of elements.
    pub count: usize,
    /// Number of words the field takes.
    pub words: usize,
}

/// Most levels of messages and options in each other, the outermost message included.
pub const MAX_DEPTH: usize = 6;

const fn depth(fields: &[FieldInfo]) -> usize {
    let (mut deepest, mut index) = (0, 0);
    while index < fields.len() {
        let depth = fields[index].kind.depth();
        if depth > deepest {
            deepest = depth;
        }
        index += 1;
    }
    deepest
}

/// Refuses at compile time what [`message!`](crate::message!) cannot refuse by its syntax.
#[doc(hidden)]
#[must_use]
pub const fn checked(fields: &'static [FieldInfo]) -> &'static [FieldInfo] {
    assert!(depth(fields) < MAX_DEPTH, "messages and options are nested deeper than stampfly_types::schema::MAX_DEPTH");
    let mut index = 0;
    while index < fields.len() {
        let dimensionless = matches!(fields[index].unit.as_bytes(), b"" | b"1");
        assert!(!dimensionless || fields[index].unit.is_empty(), "a field without a unit is declared without brackets");
        index += 1;
    }
    fields
}

/// A scalar of a sample, with what its kind says about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A single.
    F32(f32),
    /// A double.
    F64(f64),
    /// An unsigned integer of any size.
    Unsigned(u64),
    /// A signed integer of any size.
    Signed(i64),
    /// A truth value.
    Bool(bool),
    /// One of the named values, or a number that has no name.
    Enum {
        /// The number.
        number: u32,
        /// All names and numbers.
        names: &'static [(&'static str, u32)],
    },
    /// A set of named bits.
    Flags {
        /// The bits.
        bits: u32,
        /// All names and masks.
        names: &'static [(&'static str, u32)],
    },
}

impl Value {
    /// The value as a number: exact for everything but 64-bit integers beyond 2⁵³.
    #[must_use]
    pub fn as_f64(self) -> f64 {
        match self {
            Self::F32(value) => value.into(),
            Self::F64(value) => value,
            Self::Unsigned(value) => value as f64,
            Self::Signed(value) => value as f64,
            Self::Bool(value) => f64::from(u8::from(value)),
            Self::Enum { number, .. } => number.into(),
            Self::Flags { bits, .. } => bits.into(),
        }
    }
}

/// Names for what has names: `Flying`, `IMPACT LOW_BATTERY`, `none`; `7?` for a number without one.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::F32(value) => write!(f, "{value}"),
            Self::F64(value) => write!(f, "{value}"),
            Self::Unsigned(value) => write!(f, "{value}"),
            Self::Signed(value) => write!(f, "{value}"),
            Self::Bool(value) => write!(f, "{value}"),
            Self::Enum { number, names } => match names.iter().find(|(_, known)| known == number) {
                Some((name, _)) => f.write_str(name),
                None => write!(f, "{number}?"),
            },
            Self::Flags { bits: 0, .. } => f.write_str("none"),
            Self::Flags { bits, names } => {
                let set = names.iter().filter(|(_, mask)| bits & mask != 0);
                set.enumerate().try_for_each(|(place, (name, _))| {
                    let space = if place == 0 { "" } else { " " };
                    write!(f, "{space}{name}")
                })
            }
        }
    }
}

/// The flat name of a leaf: its field, behind those it is nested in, joined by underscores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LeafName {
    /// Name, and place in an array of messages or options.
    parts: [(&'static str, Option<usize>); MAX_DEPTH],
    length: usize,
}

impl LeafName {
    /// The innermost field's own name.
    #[must_use]
    pub fn field(&self) -> &'static str {
        let names = self.parts.iter().take(self.length).map(|(name, _)| *name);
        names.rev().find(|name| !name.is_empty()).unwrap_or_default()
    }

    fn push(&mut self, name: &'static str, index: Option<usize>) {
        if let Some(place) = self.parts.get_mut(self.length) {
            *place = (name, index);
            self.length += 1;
        }
    }
}

impl fmt::Display for LeafName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut joint = "";
        for (name, index) in self.parts.iter().take(self.length) {
            if !name.is_empty() {
                write!(f, "{joint}{name}")?;
                joint = "_";
            }
            if let Some(index) = index {
                write!(f, "{joint}{index}")?;
                joint = "_";
            }
        }
        Ok(())
    }
}

/// A scalar or an array of scalars of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// Its flat name.
    pub name: LeafName,
    /// SI unit, empty where there is none.
    pub unit: &'static str,
    /// Storage of one element; neither a message nor an option.
    pub kind: FieldKind,
    /// Number of elements, at least one.
    pub count: usize,
    /// Where its words begin in the message's.
    pub offset: usize,
}

impl Leaf {
    /// Number of words, all elements together.
    #[must_use]
    pub const fn size(&self) -> usize {
        self.count * self.kind.size()
    }

    /// The words of one element among the message's; `None` when there is no such element or its words are missing.
    #[must_use]
    pub fn words<'w>(&self, message: &'w [u32], element: usize) -> Option<&'w [u32]> {
        if element >= self.count {
            return None;
        }
        let size = self.kind.size();
        message.get(self.offset + element * size..)?.get(..size)
    }

    /// The value of one element; `None` when there is no such element or its words are missing.
    #[must_use]
    pub fn value(&self, message: &[u32], element: usize) -> Option<Value> {
        self.kind.value(self.words(message, element)?)
    }
}

/// A message, an option or an array of such that is being walked through.
#[derive(Clone, Copy, Debug)]
struct Node {
    name: &'static str,
    unit: &'static str,
    kind: FieldKind,
    count: usize,
    element: usize,
    /// Which part of the element comes next: a field of a message; the presence, then the value of an option.
    step: usize,
}

/// See [`leaves`].
#[derive(Clone, Debug)]
pub struct Leaves {
    stack: [Node; MAX_DEPTH],
    depth: usize,
    offset: usize,
}

/// The leaves of a schema, in word order.
///
/// ```
/// use stampfly_types::{Message, Vec3, leaves, message};
/// message! {
///     /// One turning wheel.
///     pub struct Wheel {
///         /// How fast.
///         rate: f32 ["rad/s"],
///     }
/// }
/// message! {
///     /// A cart.
///     pub struct Cart {
///         /// Where it is.
///         position: Vec3 ["m"],
///         /// What it weighs, if anybody has weighed it.
///         mass: Option<f32> ["kg"],
///         /// Left, right.
///         wheels: [Wheel; 2],
///     }
/// }
/// let cart = Cart { mass: Some(2.5), wheels: [Wheel { rate: 1.0 }, Wheel { rate: -1.0 }], ..Default::default() };
/// let words = cart.to_words();
/// let shown: Vec<_> = leaves(Cart::FIELDS)
///     .filter(|leaf| leaf.count == 1)
///     .map(|leaf| format!("{} = {} {}", leaf.name, leaf.value(&words, 0).unwrap(), leaf.unit))
///     .collect();
/// assert_eq!(shown, ["mass_present = true ", "mass = 2.5 kg", "wheels_0_rate = 1 rad/s", "wheels_1_rate = -1 rad/s"]);
/// ```
#[must_use]
pub const fn leaves(fields: &'static [FieldInfo]) -> Leaves {
    let message = Node { name: "", unit: "", kind: FieldKind::Message(fields), count: 1, element: 0, step: 0 };
    Leaves { stack: [message; MAX_DEPTH], depth: 1, offset: 0 }
}

impl Leaves {
    fn name(&self, field: &'static str) -> LeafName {
        let mut name = LeafName { parts: [("", None); MAX_DEPTH], length: 0 };
        // The first one is the message itself.
        for node in self.stack.iter().take(self.depth).skip(1) {
            name.push(node.name, (node.count > 1).then_some(node.element));
        }
        name.push(field, None);
        name
    }
}

impl Iterator for Leaves {
    type Item = Leaf;

    #[inline]
    fn next(&mut self) -> Option<Leaf> {
        loop {
            let node = self.stack.get_mut(self.depth.checked_sub(1)?)?;
            if node.element >= node.count {
                self.depth -= 1;
                continue;
            }
            let step = node.step;
            node.step += 1;
            let next = match node.kind {
                FieldKind::Message(fields) => {
                    fields.get(step).map(|info| (info.name, info.unit, info.kind, info.count))
                }
                FieldKind::Option { kind, count } => match step {
                    0 => Some(("present", "", FieldKind::Bool, 1)),
                    1 => Some(("", node.unit, *kind, count)),
                    _ => None,
                },
                _ => None,
            };
            let Some((name, unit, kind, count)) = next else {
                node.element += 1;
                node.step = 0;
                continue;
            };
            if matches!(kind, FieldKind::Message(_) | FieldKind::Option { .. })
                && let Some(place) = self.stack.get_mut(self.depth)
            {
                *place = Node { name, unit, kind, count, element: 0, step: 0 };
                self.depth += 1;
                continue;
            }
            let offset = self.offset;
            self.offset += count * kind.size();
            if count > 0 {
                return Some(Leaf { name: self.name(name), unit, kind, count, offset });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{FlightPhase, FlightStatus};
    use crate::{Message, Vec3, message};
    use proptest::prelude::*;
    use std::string::{String, ToString};
    use std::vec::Vec;

    message! {
        /// Inner.
        struct Point {
            /// Metres.
            place: Vec3 ["m"],
            /// Double.
            precise: f64 ["m"],
        }
    }

    message! {
        /// Middle.
        struct Leg {
            /// Maybe.
            end: Option<Point>,
            /// Signed.
            turns: i8,
        }
    }

    message! {
        /// Everything in everything.
        struct Route {
            /// Seconds.
            time: i64 ["us"],
            /// Messages in an array.
            legs: [Leg; 2],
            /// Options in an array.
            marks: [Option<u16>; 2] ["m"],
            /// Arrays in an option.
            limits: Option<[f32; 2]> ["m/s"],
            /// An option in an option.
            odd: Option<Option<bool>>,
            /// Nothing at all.
            nothing: [f32; 0],
            /// Long.
            code: [u8; 64],
        }
    }

    fn list(fields: &'static [FieldInfo]) -> Vec<(String, &'static str, usize, usize)> {
        leaves(fields).map(|leaf| (leaf.name.to_string(), leaf.unit, leaf.count, leaf.offset)).collect()
    }

    #[test]
    fn leaves_are_flat_and_in_word_order() {
        let leg = |leg: usize, first: usize| {
            [("end_present", "", 1, 0), ("end_place", "m", 3, 1), ("end_precise", "m", 1, 4), ("turns", "", 1, 6)]
                .map(|(name, unit, count, offset)| (std::format!("legs_{leg}_{name}"), unit, count, first + offset))
        };
        let after = [
            ("marks_0_present", "", 1, 16),
            ("marks_0", "m", 1, 17),
            ("marks_1_present", "", 1, 18),
            ("marks_1", "m", 1, 19),
            ("limits_present", "", 1, 20),
            ("limits", "m/s", 2, 21),
            ("odd_present", "", 1, 23),
            ("odd_present", "", 1, 24),
            ("odd", "", 1, 25),
            ("code", "", 64, 26),
        ];
        let mut expected = std::vec![("time".to_string(), "us", 1, 0)];
        expected.extend(leg(0, 2));
        expected.extend(leg(1, 9));
        expected.extend(after.map(|(name, unit, count, offset)| (name.to_string(), unit, count, offset)));
        assert_eq!(list(Route::FIELDS), expected);
    }

    #[test]
    fn leaves_cover_every_word_once() {
        fn check<M: Message>() {
            let mut next = 0;
            for leaf in leaves(M::FIELDS) {
                assert_eq!(leaf.offset, next, "{}: {}", M::NAME, leaf.name);
                assert!(leaf.name.to_string().contains(leaf.name.field()));
                next += leaf.size();
            }
            assert_eq!(next, M::WORDS, "{}", M::NAME);
            assert_eq!(M::FIELDS.iter().map(|field| field.words).sum::<usize>(), M::WORDS);
            assert_eq!(FieldKind::Message(M::FIELDS).size(), M::WORDS);
        }
        check::<Route>();
        check::<Leg>();
        check::<FlightStatus>();
    }

    #[test]
    fn values_speak() {
        let mode = FlightStatus { phase: FlightPhase::Flying, armed: true, ..Default::default() };
        let words = mode.to_words();
        let said: Vec<_> = leaves(FlightStatus::FIELDS).filter_map(|leaf| leaf.value(&words, 0)).collect();
        assert_eq!(said[0].to_string(), "Flying");
        assert_eq!((said[2], said[2].as_f64()), (Value::Bool(true), 1.0));
        let blocks = leaves(FlightStatus::FIELDS).nth(4).expect("blocks");
        let show = |bits| blocks.kind.value(&[bits]).map(|value| value.to_string());
        assert_eq!(show(0).as_deref(), Some("none"));
        assert_eq!(show(0b101).as_deref(), Some("CALIBRATING NO_BATTERY"));
        let phase = leaves(FlightStatus::FIELDS).next().expect("a phase");
        assert_eq!(phase.kind.value(&[99]).map(|value| value.to_string()).as_deref(), Some("99?"));
        assert_eq!(phase.value(&words, 1), None, "it is no array");
        assert_eq!(FieldKind::F64.value(&[0]), None, "half a number");
    }

    fn any_leg() -> impl Strategy<Value = Leg> {
        let point = (any::<[i16; 3]>(), any::<i32>());
        let point = point.prop_map(|(place, precise)| Point {
            place: Vec3::from(place.map(f32::from)),
            precise: f64::from(precise) / 3.0,
        });
        (prop::option::of(point), any::<i8>()).prop_map(|(end, turns)| Leg { end, turns })
    }

    proptest! {
        #[test]
        fn a_message_in_a_message_comes_back(
            (time, legs) in (any::<i64>(), [any_leg(), any_leg()]),
            marks: [Option<u16>; 2], limits: Option<[i8; 2]>, odd: Option<Option<bool>>, first: u8,
        ) {
            let limits = limits.map(|limits| limits.map(f32::from));
            let mut code = [7; 64];
            code[63] = first;
            let route = Route { time, legs, marks, limits, odd, nothing: [], code };
            let words = route.to_words();
            prop_assert_eq!(Route::from_words(&words), Some(route));
            let value = |name: &str| {
                leaves(Route::FIELDS).find(|leaf| leaf.name.to_string() == name).and_then(|leaf| leaf.value(&words, 0))
            };
            prop_assert_eq!(value("time"), Some(Value::Signed(time)));
            prop_assert_eq!(value("legs_1_turns"), Some(Value::Signed(legs[1].turns.into())));
            prop_assert_eq!(value("legs_0_end_precise"), Some(Value::F64(legs[0].end.map_or(0.0, |end| end.precise))));
            prop_assert_eq!(value("marks_1"), Some(Value::Unsigned(marks[1].unwrap_or_default().into())));
            prop_assert_eq!(value("limits_present"), Some(Value::Bool(limits.is_some())));
        }
    }
}
