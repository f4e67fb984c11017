//! Keeps the motors off until a disarmed vehicle has been armed.
//!
//! An output with `armed: true` alone does not show that the vehicle has just been armed: it may be
//! the first output after a restart in flight, or come from a program that never disarms. Arming is
//! the *edge*: an armed output after one that was not armed. Only [`Interlock`] turns that edge
//! into an [`ArmToken`]. An implementation of [`MotorOutputs`](crate::MotorOutputs) keeps an
//! interlock, and its function that computes duty cycles takes a token.
//!
//! Not the arming logic itself, which checks who may arm and when; that is part of the mode
//! machine.

use core::marker::PhantomData;
use stampfly_types::messages::MotorOutput;

/// Checks each output and issues tokens.
///
/// ```
/// use stampfly_driver_core::Interlock;
/// use stampfly_types::messages::MotorOutput;
///
/// let (disarmed, armed) = (MotorOutput::default(), MotorOutput { armed: true, ..Default::default() });
/// let mut interlock = Interlock::default();
/// assert!(interlock.token(&armed).is_none(), "armed from the first moment: nobody decided that");
/// assert!(interlock.token(&disarmed).is_none());
/// assert!(interlock.token(&armed).is_some());
/// assert!(interlock.token(&armed).is_some(), "as long as it lasts");
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Interlock {
    /// An output that was not armed has been seen since the start or since
    /// [`lock`](Interlock::lock).
    open: bool,
}

/// Permission to turn the motors for one output.
///
/// It borrows the interlock, so it cannot be kept for the next output.
#[derive(Debug)]
pub struct ArmToken<'i> {
    decision: PhantomData<&'i mut Interlock>,
}

impl Interlock {
    /// A token when this output is armed and an earlier one was not.
    pub const fn token(&mut self, output: &MotorOutput) -> Option<ArmToken<'_>> {
        if !output.armed {
            self.open = true;
            return None;
        }
        if self.open { Some(ArmToken { decision: PhantomData }) } else { None }
    }

    /// Withholds tokens until an output that is not armed has been seen.
    pub const fn lock(&mut self) {
        self.open = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_takes_an_edge_and_a_lock_takes_another() {
        let output = |armed| MotorOutput { armed, ..Default::default() };
        let mut interlock = Interlock::default();
        let mut given = |armed| interlock.token(&output(armed)).is_some();
        assert_eq!([true, true, false, false, true, true, false, true].map(&mut given), {
            [false, false, false, false, true, true, false, true]
        });
        interlock.lock();
        let mut given = |armed| interlock.token(&output(armed)).is_some();
        assert_eq!([true, true, false, true].map(&mut given), [false, false, false, true]);
    }
}
