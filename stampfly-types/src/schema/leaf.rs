//! The leaves of a schema: its scalars and arrays of scalars, in word order, each with a flat name.
//!
//! Use [`leaves`] wherever words are shown to people or tools: in a log, a console, a plot. It is
//! the only code that walks the tree of a schema.

use super::{FieldInfo, FieldKind, MAX_DEPTH, Value};
use core::fmt;

/// The flat name of a leaf: the names of its enclosing fields and its own, joined by underscores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LeafName {
    /// Name, and index in an array of messages or options.
    parts: [(&'static str, Option<usize>); MAX_DEPTH],
    length: usize,
}

impl LeafName {
    /// Name of the innermost named field.
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

/// A scalar of a message, or an array of scalars.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// Flat name.
    pub name: LeafName,
    /// SI unit, empty for dimensionless fields.
    pub unit: &'static str,
    /// Storage of one element; neither a message nor an option.
    pub kind: FieldKind,
    /// Number of elements, at least one.
    pub count: usize,
    /// Index of its first word in the message.
    pub offset: usize,
}

impl Leaf {
    /// Number of words of all elements together.
    #[must_use]
    pub const fn size(&self) -> usize {
        self.count * self.kind.size()
    }

    /// The words of one element, from the words of the message. `None` when there is no such
    /// element or words are missing.
    #[must_use]
    pub fn words<'w>(&self, message: &'w [u32], element: usize) -> Option<&'w [u32]> {
        if element >= self.count {
            return None;
        }
        let size = self.kind.size();
        message.get(self.offset + element * size..)?.get(..size)
    }

    /// The value of one element. `None` when there is no such element or words are missing.
    #[must_use]
    pub fn value(&self, message: &[u32], element: usize) -> Option<Value> {
        self.kind.value(self.words(message, element)?)
    }
}

/// A message, an option or an array of these on the current path through the tree.
#[derive(Clone, Copy, Debug)]
struct Node {
    name: &'static str,
    unit: &'static str,
    kind: FieldKind,
    count: usize,
    element: usize,
    /// Next part of the element: a field of a message; the presence, then the value of an option.
    step: usize,
}

/// Iterator returned by [`leaves`].
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
///     /// Its mass, when known.
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
        // The first node is the message itself, which has no name.
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
            // All elements of this node are done: return to the enclosing one.
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
            // `checked` bounds the depth, so a nested node always has a place on the stack.
            if matches!(kind, FieldKind::Message(_) | FieldKind::Option { .. })
                && let Some(place) = self.stack.get_mut(self.depth)
            {
                *place = Node { name, unit, kind, count, element: 0, step: 0 };
                self.depth += 1;
                continue;
            }
            let offset = self.offset;
            self.offset += count * kind.size();
            // An array of length zero has no words and therefore no leaf.
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
        let blocks = leaves(FlightStatus::FIELDS).nth(5).expect("blocks");
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
