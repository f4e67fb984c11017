//! The sources of an earlier commit, to compare today's with.

use crate::repository::{Failure, Repository, capture, run};
use std::fs;
use std::path::{Path, PathBuf};

/// The sources of this commit, in a folder of their own. A clone that does not reach back so far fetches it.
pub fn sources(repository: &Repository, commit: &str) -> Result<PathBuf, Failure> {
    let folder = repository.target("commits").join(commit);
    if folder.exists() {
        return Ok(folder);
    }
    let git = |arguments: &[&str]| {
        let mut git = repository.command("git");
        git.args(arguments);
        git
    };
    if capture(&mut git(&["cat-file", "-e", &format!("{commit}^{{commit}}")])).is_err() {
        run(&mut git(&["fetch", "--quiet", "--depth", "1", "origin", commit]))?;
    }
    let io = |path: &Path, e: std::io::Error| format!("{}: {e}", path.display());
    // Unpacked beside it and then moved, so that half of it is never taken for all.
    let (archive, half) = (folder.with_extension("tar"), folder.with_extension("half"));
    let _ = fs::remove_dir_all(&half);
    fs::create_dir_all(&half).map_err(|e| io(&half, e))?;
    run(git(&["archive", "--output"]).arg(&archive).arg(commit))?;
    run(repository.command("tar").arg("-xf").arg(&archive).arg("-C").arg(&half))?;
    fs::rename(&half, &folder).map_err(|e| io(&folder, e))?;
    fs::remove_file(&archive).map_err(|e| io(&archive, e))?;
    Ok(folder)
}
