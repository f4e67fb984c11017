//! Whole flights: in winds from anywhere, and with faults.

mod crashes;
mod envelope;
mod faults;
mod protection;
mod recorded;
mod winds;
