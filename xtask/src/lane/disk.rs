//! Room on the disk. A push from nothing leaves 6 GB in `target`. A third of it is read by one step
//! alone, and by no other one of the same run.

use crate::repository::Repository;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// With less free space than this, kB, the folders of passed steps are removed. Two steps at a time add
/// 2.6 GB at most: all test programs and the firmware.
const ENOUGH: u64 = 3 << 20;

/// Steps, and the folders in `target` that no other step of a push reads.
const OWN: &[(&str, &[&str])] = &[
    ("clients", &["clients", "python/clients"]),
    ("demo", &["browser"]),
    ("doc", &["doc"]),
    ("esp32", &["esp32"]),
    ("ground", &["ground"]),
    ("panic-proof", &["panic-proof"]),
];

/// Removes the folders of these steps, which have passed, if the disk is nearly full.
pub fn make_room<'s>(repository: &Repository, passed: impl Iterator<Item = &'s str>) {
    if free(repository).is_none_or(|free| free > ENOUGH) {
        return;
    }
    for folder in passed.flat_map(|step| remove(&repository.target(""), step)) {
        eprintln!("removed {}: the disk is nearly full", folder.display());
    }
}

/// Free space where `target` is, kB, as `df` says; `None` on a machine without that program.
fn free(repository: &Repository) -> Option<u64> {
    let output = Command::new("df").args(["--output=avail", "-k"]).arg(&repository.root).output().ok()?;
    String::from_utf8_lossy(&output.stdout).lines().nth(1)?.trim().parse().ok()
}

/// Removes the folders of this step. Gives those that are gone.
fn remove(target: &Path, step: &str) -> Vec<PathBuf> {
    let own = OWN.iter().filter(|(name, _)| *name == step).flat_map(|(_, folders)| *folders);
    let mut gone = Vec::new();
    for folder in own.map(|folder| target.join(folder)) {
        let (Some(parent), Some(prefix)) = (folder.parent(), folder.file_name()) else { continue };
        let prefix = prefix.to_string_lossy();
        // A folder of Python packages has their versions in its name.
        let is_own =
            |name: &str| name.strip_prefix(&*prefix).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'));
        let entries = fs::read_dir(parent).into_iter().flatten().flatten();
        let entries = entries.filter(|entry| is_own(&entry.file_name().to_string_lossy())).map(|entry| entry.path());
        gone.extend(entries.filter(|path| fs::remove_dir_all(path).is_ok()));
    }
    gone
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::Lane;

    #[test]
    fn only_the_folders_of_the_step_go() {
        let target = std::env::temp_dir().join(format!("stampfly-disk-{}", std::process::id()));
        for folder in ["clients", "python/clients-pymavlink", "python/mypy", "esp32", "debug"] {
            fs::create_dir_all(target.join(folder)).expect("a folder");
        }
        let gone = remove(&target, "clients");
        let there = |folder: &str| target.join(folder).exists();
        assert_eq!(gone.len(), 2, "{gone:?}");
        assert!(there("python/mypy") && there("esp32") && there("debug") && !there("clients"));
        assert!(remove(&target, "clippy").is_empty());
        fs::remove_dir_all(&target).expect("removed");
    }

    #[test]
    fn the_steps_are_those_of_a_push() {
        let is_step = |name: &str| crate::STEPS.iter().any(|step| step.name == name && step.lane == Lane::Ci);
        assert!(OWN.iter().all(|(name, _)| is_step(name)));
    }
}
