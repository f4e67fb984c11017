//! Whole flights: in winds from anywhere, and with faults.

mod faults;
mod recorded;
mod winds;
