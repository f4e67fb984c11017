//! The parameters of a vehicle that changes them by request: the other end of a
//! [`ParameterSet`](crate::ParameterSet).

use crate::{ParameterAction, ParameterError, ParameterInfo, ParameterRequest, ParameterTable, Parameters, parameters};
use heapless::Deque;

/// [`Parameters`] whose changes become [`ParameterRequest`]s, with room for `N` that wait.
///
/// A service reads and changes it by name or number. [`send`](Self::send) publishes the requests,
/// which the vehicle's [`ParameterSet`](crate::ParameterSet) takes at its next period;
/// [`adopt`](Self::adopt) takes over what it says is in use. A change is shown at once, as if the
/// vehicle had taken it. Without room for it, it fails with [`ParameterError::Busy`]; with as much
/// room as there are parameters, that does not happen.
///
/// Use it beside a service, when the vehicle runs elsewhere or its parameters have to be recorded
/// as topics. A service that owns the configuration changes it directly.
///
/// ```
/// use stampfly_param::types::Instant;
/// use stampfly_param::{ParameterSet, RequestedParameters, parameters};
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
/// let mut vehicle = ParameterSet::<Lamp>::default();
/// let mut lamp = RequestedParameters::<Lamp, 8>::new(Lamp::default());
/// parameters::set(&mut lamp, "light.level", 0.7)?;
/// // A queue between them, here a vector.
/// let mut queue = Vec::new();
/// lamp.send(|request| {
///     queue.push(request);
///     true
/// });
/// let (in_use, _) = vehicle.period(Instant::from_millis(10), true, queue).expect("news");
/// lamp.adopt(in_use);
/// assert_eq!(in_use.light.level, 0.7);
/// # Ok::<(), stampfly_param::ParameterError>(())
/// ```
#[derive(Clone, Debug)]
pub struct RequestedParameters<P, const N: usize> {
    values: P,
    waiting: Deque<ParameterRequest, N>,
    /// Values were sent and are still to be applied.
    sent: bool,
}

impl<P: ParameterTable, const N: usize> RequestedParameters<P, N> {
    /// Starts from the values in use.
    #[must_use]
    pub const fn new(values: P) -> Self {
        Self { values, waiting: Deque::new(), sent: false }
    }

    /// The values as they are shown: those in use, with the changes since.
    #[must_use]
    pub const fn values(&self) -> &P {
        &self.values
    }

    /// The vehicle says that these values are in use now.
    pub fn adopt(&mut self, values: P) {
        self.values = values;
    }

    /// Requests all of these values, as far as they differ from those shown.
    ///
    /// # Errors
    /// At the first that is out of range or has no room. Those before it are requested.
    pub fn set_all(&mut self, values: &P) -> Result<(), ParameterError> {
        for (index, (_, value)) in parameters::iter(values).enumerate() {
            if self.get(index) != Some(value) {
                self.set(index, value)?;
            }
        }
        Ok(())
    }

    /// Passes the requests to `publish`, and behind the last one that they be applied. When
    /// `publish` returns `false` because it has no room, the rest waits for the next call.
    pub fn send(&mut self, mut publish: impl FnMut(ParameterRequest) -> bool) {
        while let Some(request) = self.waiting.front() {
            if !publish(*request) {
                return;
            }
            self.waiting.pop_front();
            self.sent = true;
        }
        if self.sent {
            let apply = ParameterRequest { action: ParameterAction::Apply, ..ParameterRequest::default() };
            self.sent = !publish(apply);
        }
    }
}

impl<P: ParameterTable, const N: usize> Parameters for RequestedParameters<P, N> {
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
        self.values.describe(index)
    }

    fn get(&self, index: usize) -> Option<f32> {
        self.values.get(index)
    }

    fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError> {
        let before = self.get(index).ok_or(ParameterError::Unknown)?;
        self.values.set(index, value)?;
        let request = ParameterRequest { action: ParameterAction::Set, index: index as u32, value };
        // A newer value of the same parameter needs no room.
        let has_room = match self.waiting.iter_mut().find(|waiting| waiting.index == request.index) {
            Some(waiting) => {
                *waiting = request;
                true
            }
            None => self.waiting.push_back(request).is_ok(),
        };
        if has_room {
            return Ok(());
        }
        self.values.set(index, before)?;
        Err(ParameterError::Busy)
    }

    fn check(&self, about: Option<usize>) -> Result<(), ParameterError> {
        self.values.check(about)
    }
}
