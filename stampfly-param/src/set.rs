//! Changing the parameters of a running vehicle: collect, validate, apply at the next period, roll
//! back.
//!
//! Requests change a candidate. `Apply` validates it as a whole, and the next period uses it. The
//! previous set is kept: `RollBack` returns to it, and so does a fault within the probation after a
//! change. Only the last change can be rolled back; a second `RollBack` undoes the first.
//!
//! Use it for parameters that may change while the vehicle moves. What needs a vehicle at rest is
//! saved and applies after a restart.

use crate::{ParameterError, ParameterTable, Parameters, parameters};
use stampfly_types::{Duration, Instant, message, message_enum};

message_enum! {
    /// What to do with the parameters.
    pub enum ParameterAction {
        /// Change one value of the candidate.
        #[default]
        Set = 0,
        /// Validate the candidate and use it from the next period on.
        Apply = 1,
        /// Go back to the set before the last change.
        RollBack = 2,
    }
}

message! {
    /// One step of a change of parameters.
    pub struct ParameterRequest {
        /// What to do.
        action: ParameterAction,
        /// For `Set`: the parameter's place in [`ParameterTable::TABLE`].
        index: u32,
        /// For `Set`: the value, in the parameter's unit.
        value: f32 ["SI"],
    }
}

message! {
    /// Which parameters are in use.
    pub struct ParameterStatus {
        /// Number of changes that took effect, roll-backs included.
        version: u32,
        /// When the last one did.
        applied_at: Instant ["us"],
        /// Number of requests refused.
        refused: u32,
    }
}

/// The parameters in use, the ones before, and the candidate.
///
/// ```
/// use stampfly_param::{ParameterSet, parameters};
/// use stampfly_param::types::{Duration, Instant};
///
/// parameters! {
///     /// A lamp.
///     pub struct Lamp {
///         /// Light.
///         light: Light {
///             /// Brightness.
///             level = 0.5 in [0.0, 1.0] "1";
///         }
///     }
/// }
///
/// let mut set = ParameterSet::new(Lamp::default(), Duration::from_secs(1))?;
/// set.set(0, 0.8)?;
/// set.apply()?;
/// assert_eq!(set.step(Instant::from_millis(10), true).light.level, 0.8);
/// assert_eq!(set.step(Instant::from_millis(20), false).light.level, 0.5, "a fault rolls the change back");
/// # Ok::<(), stampfly_param::ParameterError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ParameterSet<P> {
    active: P,
    previous: P,
    candidate: P,
    pending: bool,
    on_probation: bool,
    probation: Duration,
    status: ParameterStatus,
    /// The status that [`period`](Self::period) returned last.
    told: Option<ParameterStatus>,
}

/// The values of the table, without probation.
impl<P: ParameterTable + Copy + Default> Default for ParameterSet<P> {
    fn default() -> Self {
        Self::holding(P::default(), Duration::ZERO)
    }
}

impl<P: ParameterTable + Copy> ParameterSet<P> {
    /// A set that starts with these values. A fault within `probation` after a change rolls it
    /// back.
    ///
    /// # Errors
    /// When the values are not [valid](parameters::validate).
    pub fn new(parameters: P, probation: Duration) -> Result<Self, ParameterError> {
        parameters::validate(&parameters)?;
        Ok(Self::holding(parameters, probation))
    }

    fn holding(parameters: P, probation: Duration) -> Self {
        let [active, previous, candidate] = [parameters; 3];
        let status = ParameterStatus::default();
        Self { active, previous, candidate, pending: false, on_probation: false, probation, status, told: None }
    }

    /// Changes one value of the candidate.
    ///
    /// # Errors
    /// When there is no such parameter, or the value is out of range.
    pub fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError> {
        self.candidate.set(index, value)
    }

