//! Messages without an acknowledgement that this vehicle does not obey. A text says so, for
//! programs would wait for ever.
//!
//! Programs send set-points and sticks many times a second: each client is told once in ten seconds
//! of each.

use super::client::{Client, Put};
use core::fmt::{self, Write};
use heapless::String;
use stampfly_link::mavlink::dialects::common::MavSeverity;

/// A kind is told again after this long, s.
const AGAIN: u16 = 10;

/// A kind of message that is not obeyed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unserved {
    /// To fly to a place, at a velocity, or with an acceleration.
    Target,
    Attitude,
    Override,
    Sticks,
    Mode,
    Parameter,
    /// What was held up on its way.
    Late,
}

/// Kinds that there are.
const KINDS: usize = Unserved::Late as usize + 1;

impl Unserved {
    const fn name(self) -> &'static str {
        match self {
            Self::Target => "set-point not flown",
            Self::Attitude => "attitude not flown",
            Self::Override => "RC override not flown",
            Self::Sticks => "sticks not flown",
            Self::Mode => "mode not set",
            Self::Parameter => "no such parameter",
            Self::Late => "expired, not done",
        }
    }
}

/// When a client was told of each kind: the second, from one; zero for never.
#[derive(Clone, Copy, Debug)]
pub(super) struct Told([u16; KINDS]);

impl Told {
    pub const NEVER: Self = Self([0; KINDS]);

    /// May it be told of this in this second?
    fn may_be(&mut self, second: u64, about: Unserved) -> bool {
        let Some(told) = self.0.get_mut(about as usize) else { return false };
        // Where this wraps around, after eighteen hours, ten seconds are nine.
        let second = (second % u64::from(u16::MAX)) as u16 + 1;
        let may = *told == 0 || second.wrapping_sub(*told) >= AGAIN;
        if may {
            *told = second;
        }
        may
    }
}

impl<C> Client<C> {
    /// Says that something is not done and why, unless that was said just now.
    // By itself: its room for a sentence is on the stack once.
    #[inline(never)]
    pub fn complain(&mut self, about: Unserved, why: &dyn fmt::Display, put: Put<'_, C>) {
        let second = self.second();
        if !self.told_of.may_be(second, about) {
            return;
        }
        let mut sentence = String::<96>::new();
        // A sentence that is too long is cut.
        _ = write!(sentence, "{}: {why}", about.name());
        self.say(MavSeverity::MAV_SEVERITY_WARNING, &sentence, put);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_told_once_in_ten_seconds_for_ever() {
        let mut told = Told::NEVER;
        let mut times = 0;
        for second in 0..200_000 {
            times += u32::from(told.may_be(second, Unserved::Mode));
        }
        assert!((19_999..=20_001).contains(&times), "{times}");
        assert!(told.may_be(199_999, Unserved::Parameter), "another kind");
        assert!(!told.may_be(199_999, Unserved::Parameter));
    }
}
