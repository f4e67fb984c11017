//! Parameters of a vehicle that takes requests: what a service reads and changes by number or name becomes
//! [`ParameterRequest`]s for the topic that the vehicle reads them from.
//!
//! Use it beside a service of a vehicle whose parameters are a [`ParameterTable`]. Vehicles whose configuration is a struct implement
//! [`Parameters`] on it.

use heapless::Vec;
use stampfly_param::{ParameterAction, ParameterError, ParameterInfo, ParameterRequest, ParameterTable, Parameters};

/// Values as the service sees them, and what it has asked to change.
///
/// ```
/// use stampfly_param::parameters;
/// use stampfly_param::ParameterAction;
/// use stampfly_services::Requested;
/// stampfly_param::parameters! {
///     /// A lamp.
///     pub struct Lamp {
///         /// Light.
///         light: Light {
///             /// Brightness.
///             level = 0.5 in [0.0, 1.0] "1";
///         }
///     }
/// }
/// # fn main() {
/// let mut lamp = Requested::<Lamp, 8>::new(Lamp::default());
/// parameters::set(&mut lamp, "light.level", 0.7).unwrap();
/// let asked: Vec<_> = lamp.take().map(|request| request.action).collect();
/// assert_eq!(asked, [ParameterAction::Set, ParameterAction::Apply]);
/// assert_eq!(lamp.take().count(), 0);
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Requested<P, const N: usize> {
    values: P,
    asked: Vec<ParameterRequest, N>,
}

impl<P: ParameterTable, const N: usize> Requested<P, N> {
    /// These values are in use.
    #[must_use]
    pub const fn new(values: P) -> Self {
        Self { values, asked: Vec::new() }
    }

    /// The values as the service sees them.
    #[must_use]
    pub const fn values(&self) -> &P {
        &self.values
    }

    /// Other values are in use now, whoever has changed them.
    pub fn adopt(&mut self, values: P) {
        self.values = values;
    }

    /// Asks for all of these values.
    ///
    /// # Errors
    /// When one is out of range, or there are too many at once.
    pub fn set_all(&mut self, values: &P) -> Result<(), ParameterError> {
        P::TABLE.iter().enumerate().try_for_each(|(index, row)| self.set(index, row.get(values)))
    }

    /// What was asked for since the last call, and at its end that it is applied.
    pub fn take(&mut self) -> impl Iterator<Item = ParameterRequest> + use<P, N> {
        let asked = core::mem::take(&mut self.asked);
        let apply = ParameterRequest { action: ParameterAction::Apply, ..ParameterRequest::default() };
        let apply = (!asked.is_empty()).then_some(apply);
        asked.into_iter().chain(apply)
    }
}

impl<P: ParameterTable, const N: usize> Parameters for Requested<P, N> {
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
        P::TABLE.get(index).map(|row| row.info)
    }

    fn get(&self, index: usize) -> Option<f32> {
        P::TABLE.get(index).map(|row| row.get(&self.values))
    }

    fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError> {
        let row = P::TABLE.get(index).ok_or(ParameterError::Unknown)?;
        let refused = ParameterError::OutOfRange { min: row.info.min, max: row.info.max };
        row.set(&mut self.values, value)?;
        let request = ParameterRequest { action: ParameterAction::Set, index: index as u32, value };
        // What there is no room for is not asked for.
        self.asked.push(request).map_err(|_| refused)
    }

    fn check(&self, about: Option<usize>) -> Result<(), ParameterError> {
        self.values.check(about)
    }
}
