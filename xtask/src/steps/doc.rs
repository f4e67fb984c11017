//! `doc`: broken links and malformed documentation are errors, with all features, as documentation sites build it.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let mut doc = repository.cargo();
    doc.env("RUSTDOCFLAGS", "-D warnings").args(["doc", "--no-deps", "--quiet", "--all-features"]);
    for library in repository.libraries()? {
        doc.args(["-p", &library.name]);
    }
    run_program(&mut doc)
}
