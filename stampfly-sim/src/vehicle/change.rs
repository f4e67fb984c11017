//! Changes the parameters of a vehicle in flight, keeping its state.
//!
//! For tools that compare variants: the simulator flies up to an instant with one set of parameters
//! and continues with another. States are kept: attitude, biases, integrators, phases. A value held
//! by a runnable counts as configuration if the runnables made from the old and the new
//! configuration differ in it and the flying vehicle still has the old value; it then gets the new
//! value. A value that has changed since power-on counts as state.
//!
//! Not for flight code: the full state is serialised. On a vehicle use its parameter requests.

use super::Witness;
use ciborium::Value;
use core::fmt;
use serde::{Serialize, de::DeserializeOwned};
use stampfly_bus::Schedule;
use stampfly_flight::{FlightLoop, Observer};
use stampfly_types::Instant;

/// Why the parameters of a flying vehicle were not changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ChangeError {
    /// The parameter selects a component, which would start without state: the serialised runnables
    /// have another structure, or the [vehicle](super::Vehicle::has_same_components) reports it.
    OtherComponents,
    /// The parameter acts only at power-on: nothing in flight depends on it.
    NothingDepends,
    /// The runnables cannot be serialised and restored.
    NotSerialisable,
}

impl fmt::Display for ChangeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OtherComponents => "it chooses a component, which cannot begin in flight; change it from 0 on",
            Self::NothingDepends => "nothing in flight depends on it; change it from 0 on",
            Self::NotSerialisable => "the state of this vehicle cannot be written down",
        })
    }
}

impl std::error::Error for ChangeError {}

/// Returns the runnables with the parameters of `new` instead of `old`, and their states. If both
/// are equal, the result equals `flying` bit for bit.
///
/// # Errors
/// If the change cannot be made in flight.
pub fn carry_over<R: Schedule + Serialize + DeserializeOwned>(
    flying: &R,
    old: &R::Config,
    new: &R::Config,
) -> Result<R, ChangeError> {
    // Comparing serialised trees needs no knowledge of the runnables' fields.
    let value = |runnables: &R| Value::serialized(runnables).map_err(|_| ChangeError::NotSerialisable);
    let (mut tree, old, new) = (value(flying)?, value(&R::new(old))?, value(&R::new(new))?);
    if patch(&mut tree, &old, &new)? == 0 && !same(&old, &new) {
        return Err(ChangeError::NothingDepends);
    }
    tree.deserialized().map_err(|_| ChangeError::NotSerialisable)
}

/// Replaces configuration values in `flying`; returns how many were replaced.
fn patch(flying: &mut Value, old: &Value, new: &Value) -> Result<usize, ChangeError> {
    if same(old, new) {
        return Ok(0);
    }
    match (old, new) {
        (Value::Array(olds), Value::Array(news)) if olds.len() == news.len() => {
            // A list whose length has changed since power-on is a state.
            let Value::Array(parts) = flying else { return Ok(0) };
            if parts.len() != olds.len() {
                return Ok(0);
            }
            parts.iter_mut().zip(olds.iter().zip(news)).map(|(part, (old, new))| patch(part, old, new)).sum()
        }
        (Value::Map(olds), Value::Map(news)) if keys(olds).eq(keys(news)) => {
            let Value::Map(parts) = flying else { return Ok(0) };
            if !keys(parts).eq(keys(olds)) {
                return Ok(0);
            }
            parts
                .iter_mut()
                .zip(olds.iter().zip(news))
                .map(|(part, (old, new))| patch(&mut part.1, &old.1, &new.1))
                .sum()
        }
        (Value::Array(_) | Value::Map(_), _) | (_, Value::Array(_) | Value::Map(_)) => {
            Err(ChangeError::OtherComponents)
        }
        _ if same(flying, old) => {
            *flying = new.clone();
            Ok(1)
        }
        _ => Ok(0),
    }
}

fn keys(map: &[(Value, Value)]) -> impl Iterator<Item = &Value> {
    map.iter().map(|(key, _)| key)
}

/// Equality bit for bit, so that NaN equals itself.
fn same(one: &Value, other: &Value) -> bool {
    match (one, other) {
        (Value::Float(one), Value::Float(other)) => one.to_bits() == other.to_bits(),
        (Value::Array(one), Value::Array(other)) => {
            one.len() == other.len() && one.iter().zip(other).all(|(one, other)| same(one, other))
        }
        (Value::Map(one), Value::Map(other)) => {
            one.len() == other.len() && one.iter().zip(other).all(|(a, b)| a.0 == b.0 && same(&a.1, &b.1))
        }
        _ => one == other,
    }
}

/// Changes the configuration of a flying vehicle at an instant. It is a [`Witness`]: pair it with a
/// recorder.
pub struct Change<R: Schedule> {
    at: Instant,
    old: R::Config,
    new: R::Config,
    made: Option<Result<Instant, ChangeError>>,
}

impl<R: Schedule> Change<R> {
    /// Replaces `old` by `new` at the first turn at or after `at` in which no activation is
    /// pending.
    #[must_use]
    pub fn new(at: Instant, old: R::Config, new: R::Config) -> Self {
        Self { at, old, new, made: None }
    }

    /// The instant of the change or the reason for failure; `None` if the flight ended before.
    #[must_use]
    pub const fn made(&self) -> Option<Result<Instant, ChangeError>> {
        self.made
    }
}

impl<R: Schedule> Observer for Change<R> {}

impl<R: Schedule + Serialize + DeserializeOwned> Witness<R> for Change<R> {
    fn at_rest(&mut self, clock: Instant, flight_loop: &mut FlightLoop<'_, R>) {
        if clock < self.at || self.made.is_some() {
            return;
        }
        let changed = carry_over(flight_loop.runnables(), &self.old, &self.new);
        self.made = Some(changed.map(|runnables| {
            flight_loop.set_runnables(runnables);
            clock
        }));
    }
}
