//! The program `stampfly`: flies the flight stack on a PC.

fn main() -> std::process::ExitCode {
    stampfly_host::command_line::run()
}
