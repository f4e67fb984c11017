//! The StampFly assembled.
//!
//! Two tables say it all: [`wiring`], who publishes what for whom, and [`plan`], who runs when. The rest is adapters:
//! one [runnable](runnables) a component, about as long as the component has inputs, and the
//! [assembly](vehicle::assemble) that hands every end of every topic to its owner.
//!
//! Firmware and simulation run this same code; they differ in who drives the [`FlightLoop`] and in what stands behind
//! the traits of `stampfly-drivers`.
#![no_std]
#![cfg_attr(doctest, doc = include_str!("../README.md"))]

#[cfg(test)]
extern crate std;

mod activation_table;
pub mod black_box;
mod config;
pub mod console;
pub mod devices;
mod flight_loop;
pub mod golden;
pub mod messages;
pub mod parameters;
pub mod profile;
pub mod runnables;
pub mod tasks;
mod topic_table;
pub mod vehicle;

pub use activation_table::plan;
pub use config::VehicleConfig;
pub use flight_loop::{FlightLoop, Observer, Pending};
pub use topic_table::wiring;
