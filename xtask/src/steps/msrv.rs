//! `msrv`: do the libraries keep to the Rust version that their manifests promise?
//!
//! | asked | how | step |
//! |---|---|---|
//! | no dependency of a library needs a newer compiler | what the locked versions declare, with all features | `msrv` |
//! | no library uses a newer part of the standard library | clippy's `incompatible_msrv`, with all features | `msrv` |
//! | that compiler builds them, newer syntax included | it does, or the step fails: it installs no compiler | `msrv-build`, by hand |
//!
//! `docs/reference/msrv.md` says what is proved by whom.

use crate::arguments::Arguments;
use crate::repository::{Failure, Library, Repository, capture, json, run as run_program};
use serde_json::Value;
use std::collections::BTreeSet;

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let promised = repository.rust_version()?;
    let mut libraries = repository.libraries()?;
    libraries.retain(|library| library.published);
    let names: Vec<&str> = libraries.iter().map(|library| library.name.as_str()).collect();

    let mut metadata = repository.cargo();
    let (metadata, _) = capture(metadata.args(["metadata", "--format-version", "1", "--locked", "--all-features"]))?;
    let (asked, newer) = dependencies(&json(&metadata)?, &names, &promised)?;
    println!("{} dependencies of {} libraries say which compiler they need", asked, names.len());
    if !newer.is_empty() {
        return Err(format!("Rust {promised} is promised, but\n  {}", newer.join("\n  ")));
    }

    let mut clippy = in_a_folder(repository, "clippy", "features", &libraries);
    run_program(clippy.args(["--", "-D", "clippy::incompatible_msrv"]))
}

/// Builds the libraries with the compiler that is promised. Where rustup does not have it, that is a failure.
pub fn build(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let promised = repository.rust_version()?;
    let mut libraries = repository.libraries()?;
    libraries.retain(|library| library.published);
    // rustup's cargo, which knows other compilers.
    let mut check = repository.command("cargo");
    // Which compilers a machine has is for its owner to say.
    check.env_remove("RUSTUP_TOOLCHAIN").env("RUSTUP_AUTO_INSTALL", "0").arg(format!("+{promised}"));
    run_program(check.args(arguments("check", &libraries)).arg("--target-dir").arg(repository.target("msrv")))
}

fn in_a_folder(repository: &Repository, command: &str, folder: &str, libraries: &[Library]) -> std::process::Command {
    let mut cargo = repository.cargo();
    cargo.env("CARGO_PROFILE_DEV_DEBUG", "false");
    cargo.args(arguments(command, libraries)).arg("--target-dir").arg(repository.target(folder));
    cargo
}

/// All libraries with all features, and nothing that only tests them.
fn arguments<'a>(command: &'a str, libraries: &'a [Library]) -> impl Iterator<Item = &'a str> {
    let packages = libraries.iter().flat_map(|library| ["-p", library.name.as_str()]);
    [command, "--quiet", "--locked", "--lib", "--all-features"].into_iter().chain(packages)
}

/// How many dependencies declare a version, and which of them need a newer compiler than the one promised.
fn dependencies(metadata: &Value, libraries: &[&str], promised: &str) -> Result<(usize, Vec<String>), Failure> {
    let list = |value: &Value| value.as_array().cloned().ok_or("unknown form of `cargo metadata`");
    let (packages, nodes) = (list(&metadata["packages"])?, list(&metadata["resolve"]["nodes"])?);
    let ours = packages.iter().filter(|package| libraries.iter().any(|name| package["name"] == **name));
    let mut open: Vec<&Value> = ours.map(|package| &package["id"]).collect();
    let mut reached = BTreeSet::new();
    while let Some(id) = open.pop() {
        if !reached.insert(id.to_string()) {
            continue;
        }
        let node = nodes.iter().find(|node| &node["id"] == id);
        for dependency in node.and_then(|node| node["deps"].as_array()).into_iter().flatten() {
            let kinds = dependency["dep_kinds"].as_array().into_iter().flatten();
            if kinds.into_iter().any(|kind| kind["kind"] != "dev") {
                open.push(&dependency["pkg"]);
            }
        }
    }
    let reached = packages.iter().filter(|package| reached.contains(&package["id"].to_string()));
    let declared: Vec<(&Value, &str)> =
        reached.filter_map(|package| Some((&package["name"], package["rust_version"].as_str()?))).collect();
    let newer = declared.iter().filter(|(_, version)| numbers(version) > numbers(promised));
    Ok((declared.len(), newer.map(|(name, version)| format!("{name} needs {version}")).collect()))
}

/// `1.89` and `1.89.0` are the same.
fn numbers(version: &str) -> [u32; 3] {
    let mut parts = version.split('.').map(|part| part.parse().unwrap_or(u32::MAX));
    std::array::from_fn(|_| parts.next().unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ours depends on `plain`, for tests on `tested`; `plain` depends on `deep`.
    fn metadata(deep: &str) -> Value {
        let package =
            |name: &str, version: &str| serde_json::json!({ "id": name, "name": name, "rust_version": version });
        let dependency =
            |name: &str, kind: Option<&str>| serde_json::json!({ "pkg": name, "dep_kinds": [{ "kind": kind }] });
        serde_json::json!({
            "packages": [package("ours", "1.89"), package("plain", "1.60"), package("deep", deep), package("tested", "1.99")],
            "resolve": { "nodes": [
                { "id": "ours", "deps": [dependency("plain", None), dependency("tested", Some("dev"))] },
                { "id": "plain", "deps": [dependency("deep", Some("build"))] },
                { "id": "deep", "deps": [] },
                { "id": "tested", "deps": [] },
            ] },
        })
    }

    #[test]
    fn a_dependency_that_needs_a_newer_compiler_is_found() {
        assert_eq!(dependencies(&metadata("1.89.0"), &["ours"], "1.89"), Ok((3, Vec::new())));
        let newer = vec!["\"deep\" needs 1.90".to_owned()];
        assert_eq!(dependencies(&metadata("1.90"), &["ours"], "1.89"), Ok((3, newer)));
        assert_eq!(dependencies(&metadata("1.90"), &["tested"], "1.99"), Ok((1, Vec::new())));
        assert!(dependencies(&Value::Null, &["ours"], "1.89").is_err());
    }

    #[test]
    fn versions_are_compared_as_numbers() {
        assert_eq!(numbers("1.89"), numbers("1.89.0"));
        assert!(numbers("1.100") > numbers("1.89.9"));
    }
}
