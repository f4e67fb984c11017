//! No motor turns without a decision to arm.
//!
//! An output that says "armed" is not such a decision: it may be the first thing a driver hears, after a restart in the
//! middle of a flight or from a program that never disarmed. The decision is the *edge*, an armed output after one that
//! was not, and only the [`Interlock`] makes an [`ArmToken`] of it. Whoever implements
//! [`MotorOutputs`](crate::MotorOutputs) keeps an interlock, and lets the function that sets duty cycles take a token.
//! Not the arming logic itself (who may arm, and when), which is decided long before.

use core::marker::PhantomData;
use stampfly_types::messages::MotorOutput;

/// Watches the outputs and gives tokens.
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
    /// A disarmed output has been seen.
    open: bool,
}

/// The permission to turn motors with this one output.
///
/// It borrows from the interlock, so it cannot be kept for the next output.
#[derive(Debug)]
pub struct ArmToken<'i> {
    decision: PhantomData<&'i mut Interlock>,
}

impl Interlock {
    /// A token when the vehicle is armed and was seen disarmed before.
    pub const fn token(&mut self, output: &MotorOutput) -> Option<ArmToken<'_>> {
        if !output.armed {
            self.open = true;
            return None;
        }
        if self.open { Some(ArmToken { decision: PhantomData }) } else { None }
    }

    /// Forgets: no token until the vehicle has been disarmed again.
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
