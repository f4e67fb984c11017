//! A copy of the sources in cargo's folder for generated files, for steps that change them.
//!
//! Files that have not changed keep their time, so that cargo builds again only what has.

use crate::repository::{Failure, Repository, capture};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Files, and what their copies hold where that is something else.
pub type Files = BTreeMap<PathBuf, Option<String>>;

/// Every file of the repository that git tracks or would add.
pub fn sources(repository: &Repository) -> Result<Files, Failure> {
    let mut list = repository.command("git");
    let (list, _) = capture(list.args(["ls-files", "--cached", "--others", "--exclude-standard"]))?;
    let there = list.lines().filter(|name| repository.root.join(name).is_file());
    Ok(there.map(|name| (name.into(), None)).collect())
}

/// Makes the folder `to` hold these files and no others.
pub fn copy(from: &Path, to: &Path, files: &Files) -> Result<(), Failure> {
    for (name, text) in files {
        let (source, copy) = (from.join(name), to.join(name));
        let io = |e: std::io::Error| format!("{}: {e}", name.display());
        let bytes =
            text.as_ref().map_or_else(|| fs::read(&source), |text| Ok(text.clone().into_bytes())).map_err(io)?;
        if fs::read(&copy).is_ok_and(|there| there == bytes) {
            continue;
        }
        fs::create_dir_all(copy.parent().unwrap_or(to)).map_err(io)?;
        fs::write(&copy, bytes).map_err(io)?;
    }
    remove_others(to, to, files).map_err(|e| format!("{}: {e}", to.display()))
}

fn remove_others(top: &Path, folder: &Path, files: &Files) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            remove_others(top, &path, files)?;
        } else if path.strip_prefix(top).is_ok_and(|name| !files.contains_key(name)) {
            fs::remove_file(path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_has_the_changed_text_and_no_old_files() {
        let top = std::env::temp_dir().join(format!("stampfly-copy-{}", std::process::id()));
        let (from, to) = (top.join("from"), top.join("to"));
        fs::create_dir_all(from.join("src")).expect("a folder");
        fs::write(from.join("src/a.rs"), "right").expect("a file");
        fs::write(from.join("b"), "same").expect("a file");
        let files = |names: &[(&str, Option<&str>)]| {
            names.iter().map(|(name, text)| (name.into(), text.map(str::to_owned))).collect::<BTreeMap<_, _>>()
        };
        copy(&from, &to, &files(&[("src/a.rs", Some("wrong")), ("b", None)])).expect("a copy");
        let time = || fs::metadata(to.join("b")).and_then(|data| data.modified()).expect("a file");
        let before = time();
        assert_eq!(fs::read_to_string(to.join("src/a.rs")).ok().as_deref(), Some("wrong"));
        copy(&from, &to, &files(&[("b", None)])).expect("a copy");
        assert!(!to.join("src/a.rs").exists() && time() == before);
        fs::remove_dir_all(top).expect("the folder");
    }
}
