//! Says at compile time whether the recorded data are there, so that tests which need them show as ignored, with
//! the reason, where they are not.

use std::env;
use std::path::{Path, absolute};

fn main() {
    println!("cargo::rustc-check-cfg=cfg(recorded_data)");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=STAMPFLY_DATA");
    // Relative to the repository, as `cargo xtask` reads it; a build script runs in the folder of its package.
    let folder = Path::new("../..").join(env::var("STAMPFLY_DATA").unwrap_or_else(|_| "../shared/data".to_owned()));
    // The canonical path begins with `\\?\` on Windows; a `/` in what is joined to it is then no
    // separator.
    match absolute(&folder) {
        Ok(folder) if folder.is_dir() => {
            println!("cargo::rerun-if-changed={}", folder.display());
            println!("cargo::rustc-env=STAMPFLY_DATA_FOLDER={}", folder.display());
            println!("cargo::rustc-cfg=recorded_data");
        }
        _ => println!("cargo::rustc-env=STAMPFLY_DATA_FOLDER={}", folder.display()),
    }
}
