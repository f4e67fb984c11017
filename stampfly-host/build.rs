//! Says at compile time whether the recorded data are there, so that tests which need them show as ignored, with
//! the reason, where they are not.

use std::env;
use std::path::Path;

fn main() {
    println!("cargo::rustc-check-cfg=cfg(recorded_data)");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=STAMPFLY_DATA");
    // A build script runs in the folder of its package; the data lie beside the workspace.
    let folder = env::var("STAMPFLY_DATA").unwrap_or_else(|_| "../../shared/data".to_owned());
    match Path::new(&folder).canonicalize() {
        Ok(folder) => {
            println!("cargo::rerun-if-changed={}", folder.display());
            println!("cargo::rustc-env=STAMPFLY_DATA_FOLDER={}", folder.display());
            println!("cargo::rustc-cfg=recorded_data");
        }
        Err(_) => println!("cargo::rustc-env=STAMPFLY_DATA_FOLDER={folder}"),
    }
}
