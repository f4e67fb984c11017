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
mod doors;
mod doorstep;
mod estimate;
mod every_file;
mod fault_campaign;
mod faults;
mod figures;
mod files;
mod flight_task;
mod flips;
mod flown;
mod flying_quality;
#[path = "../../../stampfly-lab/tests/lab/foreign_log.rs"]
mod foreign_log;
mod ground;
mod held;
mod hil;
mod impact;
mod in_flight;
mod late;
mod leaves;
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
mod relay;
mod replay;
mod report;
mod rover;
mod safety_mode;
mod safety_sensors;
mod same_number;
mod set_points;
mod stm32_quad;
#[cfg(unix)]
mod stopped;
mod swap;
mod thorough;
mod tunes;
