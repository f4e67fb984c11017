//! Mode machine, failsafe, take-off and landing.
#![no_std]
