//! What the program does, flown and typed. One binary, because each would build the whole flight stack again:
//! `cargo test -p stampfly-host --test host replay` runs one file.

mod black_box;
mod calibrate;
mod cameras;
mod chips;
mod command_line;
mod connect;
mod connect_radio;
mod controllers;
mod determinism;
mod doctor;
mod estimate;
mod fault_campaign;
mod faults;
mod figures;
mod flight_task;
mod flips;
mod flying_quality;
mod ground;
mod held;
mod hil;
mod impact;
mod in_flight;
mod live_parameters;
mod log_tools;
mod losses;
mod made_up;
mod missions;
mod plane;
mod program;
mod record;
mod record_by_radio;
mod reference;
mod replay;
mod report;
mod rover;
mod safety_mode;
mod safety_sensors;
mod stm32_quad;
mod swap;
mod tunes;

/// How many flights of each kind somebody wants who has more time: the variable `FLIGHTS`.
fn flights() -> Option<u64> {
    std::env::var("FLIGHTS").ok().map(|text| text.parse().expect("FLIGHTS is a number"))
}
