//! Filters, gains, navigator, and controllers that fly. One binary, because each would link the controllers again:
//! `cargo test -p stampfly-control --test control navigator` runs one file.

mod autotune;
mod filter_vectors;
mod fleet;
mod flight;
mod gains;
mod navigator;
mod take_off;