    /// Changes the candidate, and applies it at once.
    ///
    /// # Errors
    /// As [`apply`](Self::apply).
    pub fn change(&mut self, change: impl FnOnce(&mut P)) -> Result<(), ParameterError> {
        change(&mut self.candidate);
        self.apply()
    }

    /// Validates the candidate; the next [`step`](Self::step) uses it.
    ///
    /// # Errors
    /// When the candidate is not valid. It then starts again from the set in use.
    pub fn apply(&mut self) -> Result<(), ParameterError> {
        let verdict = parameters::validate(&self.candidate);
        match verdict {
            Ok(()) => self.pending = true,
            Err(_) => self.candidate = self.active,
        }
        verdict
    }

    /// The next [`step`](Self::step) uses the set before the last change.
    pub fn roll_back(&mut self) {
        self.candidate = self.previous;
        self.pending = true;
    }

    /// Does what a request asks for. A refusal is counted in the [`status`](Self::status).
    ///
    /// # Errors
    /// As [`set`](Self::set) and [`apply`](Self::apply).
    pub fn request(&mut self, request: &ParameterRequest) -> Result<(), ParameterError> {
        let outcome = match request.action {
            ParameterAction::Set => usize::try_from(request.index)
                .map_err(|_| ParameterError::Unknown)
                .and_then(|index| self.set(index, request.value)),
            ParameterAction::Apply => self.apply(),
            ParameterAction::RollBack => {
                self.roll_back();
                Ok(())
            }
        };
        self.status.refused = self.status.refused.saturating_add(u32::from(outcome.is_err()));
        outcome
    }

    /// Start of a period: the parameters to use in it. `healthy`: no fault was found in the period
    /// before.
    pub fn step(&mut self, now: Instant, healthy: bool) -> P {
        self.on_probation &= now.since(self.status.applied_at) <= self.probation;
        let failed = self.on_probation && !healthy;
        if failed {
            self.roll_back();
        }
        if core::mem::take(&mut self.pending) {
            self.previous = core::mem::replace(&mut self.active, self.candidate);
            // The set before the change has run without the fault: it is not on probation.
            self.on_probation = !failed;
            self.status.version = self.status.version.saturating_add(1);
            self.status.applied_at = now;
        }
        self.active
    }

    /// A whole period: handles these requests, [steps](Self::step), and returns the parameters in
    /// use with their status, if the status has changed since the last call.
    ///
    /// ```
    /// # stampfly_param::parameters! {
    /// #     /// A lamp.
    /// #     pub struct Lamp {
    /// #         /// Light.
    /// #         light: Light {
    /// #             /// Brightness.
    /// #             level = 0.5 in [0.0, 1.0] "1";
    /// #         }
    /// #     }
    /// # }
    /// use stampfly_param::{ParameterAction, ParameterRequest, ParameterSet};
    /// use stampfly_param::types::Instant;
    /// let mut set = ParameterSet::<Lamp>::default();
    /// assert!(set.period(Instant::from_millis(10), true, []).is_some(), "the first time");
    /// assert_eq!(set.period(Instant::from_millis(20), true, []), None);
    /// let wild = ParameterRequest { index: 0, value: 7.0, ..ParameterRequest::default() };
    /// let (in_use, status) = set.period(Instant::from_millis(30), true, [wild]).unwrap();
    /// assert_eq!((in_use.light.level, status.refused), (0.5, 1));
    /// ```
    pub fn period(
        &mut self,
        now: Instant,
        healthy: bool,
        requests: impl IntoIterator<Item = ParameterRequest>,
    ) -> Option<(P, ParameterStatus)> {
        for request in requests {
            // A refusal is in the status.
            let _ = self.request(&request);
        }
        let in_use = self.step(now, healthy);
        (self.told.replace(self.status) != Some(self.status)).then_some((in_use, self.status))
    }

    /// Version, time of the last change, requests refused.
    #[must_use]
    pub fn status(&self) -> ParameterStatus {
        self.status
    }
}
