//! The linked firmware boots on an emulated Cortex-M4F: `vehicles/stm32-quad/stm32f303/boot`.
//!
//! Unicorn has the processor, the scripts there have what of the chip the program touches.

use crate::repository::{Failure, Repository, python_tool, run as run_program};
use std::path::Path;

const SCRIPT: &str = "vehicles/stm32-quad/stm32f303/boot/boot.py";
const UNICORN: &str = "unicorn==2.1.4";

pub fn boot(repository: &Repository, program: &Path) -> Result<(), Failure> {
    let mut python = python_tool(repository, UNICORN, "python")?;
    python.env("PYTHONDONTWRITEBYTECODE", "1").arg(repository.root.join(SCRIPT)).arg(program);
    run_program(&mut python)
}
