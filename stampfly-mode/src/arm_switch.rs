//! The pilot's arm switch: what turning it means, and when it means nothing.
//!
//! A switch arms only when it was seen off before: one that is on at power-on, or that was turned on while nobody was heard,
//! has to be turned off first. For the [mode machine](crate::machine); whether the vehicle may be armed at all says
//! [`arming`](crate::arming).

use stampfly_types::messages::PilotInput;

/// The switch as it was in the pilot's last frame; `None` until it has been seen off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ArmSwitch(Option<bool>);

/// What the switch did in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Switched {
    /// From off to on.
    pub rises: bool,
    /// From on to off.
    pub falls: bool,
    /// It is on and was not seen off before.
    pub is_stale: bool,
}

impl ArmSwitch {
    /// Looks at the pilot's newest frame, if there is a fresh one.
    pub fn step(&mut self, pilot: Option<&PilotInput>, armed: bool) -> Switched {
        let Some(pilot) = pilot else {
            // Whatever the switch does meanwhile, nobody sees it: it has to be seen off again before it arms.
            if !armed {
                self.forget();
            }
            return Switched::default();
        };
        let before = self.0;
        if before.is_some() || !pilot.arm {
            self.0 = Some(pilot.arm);
        }
        Switched {
            rises: before == Some(false) && pilot.arm,
            falls: before == Some(true) && !pilot.arm,
            is_stale: before.is_none() && pilot.arm,
        }
    }

    /// It has to be seen off again.
    pub fn forget(&mut self) {
        self.0 = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What each frame does, `None` for silence.
    fn switched<const N: usize>(frames: [Option<bool>; N], armed: bool) -> [Switched; N] {
        let mut switch = ArmSwitch::default();
        frames.map(|arm| switch.step(arm.map(|arm| PilotInput { arm, ..PilotInput::default() }).as_ref(), armed))
    }

    #[test]
    fn a_switch_rises_only_after_it_was_seen_off() {
        let nothing = Switched::default();
        let stale = Switched { is_stale: true, ..nothing };
        let [rises, falls] = [Switched { rises: true, ..nothing }, Switched { falls: true, ..nothing }];
        let [on, off] = [Some(true), Some(false)];
        assert_eq!(switched([on, on, off, on, off], false), [stale, stale, nothing, rises, falls]);
        assert_eq!(switched([off, None, on], false), [nothing, nothing, stale], "turned while nobody was heard");
        assert_eq!(switched([off, on, None, off], true), [nothing, rises, nothing, falls], "it still disarms");
    }
}
